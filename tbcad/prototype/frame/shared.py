"""Shared by parts of the frame: axes, sizes, bodies, and fasteners in uprights."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import Primitive, Prism, cylinder_between
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.part import Mounted
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_screw
from tbcad.types import Floats

PLATE_MM = 9.0  # so that M3x12 screws go 3 mm into a motor
GAP_MM = 5.0  # between what turns and the plate: the heads of the wheel's screws are in it
ENGAGEMENT_MM = 4.0  # smallest length of a screw beyond what it holds
TNUT, WASHER = "TNUT-M5-6", "WASHER-5"
# Diameters of clearance holes by ISO 273, medium, by thread (1/4 inch: 6.35).
CLEARANCE_HOLE_MM = {3.0: 3.4, 4.0: 4.5, 5.0: 5.5, 6.0: 6.6, 6.35: 6.6}
EXTRUSION_MM = 20.0  # side of the uprights
UPRIGHTS = "upright_left", "upright_right"  # at positive y, and at negative
HALF_FLANGE_MM = 10.0  # of flanges and feet beyond the middles of the uprights
THROUGH_MM = 1.0  # by which a removed body extends beyond the part
OVERLAP_MM = 2.0  # by which added bodies overlap, so that no faces coincide


@dataclass(frozen=True)
class HeadPlate:
    """The head's plate, mm."""

    front: float  # of its face toward the hub, along the axis
    low: float  # of its lower edge, out from the axis
    high: float  # of its upper edge
    half_width: float  # of the plate

    @property
    def back(self) -> float:
        """Of the plate's other face."""
        return self.front - PLATE_MM


@dataclass(frozen=True, kw_only=True)
class BearingHead(Mounted):
    """The head of the frame; purchased are bearings, shaft, collar, wheels, motor."""

    plate: HeadPlate  # across the axis
    rear: float  # coordinate of the tube's end along w, from the origin, mm
    shaft: PurchasedPart | None  # in the bearings, if any
    face: float  # level coordinate of the flange's face on the uprights, mm
    top: float  # height of the flange's upper end, mm


def level_prism(corners: Floats, low: float, high: float, axes: Floats) -> Prism:
    """A convex polygon (n, 2) of (level, up) between two places across, mm."""
    x, z = corners.T
    at = np.column_stack([x, np.full(len(x), low), z])
    return Prism(at @ axes, (high - low) * axes[1])


def webs(corners: Floats, inner: float, thickness: float, axes: Floats) -> list[Primitive]:
    """Two webs of a polygon (n, 2) of (level, up), from inner outward to either side."""
    return [
        level_prism(corners, inner, inner + thickness, axes),
        level_prism(corners, -inner - thickness, -inner, axes),
    ]


def drilled_holes(places: Sequence[Floats], depth: Floats, diameter: float) -> list[Primitive]:
    """Holes from points (3,) along a vector (3,), a little longer to both sides."""
    beyond = THROUGH_MM * depth / np.linalg.norm(depth)
    return [
        cylinder_between(place - beyond, place + depth + beyond, diameter / 2) for place in places
    ]


def on_uprights(
    name: str,
    places: Sequence[Floats],
    along: Floats,
    flange: float,
    parts: Parts,
    bars: tuple[str, str] = UPRIGHTS,
) -> tuple[Fastener, ...]:
    """Screws through a body's flange (mm thick) into T-nuts of two bars: the uprights, or others.

    Places (3,) are on a face of the bars, mm; the unit vector along points into them.
    """
    screw, fasteners = choose_screw(parts, 5.0, flange + ENGAGEMENT_MM), list[Fastener]()
    for place in places:
        bar = bars[0] if place[1] > 0 else bars[1]
        fasteners.append(Fastener(screw, place - flange * along, along, (name, bar)))
        fasteners.append(Fastener(parts[TNUT], place, along, (bar,)))
    return tuple(fasteners)
