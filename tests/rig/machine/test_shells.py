"""Both cameras of a shell as machines; of one with pedestals, grooves part the pictures."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.mirrors.record import write_record
from tbcad.core.optics.pedestals.cells import NO_WALLS
from tbcad.errors import InputError
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.prototype.ball_rays import BallHits, ball_hits
from tbcad.light.simulate.prototype.merge import merge_plan, merged_pixels
from tbcad.light.simulate.prototype.run import HALF_TURN
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, read_export
from tbcad.rig.machine.designed import BuiltPrototype, machine_run
from tbcad.rig.machine.shells import (
    designed_half,
    perfect_half,
    plan_of,
    random_half,
    shell_frame,
    shell_plan,
    tied,
)
from tbcad.rig.simulated_run.led_light import LightPoints, Occluders, balls_of_frame, led_light
from tbcad.rig.simulated_run.photographs import object_light, pixel_directions
from tbcad.tolerancing.montecarlo.draws import draw
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.sharpness import built_reflector
from tests.pedestal_designs import pedestal_design

SETTINGS = ("n=6", "camera.width_px=416", "camera.height_px=310", "shell.groove_mm=0.4")
FLIPS = (np.ones(3), HALF_TURN)
CENTRE = (0.0, 0.0)
AT_EDGE_MM = 3.0
GROOVE_ERRORS = Errors(
    sphere_centre=Error(0.02),
    scale_isotropic=Error(0.01),
    shell_shift=Error(0.4),
    shell_tilt=Error(5e-3),
    camera_shift=Error(0.2),
    groove_wall=Error(0.2),
)


@pytest.fixture(scope="module")
def pedestals(tmp_path_factory: pytest.TempPathFactory) -> ExportedDesign:
    folder: Path = tmp_path_factory.mktemp("pedestals")
    write_record(folder, pedestal_design(*SETTINGS), shells=False)
    return read_export(folder)


def hits_of(built: BuiltPrototype) -> BallHits:
    """What the pixels of the first frame meet."""
    camera = built.machine.camera
    direction = pixel_directions(camera).reshape(-1, 3)
    stop = np.zeros(len(direction), dtype=np.int64)
    return ball_hits(camera.pinhole, balls_of_frame(built, 0)[None], direction, stop, built.walls)


def traced(at: Reflector) -> np.ndarray:
    return exact_tracer(at)(range(at.camera.height_px), CENTRE).mirror.ravel()


@pytest.mark.parametrize("half", [0, 1])
def test_pixels_meet_the_mirrors_of_the_capture(pedestals: ExportedDesign, half: int) -> None:
    reflector = pedestals.reflectors[half]
    built = perfect_half(pedestals, half)
    expected = traced(reflector)
    assert np.array_equal(hits_of(built).ball, expected)
    whole = hits_of(replace(built, walls=NO_WALLS))
    assert (whole.ball != expected).mean() > 0.3  # grooves, and spheres beyond seam and foot


@pytest.mark.parametrize("half", [0, 1])
def test_grooved_builds_are_those_of_the_study(pedestals: ExportedDesign, half: int) -> None:
    reflector, built = (
        pedestals.reflectors[half],
        random_half(pedestals, half, GROOVE_ERRORS, seed=7),
    )
    draws = draw(GROOVE_ERRORS, 7, [0], len(reflector), None, len(reflector.walls))[half]
    expected = built_reflector(reflector, draws, 0)
    # The picture of a real lens is another, so the pixels are compared before the study's.
    ideal = designed_half(pedestals, half).camera
    right, down, forward = (FLIPS[half] * axis for axis in expected.camera.axes)
    camera = replace(
        ideal,
        pinhole=built.machine.camera.pinhole,
        axes=np.array([right, down, forward]),
        focal=ideal.focal,
    )
    hits = hits_of(replace(built, machine=replace(built.machine, camera=camera)))
    reach = np.where(np.isfinite(hits.distance), hits.distance, 0)
    point = camera.pinhole + reach[:, None] * pixel_directions(camera).reshape(-1, 3)
    # The study leaves seam and foot where they are designed.
    inside = (point[:, 0] > AT_EDGE_MM) & (point[:, 2] > reflector.foot + AT_EDGE_MM)
    assert inside.mean() > 0.5
    differ = hits.ball[inside] != traced(expected)[inside]
    # Walls as far off as these stand in the way of a few rays, which the study lets pass.
    assert differ.mean() < 2e-4
    assert not hits.ball[inside][differ].any()


def test_highlights_are_on_their_own_mirrors(pedestals: ExportedDesign) -> None:
    """Each point of light of a small LED falls on a pixel of a mirror, none into a groove."""
    built, cell = perfect_half(pedestals, 0), traced(pedestals.reflectors[0]).reshape(310, 416)
    points = led_light(built, 0, False, Occluders(None, None), dome=0.01)
    assert on_mirrors(points, cell) == 1
    whole = led_light(replace(built, walls=NO_WALLS), 0, False, Occluders(None, None), dome=0.01)
    assert len(whole.pixel) > len(points.pixel)
    assert on_mirrors(whole, cell) < 1


def on_mirrors(points: LightPoints, cell: np.ndarray) -> float:
    """Share of points whose pixel, or one beside it, is a mirror's."""
    column, row = np.rint(points.pixel).astype(int).T
    beside = [cell[row + dy, column + dx] > 0 for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
    return float(np.any(beside, axis=0).mean())


@pytest.mark.parametrize("half", [0, 1])
def test_a_merge_has_a_ray_for_each_pixel_of_a_mirror(pedestals: ExportedDesign, half: int) -> None:
    """Whole spheres of neighbours, which rise above the grooves, take no pixel away."""
    machine, plan = designed_half(pedestals, half), shell_plan(pedestals, half)
    run = machine_run(pedestals, plan, machine, (shell_frame(half),), half)
    merged = merge_plan(run, 30.0, lambda mirror, *_: np.zeros(len(mirror), dtype=bool))
    mirror, hits, _ = merged_pixels(merged, range(310))
    assert np.array_equal(hits.ball, mirror)
    assert np.array_equal(mirror, traced(pedestals.reflectors[half]))
    joined = replace(merged, run=replace(run, parted=False))
    assert (merged_pixels(joined, range(310))[1].ball != mirror).any()


ROWS = slice(60, 300, 8)  # of the picture, that are compared
ERRORS = Errors(
    sphere_centre=Error(0.05),
    sphere_radius=Error(0.02),
    scale_isotropic=Error(0.002),
    shell_shift=Error(0.1),
    shell_tilt=Error(0.002),
    camera_shift=Error(0.2),
)


@pytest.fixture(scope="module")
def export(record: Path) -> ExportedDesign:
    return read_export(record)


@pytest.mark.parametrize("half", [0, 1])
def test_mirrors_serve_their_own_places(export: ExportedDesign, half: int) -> None:
    machine, frames = designed_half(export, half), (shell_frame(half),)
    assert plan_of(export, "shell", frames).ball[half].tolist() == [*range(len(machine.radius))]
    run = machine_run(export, shell_plan(export, half), machine, frames, half)
    mirrors = export.reflectors[half].mirrors
    assert run.camera.pinhole == pytest.approx(export.reflectors[half].camera.pinhole)
    assert run.ball_surfaces.centre == pytest.approx(mirrors.centre, abs=1e-9)
    assert run.ball_surfaces.radius == pytest.approx(mirrors.radius)


@pytest.mark.parametrize("half", [0, 1])
def test_photographs_are_those_of_the_shell(export: ExportedDesign, half: int) -> None:
    """As tbcad capture has them; mirrors end at seam and foot."""
    scene, reflector = prepared_scene(built_in_object(40.0)), export.reflectors[half]
    built = perfect_half(export, half)
    camera = built.machine.camera
    directions = pixel_directions(camera)[ROWS]
    balls = balls_of_frame(built, 0)
    mine = object_light(camera.pinhole, directions, balls, scene, half == 1, built.walls)
    bands = photograph(reflector.camera, exact_tracer(reflector), scene)
    theirs = np.concatenate([band.colour for band in bands])[ROWS]
    lit = theirs.max(axis=-1) > 0
    assert lit.sum() > 500
    assert np.abs(mine - theirs)[lit].max() <= 1
    assert not mine[~lit].any()


def test_builds_are_those_of_the_tolerance_study(export: ExportedDesign) -> None:
    """Both cameras are lenses of their own and see the same LEDs."""
    a, b = (random_half(export, half, ERRORS, seed=7).machine for half in (0, 1))
    for half, built in enumerate((a, b)):
        reflector = export.reflectors[half]
        expected = built_reflector(reflector, draw(ERRORS, 7, [0], len(reflector))[half], 0)
        assert built.centre * FLIPS[half] == pytest.approx(expected.mirrors.centre, abs=1e-9)
        assert built.radius == pytest.approx(expected.mirrors.radius)
        assert built.camera.pinhole * FLIPS[half] == pytest.approx(expected.camera.pinhole)
    assert b.leds * HALF_TURN == pytest.approx(a.leds)
    assert np.abs(a.camera.distortion - b.camera.distortion).max() > 0


def test_machines_are_tied_by_their_leds(export: ExportedDesign) -> None:
    machines = [designed_half(export, half) for half in (0, 1)]
    lost = machines[1].moved(np.array([0.3, -0.2, 0.1]))
    frames = [(shell_frame(half),) for half in (0, 1)]
    assert tied([(machines[0], frames[0])]) == [machines[0]]
    first, found = tied([(machines[0], frames[0]), (lost, frames[1])])
    assert first is machines[0]
    for name in ("centre", "leds", "axis_point"):
        assert getattr(found, name) == pytest.approx(getattr(machines[1], name), abs=1e-12)
    assert found.camera.pinhole == pytest.approx(machines[1].camera.pinhole)


def test_planar_mirrors_are_refused(export: ExportedDesign) -> None:
    a, b = export.reflectors
    flat = replace(a.cells.surfaces, curvature=0 * a.cells.surfaces.curvature)
    planar = replace(a, cells=replace(a.cells, surfaces=flat))
    with pytest.raises(InputError, match="planar mirrors, which LEDs do not calibrate"):
        designed_half(export.model_copy(update={"reflectors": (planar, b)}), 0)
