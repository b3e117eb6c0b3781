"""Simulated builds of a machine."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.rig.machine.designed import BuiltPrototype, draw_other_errors, random_build
from tbcad.rig.machine.machine import Machine
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tests.machine_states import machine_of

LEDS = np.array([[18.0, 14.0, -8.0], [-10.0, -20.0, -5.0]])


@pytest.fixture(scope="module")
def designed(export: ExportedDesign, plan: Plan) -> Machine:
    return replace(machine_of(export, plan), leds=LEDS)


def still_build(designed: Machine, plan: Plan, errors: Errors) -> BuiltPrototype:
    """A build that gravity does not turn."""
    return random_build(designed, plan, errors, seed=5, wind_up=np.zeros(len(plan.angle)))


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
    built = still_build(designed, plan, Errors(axis_runout=Error(0.01)))
    frames, spheres = np.arange(len(designed.angle)), np.zeros(len(designed.angle), dtype=int)
    moved = built.machine.centres(frames, spheres) - designed.centres(frames, spheres)
    assert moved @ designed.axis == pytest.approx(0, abs=1e-12)
    # Two components of 0.01 mm each: the mean square of the distance is twice its square.
    assert (moved**2).sum(axis=1).mean() == pytest.approx(2e-4, rel=0.5)


def test_axis_and_spheres_tilt_together(designed: Machine, plan: Plan) -> None:
    built = still_build(designed, plan, Errors(axis_tilt=Error(0.01)))
    assert built.machine.centre @ built.machine.axis == pytest.approx(plan.centre @ plan.frame[0])
    assert norm(built.machine.axis - plan.frame[0]) > 1e-3
