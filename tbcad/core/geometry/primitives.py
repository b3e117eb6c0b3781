"""Parts as primitives that are united and primitives that are cut out.

Layout and solids share them: clearances are measured on the primitives that solids are made of.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.vectors import norm, perpendicular_axes, unit
from tbcad.types import Floats

IDENTITY = np.eye(3)
SIDES = 32  # of circumscribed polygons that clearances of round primitives are measured on


@dataclass(frozen=True)
class Cylinder:
    """A cylinder: start (3,), unit axis (3,), radius and length, mm."""

    start: Floats
    axis: Floats
    radius: float
    length: float


@dataclass(frozen=True)
class Prism:
    """A plane convex polygon (n, 3) extruded along a vector (3,) out of its plane, mm."""

    corners: Floats
    along: Floats


@dataclass(frozen=True)
class Revolved:
    """A polygon (n, 2) of (z, r) revolved about the last of axes (3, 3), z, through start, mm."""

    profile: Floats
    axes: Floats = field(default_factory=lambda: np.eye(3))
    start: Floats = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Slot:
    """A prism between two half cylinders, in which a screw can be moved."""

    middle: Floats  # of the near face, mm, (3,)
    step: Floats  # vector to the middle of one end, mm, (3,)
    radius: float  # of the ends, mm
    along: Floats  # vector from the near face to the far one, across the step, mm, (3,)


Primitive: TypeAlias = Cylinder | Prism | Revolved | Slot


@dataclass(frozen=True)
class Component:
    """A part in its place, in the frame of the shell."""

    name: str  # of the part
    what: str  # what it is, for lists of parts
    added: tuple[Primitive, ...]  # primitives it is the union of
    removed: tuple[Primitive, ...] = ()  # primitives that are cut out of it
    downs: tuple[Floats, ...] = ()  # unit directions (3,) down when printed; none: it is bought
    part: str | None = None  # its name in the lists of purchased parts; None: it is printed
    rotates: bool = False  # whether it rotates with the base


def cylinder_between(start: Floats, end: Floats, radius: float) -> Cylinder:
    """The cylinder from one point (3,) to another, mm."""
    return Cylinder(start, unit(end - start), radius, float(norm(end - start)))


def rectangle(low: Sequence[float] | Floats, high: Sequence[float] | Floats) -> Floats:
    """Corners (4, 2) of the rectangle between two of its corners."""
    return np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])


def box(
    low: Sequence[float] | Floats, high: Sequence[float] | Floats, axes: Floats = IDENTITY
) -> Prism:
    """The box between two points (3,) whose coordinates are along the rows of axes (3, 3)."""
    corners = np.column_stack([rectangle(low, high), np.full(4, low[2])])
    return Prism(corners @ axes, (high[2] - low[2]) * axes[2])


def revolved_along(profile: Floats, start: Floats, along: Floats) -> Revolved:
    """A polygon (n, 2) of (z, r) revolved about a unit vector (3,) through a point (3,), mm."""
    return Revolved(profile, np.vstack([perpendicular_axes(along), along]), start)


def slot(middle: Floats, along: Floats, travel: float, radius: float, depth: Floats) -> Primitive:
    """A slot in which a screw can be moved, from the middle of its near face by its depth (3,), mm.

    It has ends of a radius; the travel (mm) is along a unit vector, and zero or less makes a plain
    hole.
    """
    if travel <= 0:
        return cylinder_between(middle, middle + depth, radius)
    return Slot(middle, travel / 2 * along, radius, depth)


def slot_parts(body: Slot) -> tuple[Primitive, ...]:
    """The prism and the two cylinders whose union a slot is."""
    side = body.radius * unit(np.cross(body.along, body.step))
    ends = body.middle - body.step, body.middle + body.step
    corners = np.stack([ends[0] - side, ends[1] - side, ends[1] + side, ends[0] + side])
    rods = (cylinder_between(end, end + body.along, body.radius) for end in ends)
    return (Prism(corners, body.along), *rods)


def volume(body: Primitive) -> float:
    """Volume of a primitive, mm^3."""
    if isinstance(body, Cylinder):
        return float(np.pi * body.radius**2 * body.length)
    if isinstance(body, Prism):
        middle = body.corners - body.corners[0]
        area = np.cross(middle[1:-1], middle[2:]).sum(axis=0) / 2
        return float(abs(area @ body.along))
    if isinstance(body, Slot):
        area = np.pi * body.radius**2 + 4 * body.radius * norm(body.step)
        return float(area * norm(body.along))
    # Pappus: the first moment of the section about the axis, times the full turn.
    (z, r), (next_z, next_r) = body.profile.T, np.roll(body.profile, -1, axis=0).T
    moment = ((z * next_r - next_z * r) * (r + next_r)).sum() / 6
    return float(2 * np.pi * abs(moment))


def enclosing_triangles(body: Primitive) -> Floats:
    """Triangles (t, 3, 3) of closed surfaces that enclose a primitive, mm."""
    if isinstance(body, Prism):
        return _prism_triangles(body.corners, body.along)
    if isinstance(body, Slot):
        return np.concatenate([enclosing_triangles(part) for part in slot_parts(body)])
    circumscribed = unit_circle(even_angles(SIDES)) / np.cos(np.pi / SIDES)
    if isinstance(body, Cylinder):
        corners = body.start + body.radius * circumscribed @ perpendicular_axes(body.axis)
        return _prism_triangles(corners, body.length * body.axis)
    return body.start + _revolved_triangles(body.profile, circumscribed) @ body.axes


def _prism_triangles(corners: Floats, along: Floats) -> Floats:
    following = np.roll(corners, -1, axis=0)
    end = np.stack([np.broadcast_to(corners[0], corners.shape), corners, following], axis=1)
    sides = np.stack([corners, following, following + along], axis=1)
    others = np.stack([corners, following + along, corners + along], axis=1)
    return np.concatenate([end[1:-1], end[1:-1] + along, sides, others])


def _revolved_triangles(profile: Floats, circle: Floats) -> Floats:
    height = np.broadcast_to(profile[:, 0, None, None], (len(profile), len(circle), 1))
    a = np.concatenate([profile[:, 1, None, None] * circle, height], axis=-1)
    b = np.roll(a, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    halves = [np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]
    return np.concatenate(halves).reshape(-1, 3, 3)
