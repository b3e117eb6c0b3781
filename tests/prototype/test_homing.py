"""Zero disc and switch: what fits at angle zero, what the tab presses, and where it does."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.geometry.primitives import Cylinder, Prism
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.travel import (
    MIN_BELOW_DEG,
    HomeAngles,
    free_base_angles,
    home_angles,
    stop_sequence,
)
from tbcad.prototype.frame.layout import FrameLayout
from tbcad.prototype.homing import PIN_HOLE_MM, ROLLER_MM, homing_layout, tab_radius
from tbcad.prototype.printed import component_solid
from tbcad.prototype.purchased.parts import load_parts
from tbcad.types import Floats

PARTS = load_parts()


def polar(base: BaseLayout, points: Floats) -> tuple[Floats, Floats]:
    """Distance from the axis, and azimuth in degrees."""
    _, out, side = base.frame @ points.T
    return np.hypot(out, side), np.degrees(np.arctan2(side, out))


def test_the_pin_goes_through_disc_and_head_at_angle_zero(
    frame: FrameLayout, carrier: BaseLayout
) -> None:
    holes = [
        body
        for component in (frame.homing.disc, frame.head.component)
        for body in component.removed
        if isinstance(body, Cylinder) and body.radius == PIN_HOLE_MM / 2
    ]
    disc, head = holes
    assert norm(np.cross(disc.start - head.start, carrier.frame[0])) < 1e-9
    back = min((body.start + body.length * body.axis) @ carrier.frame[0] for body in holes)
    length = PARTS[frame.homing.pin]["length_mm"]
    assert length >= carrier.hub.face - back


def test_the_tab_presses_the_roller_from_the_switchs_angle_down(
    frame: FrameLayout, carrier: BaseLayout
) -> None:
    homing = frame.homing
    (roller,) = (body for body in homing.switch.added if isinstance(body, Cylinder))
    distance, azimuth = polar(carrier, roller.start[None])
    tab = homing.disc.added[1]
    assert isinstance(tab, Prism)
    radius, corner = polar(carrier, tab.corners)
    top = radius > radius.max() - 1e-6
    assert 0 < distance[0] - ROLLER_MM / 2 - radius.max() < 1
    assert radius.max() == pytest.approx(tab_radius(frame.head.plate.half_width))
    # Seen from the roller, the arc begins at the switch's angle.
    at_switch = (corner[top] + homing.angles.switch - azimuth[0] + 180) % 360 - 180
    assert at_switch.min() == pytest.approx(0, abs=1e-6)
    assert at_switch.max() > 5


def test_homing_is_below_the_program_and_free(small_prototype: PrototypeLayout) -> None:
    angles = home_angles(small_prototype, MotionSpec())
    start = stop_sequence(small_prototype, MotionSpec()).start
    assert np.degrees(free_base_angles(small_prototype)[0]) < angles.switch < start - MIN_BELOW_DEG
    assert angles.switch < angles.homed < start
    last = np.degrees(small_prototype.stops.angle[-1])
    assert angles.switch + angles.travel > last


def test_no_room_below_the_first_stop(small_prototype: PrototypeLayout) -> None:
    low = np.degrees(free_base_angles(small_prototype)[0])
    problem = replace(small_prototype.problem, max_swing=2 * float(-small_prototype.stops.angle[0]))
    tight = replace(small_prototype, problem=problem)
    with pytest.raises(SpecError, match="leaves no room for a switch below its first angle"):
        home_angles(tight, MotionSpec())
    assert home_angles(tight, MotionSpec(controller="grbl")).switch > low


def test_the_parts_are_solids_and_a_swing_may_leave_no_room_for_the_tab(
    frame: FrameLayout, carrier: BaseLayout
) -> None:
    for component in (frame.homing.disc, frame.homing.bracket, frame.homing.switch):
        assert component_solid(component)
    whole = HomeAngles(-170.0, -168.0, 345.0)
    with pytest.raises(SpecError, match="no room for the tab"):
        homing_layout(carrier, frame.head.plate, whole, PARTS)
