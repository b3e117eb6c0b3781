"""Zero disc and switch: solids, the angles of homing, and what has no room."""

from dataclasses import replace
from unittest import mock

import numpy as np
import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype import homing as laid_out
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import (
    MIN_BELOW_DEG,
    HomeAngles,
    free_base_angles,
    home_angles,
    stop_sequence,
)
from tbcad.prototype.homing import HomingLayout
from tbcad.prototype.part import FrameLayout, Site
from tbcad.prototype.printed import component_solid
from tbcad.prototype.purchased.parts import load_parts

PARTS = load_parts()


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
    site: Site, frame: FrameLayout
) -> None:
    homing = frame.of(HomingLayout)
    for component in (homing.disc, *homing.printed, *homing.purchased):
        assert component_solid(component)
    whole = HomeAngles(-170.0, -168.0, 345.0)
    with (
        mock.patch.object(laid_out, "home_angles", return_value=whole),
        pytest.raises(SpecError, match="no room for the tab"),
    ):
        laid_out.homing_layout(site, frame)
