"""Sizes, mm, that zero disc, bearing head and bracket share; out: from the axis, azimuth zero."""

import math

PIN_MM = 4.0  # diameter of the rod that fixes angle zero
PIN_HOLE_MM = 4.2
PIN_OUT_MM = 44.0  # of the pin: beyond the largest wheel, short of the motor
MARK_MM, MARK_DEPTH_MM = 1.0, 0.8  # width and depth of what is engraved
MARK_END_MM = 56.0  # out of the mark on the head's plate
BRACKET_MM = 14.0  # thickness, away from the side of the head's plate
BRACKET_LOW_MM, BRACKET_HIGH_MM = 46.0, 72.0  # out, of the bracket
BRACKET_EDGE_MM = 4.0  # from the bracket's ends to its screws
MIN_PLATE_MM = BRACKET_HIGH_MM + 2.0  # out, of the plate's end
# Of the switch's roller from the line of its holes: when free, and when the switch trips.
FREE_MM, TRIP_MM = 19.3, 14.5
TAB_BEYOND_MM = 0.7  # of the tab beyond where the switch trips


def switch_place(half_width: float) -> tuple[float, float]:
    """Out and side of the middle of the switch's holes, beside a plate of half a width."""
    return (BRACKET_LOW_MM + BRACKET_HIGH_MM) / 2, half_width + BRACKET_MM / 2


def bracket_screws() -> tuple[float, float]:
    """Out of the bracket's two screws."""
    return BRACKET_LOW_MM + BRACKET_EDGE_MM, BRACKET_HIGH_MM - BRACKET_EDGE_MM


def tab_radius(half_width: float) -> float:
    """Radius of the tab, which presses the switch beside a plate of half a width."""
    return math.hypot(*switch_place(half_width)) - TRIP_MM + TAB_BEYOND_MM
