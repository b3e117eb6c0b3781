"""Both cameras of a shell as machines."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.prototype.run import HALF_TURN
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.rig.machine.designed import machine_run
from tbcad.rig.machine.shells import (
    designed_half,
    perfect_half,
    plan_of,
    random_half,
    shell_frame,
    shell_plan,
    tied,
)
from tbcad.rig.simulated_run.led_light import balls_of_frame
from tbcad.rig.simulated_run.photographs import object_light, pixel_directions
from tbcad.tolerancing.montecarlo.draws import draw
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.sharpness import built_reflector

FLIPS = (np.ones(3), HALF_TURN)
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
