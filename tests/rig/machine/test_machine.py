"""Highlights of a machine that rotates."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.reflection import reflection_points
from tests.rig.machine.test_record import MACHINE


def test_axis_point_and_radius_stay() -> None:
    frame, sphere = np.array([0, 1]), np.array([2, 2])
    here, there = replace(MACHINE, shift=None).centres(frame, sphere)
    for point in (here, there):
        assert norm(point - MACHINE.axis_point) == pytest.approx(
            norm(MACHINE.centre[2] - MACHINE.axis_point)
        )
    assert (there - here) @ MACHINE.axis == pytest.approx(0, abs=1e-12)


def test_a_shift_moves_all_spheres_of_a_frame() -> None:
    assert MACHINE.shift is not None
    frame, sphere = np.array([0, 1, 1]), np.array([2, 2, 0])
    still = replace(MACHINE, shift=None).centres(frame, sphere)
    assert MACHINE.centres(frame, sphere) - still == pytest.approx(MACHINE.shift[frame])


def test_highlight_is_where_light_is_reflected() -> None:
    frame, sphere, led = np.array([1]), np.array([0]), np.array([1])
    pixel = MACHINE.highlights(frame, sphere, led)
    centre, pinhole = MACHINE.centres(frame, sphere), MACHINE.camera.pinhole
    point = reflection_points(centre, MACHINE.radius[sphere], MACHINE.leds[led], pinhole)
    assert MACHINE.camera.directions(pixel) == pytest.approx(unit(point - pinhole), abs=1e-9)
