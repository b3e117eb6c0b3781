"""What the frame's brackets share: axes, screws, choice of parts, prisms and webs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import Component, Primitive, Prism, cylinder_between
from tbcad.prototype.fasteners import Fastener
from tbcad.types import Floats

# Diameters of clearance holes by ISO 273, medium, by thread (1/4 inch: 6.35).
CLEARANCE_HOLE_MM = {3.0: 3.4, 4.0: 4.5, 5.0: 5.5, 6.0: 6.6, 6.35: 6.6}
TAPPED_M5_MM = 4.2
EXTRUSION_MM = 20.0  # side of the uprights
HALF_FLANGE_MM = 10.0  # of flanges and feet beyond the middles of the uprights
THROUGH_MM = 1.0  # by which a removed body extends beyond the part
OVERLAP_MM = 2.0  # by which added bodies overlap, so that no faces coincide


@dataclass(frozen=True)
class Bracket:
    """A printed part that is screwed on."""

    component: Component  # the part itself
    # tapped holes that it needs in the base plate, (x, y) along the frame's axes, (h, 2)
    holes: Floats
    foot: Floats  # corners of its foot on the plate, the same, (f, 2)
    fasteners: tuple[Fastener, ...] = ()  # of it, but for those in the base plate


def frame_axes(axis: Floats) -> Floats:
    """Axes of the frame, as rows: level under the axis w (3,), across it, up, (3, 3)."""
    level = np.array([axis[0], axis[1], 0.0]) / np.hypot(*axis[:2])
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([level, np.cross(up, level), up])


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
