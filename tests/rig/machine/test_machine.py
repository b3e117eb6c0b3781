"""Highlights of a machine that rotates; machine.json gives back the machine that was written."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.camera import Camera, without_distortion
from tbcad.core.optics.reflection import reflection_points
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.ball_rays import trace_balls
from tbcad.light.simulate.prototype.run import HALF_TURN, Plan, prototype_runs
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.run import Frame
from tbcad.rig.machine.designed import (
    BuiltPrototype,
    draw_other_errors,
    machine_runs,
    random_build,
    stops_known,
)
from tbcad.rig.machine.machine import Machine, read_machine, write_machine
from tbcad.tolerancing.montecarlo.error_kinds import BEARINGS_MM, Error, Errors
from tbcad.tolerancing.prototype.gravity import weightless
from tests.machine_states import frames_of, machine_of, perturbed

FORWARD = unit(np.array([-0.2, 0.0, 1.0]))
DESIGNED = Camera(
    np.array([100.0, 0.0, -100.0]), FORWARD, np.array([0.0, -1.0, 0.0]), 2080, 1552, 1.55
)
CAMERA = replace(without_distortion(DESIGNED), distortion=np.array([-0.05, 0.01, 1e-3, -5e-4, 0.0]))
FRAMES = tuple(Frame(object_turn_deg=0, stop=s, base_angle_deg=10.0 * s) for s in (1, 2))
MACHINE = Machine(
    camera=CAMERA,
    axis=unit(np.array([1.0, 0.0, -1.0])),
    axis_point=np.array([0.1, 0.2, 0.3]),
    angle=np.array([0.2, 0.4]),
    centre=np.array([[60.0, 10.0, 40.0], [70.0, -20.0, 30.0], [80.0, 5.0, 20.0]]),
    radius=np.array([10.0, 15.0, 20.0]),
    leds=np.array([[18.0, 14.0, -8.0], [-10.0, -20.0, -5.0]]),
    shift=np.array([[0.01, 0.0, -0.02], [0.0, 0.03, 0.0]]),
)
LEDS = np.array([[18.0, 14.0, -8.0], [-10.0, -20.0, -5.0]])


def test_round_trip(tmp_path: Path) -> None:
    write_machine(tmp_path / "machine.json", replace(MACHINE, shift=None), FRAMES)
    assert read_machine(tmp_path / "machine.json")[0].shift is None
    write_machine(tmp_path / "machine.json", MACHINE, FRAMES)
    found, frames = read_machine(tmp_path / "machine.json")
    assert frames == FRAMES
    assert found.centre == pytest.approx(MACHINE.centre, abs=0)
    assert found.angle == pytest.approx(MACHINE.angle, rel=1e-15)
    assert found.shift == pytest.approx(MACHINE.shift, abs=0)
    assert found.camera.distortion == pytest.approx(CAMERA.distortion, abs=0)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("axis", [1.0, 0.0, -1.0], "no unit vectors"),
        ("angle_deg", [1.0], "another number of angles"),
        ("shift_mm", [[0.0, 0.0, 0.0]], "another number of shifts"),
        ("spheres", [{"centre_mm": [0, 0, 0], "radius_mm": -1}], "greater than 0"),
    ],
)
def test_refused(tmp_path: Path, key: str, value: object, message: str) -> None:
    path = tmp_path / "machine.json"
    write_machine(path, MACHINE, FRAMES)
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    with pytest.raises(InputError, match=message):
        read_machine(path)


def test_spheres_turn_about_the_axis_and_shift_together() -> None:
    assert MACHINE.shift is not None
    frame, sphere = np.array([0, 1, 1]), np.array([2, 2, 0])
    still = replace(MACHINE, shift=None).centres(frame, sphere)
    away = norm(still - MACHINE.axis_point)
    assert away == pytest.approx(norm(MACHINE.centre[sphere] - MACHINE.axis_point))
    assert (still[1] - still[0]) @ MACHINE.axis == pytest.approx(0, abs=1e-12)
    assert MACHINE.centres(frame, sphere) - still == pytest.approx(MACHINE.shift[frame])


def test_highlight_is_where_light_is_reflected() -> None:
    frame, sphere, led = np.array([1]), np.array([0]), np.array([1])
    pixel = MACHINE.highlights(frame, sphere, led)
    centre, pinhole = MACHINE.centres(frame, sphere), MACHINE.camera.pinhole
    point = reflection_points(centre, MACHINE.radius[sphere], MACHINE.leds[led], pinhole)
    assert MACHINE.camera.directions(pixel) == pytest.approx(unit(point - pinhole), abs=1e-9)


@pytest.fixture(scope="module")
def designed(export: ExportedDesign, plan: Plan) -> Machine:
    return replace(machine_of(export, plan), leds=LEDS)


def still_build(designed: Machine, plan: Plan, errors: Errors) -> BuiltPrototype:
    """A build that gravity does not turn."""
    return random_build(designed, plan, errors, seed=5, gravity=weightless(plan))


def test_a_build_without_errors_of_the_process_has_those_of_lens_and_leds(
    designed: Machine, plan: Plan
) -> None:
    built = still_build(designed, plan, Errors()).machine
    other = draw_other_errors(len(LEDS), 5)
    assert built.centre == pytest.approx(designed.centre, abs=1e-12)
    assert built.leds - LEDS == pytest.approx(other.leds)
    assert built.camera.distortion == pytest.approx(other.distortion)


def test_a_moved_optical_axis_is_turned_back(designed: Machine, plan: Plan) -> None:
    built = still_build(designed, plan, Errors()).machine.camera
    ahead = designed.camera.pinhole + 100 * designed.camera.axes[2]
    place = replace(built, distortion=np.zeros(5)).project(ahead)
    moved = norm(built.principal - designed.camera.principal)
    assert norm(place - designed.camera.principal) < moved**2 / designed.camera.focal[0]


def test_runout_moves_the_spheres_across_the_axis(designed: Machine, plan: Plan) -> None:
    built = still_build(designed, plan, Errors(axis_runout=Error(0.01))).machine
    frames, spheres = np.arange(len(designed.angle)), np.zeros(len(designed.angle), dtype=int)
    straight = replace(built, turn=None)
    moved = straight.centres(frames, spheres) - designed.centres(frames, spheres)
    assert moved @ designed.axis == pytest.approx(0, abs=1e-12)
    # Two components of 0.01 mm each: the mean square of the distance is twice its square.
    assert (moved**2).sum(axis=1).mean() == pytest.approx(2e-4, rel=0.5)
    assert built.turn is not None
    # The run-outs of both bearings, one against the other.
    assert (built.turn**2).sum(axis=1).mean() == pytest.approx(4e-4 / BEARINGS_MM**2, rel=0.5)


def test_axis_and_spheres_tilt_together(designed: Machine, plan: Plan) -> None:
    built = still_build(designed, plan, Errors(axis_tilt=Error(0.01)))
    assert built.machine.centre @ built.machine.axis == pytest.approx(plan.centre @ plan.frame[0])
    assert norm(built.machine.axis - plan.frame[0]) > 1e-3


def test_the_designed_machine_has_the_plans_runs(export: ExportedDesign, plan: Plan) -> None:
    found = machine_runs(export, plan, machine_of(export, plan), frames_of(plan))
    for one, other in zip(found, prototype_runs(export.reflectors, plan), strict=True):
        assert one.balls == pytest.approx(other.balls, abs=1e-12)
        assert one.window_rotation == pytest.approx(other.window_rotation, abs=1e-12)
        assert one.camera.pinhole == pytest.approx(other.camera.pinhole)


def test_balls_of_a_real_machine_are_where_it_has_them(export: ExportedDesign, plan: Plan) -> None:
    machine, frames = perturbed(machine_of(export, plan), seed=3), frames_of(plan)
    runs = machine_runs(export, plan, machine, frames)
    for half, (run, flip) in enumerate(zip(runs, (np.ones(3), HALF_TURN), strict=True)):
        for stop in (0, len(plan.angle) - 1):
            frame = np.full(len(plan), half * len(plan.angle) + stop)
            centre = machine.centres(frame, np.arange(len(plan))) * flip
            assert run.balls[stop, :, :3] == pytest.approx(centre, abs=1e-12)
        assert (run.balls[..., 3] == machine.radius).all()


def test_a_windows_middle_shows_the_objects_middle_by_the_real_ball(
    export: ExportedDesign, plan: Plan
) -> None:
    machine = perturbed(machine_of(export, plan), seed=5)
    for run in machine_runs(export, plan, machine, frames_of(plan)):
        straight = unit(run.reflector.mirrors.apex - run.reflector.camera.pinhole)
        direction = np.einsum("nx,nxy->ny", straight, run.window_rotation)
        seen = trace_balls(run, direction, run.stop)
        assert (seen.ball == run.ball + 1).all()
        assert norm(np.cross(seen.origin, seen.direction)).max() < 1e-9


def test_windows_that_stay_do_so_relative_to_the_ball(export: ExportedDesign, plan: Plan) -> None:
    """A designed machine's are where they were; a camera that turned does not move them."""
    still = replace(plan, moved=False)
    machine = machine_of(export, plan)
    run = machine_runs(export, still, machine, frames_of(plan))[0]
    assert run.window_rotation == pytest.approx(np.tile(np.eye(3), (len(run.stop), 1, 1)), abs=1e-9)
    moved = machine_runs(export, still, perturbed(machine, seed=5), frames_of(plan))[0]
    designed = unit(plan.apex[plan.ball[0]])  # any directions: a rotation keeps angles
    turned = np.einsum("nx,nxy->ny", designed, moved.window_rotation)
    assert 0 < norm(turned - designed).max() < 0.1


def test_stops_without_a_frame_are_at_the_plans_angle(export: ExportedDesign, plan: Plan) -> None:
    machine, frames = machine_of(export, plan), frames_of(plan)
    turned = replace(machine, angle=machine.angle + 0.01)
    kept = frames[1:]
    run = machine_runs(export, plan, replace(turned, angle=turned.angle[1:]), kept)[0]
    expected = machine_runs(export, plan, machine, frames)[0]
    assert run.balls[0] == pytest.approx(expected.balls[0], abs=1e-12)
    assert not stops_known(plan, kept)[0, 0]
    assert stops_known(plan, kept).sum() == 2 * len(plan.angle) - 1


def test_another_number_of_balls_is_refused(export: ExportedDesign, plan: Plan) -> None:
    machine = machine_of(export, plan)
    few = replace(machine, centre=machine.centre[1:], radius=machine.radius[1:])
    with pytest.raises(InputError, match=f"has {len(plan) - 1} balls"):
        machine_runs(export, plan, few, frames_of(plan))
