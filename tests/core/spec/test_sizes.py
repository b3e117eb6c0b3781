"""Lengths that follow from the optics."""

import math

from hypothesis import given
from hypothesis import strategies as st

from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import load_spec, spec_dict


def test_the_papers_design_has_the_sizes_it_was_tried_with() -> None:
    prototype = load_spec(None).prototype
    assert (prototype.largest_ball_mm, prototype.ball_wall_mm) == (60, 3)
    assert (prototype.post_diameter_mm, prototype.camera_diameter_mm) == (20, 60)
    assert (prototype.auto_direction_max_deg, prototype.auto_direction_median_deg) == (3.5, 1.5)
    assert (prototype.stage.disc_mm, prototype.stage.top_mm) == (17, -19)
    assert prototype.stage.leds_mm[0] == (23.1, -4.1, -8.0)
    assert prototype.frame.floor_mm == -230


def test_half_the_size() -> None:
    options = ["capture_diameter_mm=30", "camera_mm=[50, 0, -50]", "semi_minor_mm=50"]
    prototype = load_spec(None, options).prototype
    assert (prototype.largest_ball_mm, prototype.ball_wall_mm) == (40, 2)
    assert (prototype.post_diameter_mm, prototype.camera_diameter_mm) == (10, 40)
    assert (prototype.stage.disc_mm, prototype.stage.leds_mm) == (12, ())
    assert prototype.frame.floor_mm == -180


def test_what_the_user_sets_stays() -> None:
    options = ["post_diameter_mm=12", "leds_mm=[]", "frame.floor_mm=-300", "top_mm=-5"]
    prototype = load_spec(None, options).prototype
    assert (prototype.post_diameter_mm, prototype.stage.leds_mm) == (12, ())
    assert (prototype.frame.floor_mm, prototype.stage.top_mm) == (-300, -5)


@given(
    scale=st.floats(0.2, 5),
    lean=st.floats(0.3, 3),
    minor=st.floats(0.9, 2),
)
def test_every_design_gets_allowed_numbers(scale: float, lean: float, minor: float) -> None:
    """The record of a design, with the numbers, is a design again."""
    camera = [100 * scale, 0.0, -100 * scale * lean]
    options = [
        f"camera_mm={camera}",
        f"semi_minor_mm={150 * scale * minor}",
        f"capture_diameter_mm={50 * scale}",
    ]
    spec = load_spec(None, options)
    assert Spec.model_validate(spec_dict(spec)) == spec
    stage, capture = spec.prototype.stage, 25 * scale
    assert -capture <= stage.top_mm <= 0
    assert all(math.dist(place, (0, 0, 0)) < capture for place in stage.leds_mm)
