"""Photographs of shells with mirrors on pedestals: grooves part the pictures of the mirrors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.mirrors.record import write_record
from tbcad.core.optics.pedestals.cells import NO_WALLS
from tbcad.light.simulate.prototype.ball_rays import BallHits, ball_hits
from tbcad.light.simulate.prototype.merge import merge_plan, merged_pixels
from tbcad.light.simulate.prototype.run import HALF_TURN
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector, read_export
from tbcad.rig.machine.designed import BuiltPrototype, machine_run
from tbcad.rig.machine.shells import (
    designed_half,
    perfect_half,
    random_half,
    shell_frame,
    shell_plan,
)
from tbcad.rig.simulated_run.led_light import LightPoints, Occluders, balls_of_frame, led_light
from tbcad.rig.simulated_run.photographs import pixel_directions
from tbcad.tolerancing.montecarlo.draws import draw
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.sharpness import built_reflector
from tests.pedestal_designs import pedestal_design

SETTINGS = ("n=6", "camera.width_px=416", "camera.height_px=310", "shell.groove_mm=0.4")
FLIPS = (np.ones(3), HALF_TURN)
CENTRE = (0.0, 0.0)
AT_EDGE_MM = 3.0
ERRORS = Errors(
    sphere_centre=Error(0.02),
    scale_isotropic=Error(0.01),
    shell_shift=Error(0.4),
    shell_tilt=Error(5e-3),
    camera_shift=Error(0.2),
    groove_wall=Error(0.2),
)


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> ExportedDesign:
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
def test_pixels_meet_the_mirrors_that_the_capture_meets(export: ExportedDesign, half: int) -> None:
    reflector = export.reflectors[half]
    built = perfect_half(export, half)
    expected = traced(reflector)
    assert np.array_equal(hits_of(built).ball, expected)
    whole = hits_of(replace(built, walls=NO_WALLS))
    assert (whole.ball != expected).mean() > 0.3  # grooves, and spheres beyond seam and foot


@pytest.mark.parametrize("half", [0, 1])
def test_builds_are_those_of_the_tolerance_study(export: ExportedDesign, half: int) -> None:
    reflector, built = export.reflectors[half], random_half(export, half, ERRORS, seed=7)
    draws = draw(ERRORS, 7, [0], len(reflector), None, len(reflector.walls))[half]
    expected = built_reflector(reflector, draws, 0)
    # The picture of a real lens is another, so the pixels are compared before the study's.
    ideal = designed_half(export, half).camera
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


def test_highlights_are_on_their_own_mirrors(export: ExportedDesign) -> None:
    """Each point of light of a small LED falls on a pixel of a mirror, none into a groove."""
    built, cell = perfect_half(export, 0), traced(export.reflectors[0]).reshape(310, 416)
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
def test_a_merge_has_a_ray_for_each_pixel_of_a_mirror(export: ExportedDesign, half: int) -> None:
    """Whole spheres of neighbours, which rise above the grooves, take no pixel away."""
    machine, plan = designed_half(export, half), shell_plan(export, half)
    run = machine_run(export, plan, machine, (shell_frame(half),), half)
    merged = merge_plan(run, 30.0, lambda mirror, *_: np.zeros(len(mirror), dtype=bool))
    mirror, hits, _, _ = merged_pixels(merged, range(310))
    assert np.array_equal(hits.ball, mirror)
    assert np.array_equal(mirror, traced(export.reflectors[half]))
    joined = replace(merged, run=replace(run, parted=False))
    assert (merged_pixels(joined, range(310))[1].ball != mirror).any()
