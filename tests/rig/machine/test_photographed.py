"""Runs of a machine: those of the plan for the designed one, and where a real one is."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.ball_rays import trace_balls
from tbcad.light.simulate.prototype.run import HALF_TURN, Plan, prototype_runs
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.rig.machine.designed import machine_runs, stops_known
from tests.machine_states import frames_of, machine_of, perturbed


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
