"""What the frame's brackets share: its axes, screws, and brackets of a flange, a foot and webs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.geometry.primitives import Component, Primitive, Prism, cylinder_between
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.spec.errors import SpecError
from tbcad.types import Floats

# Clearance holes of ISO 273, medium, by thread.
HOLES_MM = {3.0: 3.4, 4.0: 4.5, 5.0: 5.5, 6.0: 6.6, 6.35: 6.6}
TAPPED_M5_MM = 4.2
EXTRUSION_MM = 20.0
THROUGH_MM = 1.0  # tools stick out
SUNK_MM = 2.0  # bodies go into each other, so that no faces coincide


@dataclass(frozen=True)
class Bracket:
    """A printed part that is screwed on.

    Attributes:
        item: itself.
        holes: tapped holes that it needs in the base plate, (x, y) along the frame's axes, (h, 2).
        foot: corners of its foot on the plate, the same, (f, 2); none: it does not stand on it.
    """

    item: Component
    holes: Floats
    foot: Floats


def rig_axes(axis: Floats) -> Floats:
    """Axes of the frame, as rows: level under the axis w (3,), across it, up, (3, 3)."""
    level = np.array([axis[0], axis[1], 0.0]) / np.hypot(*axis[:2])
    up = np.array([0.0, 0.0, 1.0])
    return np.stack([level, np.cross(up, level), up])


def slab(corners: Floats, low: float, high: float, axes: Floats) -> Prism:
    """A convex polygon (n, 2) of (level, up) between two places across, mm."""
    x, z = corners.T
    at = np.column_stack([x, np.full(len(x), low), z])
    return Prism(at @ axes, (high - low) * axes[1])


def webs(corners: Floats, inner: float, thickness: float, axes: Floats) -> list[Primitive]:
    """Two webs of a polygon (n, 2) of (level, up), from inner outward to either side."""
    return [
        slab(corners, inner, inner + thickness, axes),
        slab(corners, -inner - thickness, -inner, axes),
    ]


def drilled(places: Sequence[Floats], along: Floats, diameter: float) -> list[Primitive]:
    """Holes from points (3,) along a vector, a little longer to both sides."""
    out = THROUGH_MM * along / np.linalg.norm(along)
    return [cylinder_between(place - out, place + along + out, diameter / 2) for place in places]


def fitting(
    parts: Parts, kind: str, key: str, hint: str, order: str = "length_mm", **sizes: float
) -> PurchasedPart:
    """The shortest purchased part of a kind that is at least so large and else just so.

    Args:
        parts: lists of purchased parts.
        kind: a list.
        key: of the spec that asks for it.
        hint: what to change when there is none.
        order: size that must only be large enough; the least one is taken.
        sizes: wanted.

    Raises:
        SpecError: when the list has none.
    """
    found = [
        part
        for part in parts.values()
        if part.kind == kind
        and all(part[size] == value for size, value in sizes.items() if size != order)
        and part[order] >= sizes.get(order, 0.0)
    ]
    if not found:
        wanted = ", ".join(f"{size} {value:.4g}" for size, value in sizes.items())
        raise SpecError(f"no part with {wanted} in {kind}.csv, which {key} needs: {hint}")
    return min(found, key=lambda part: part[order])


def screw(parts: Parts, thread: float, length: float) -> str:
    """Name of the shortest socket head screw of a thread that is so long."""
    hint = "make prototype.frame.flange_mm smaller"
    key = "prototype.frame.flange_mm"
    return fitting(parts, "screws", key, hint, thread_mm=thread, length_mm=length).name
