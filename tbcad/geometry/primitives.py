"""Parts as bodies that are put together and bodies that are taken away.

Design and model share them: clearances are measured on the very bodies that solids are made of.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from tbcad.geometry.vectors import unit
from tbcad.types import Floats

# Round bodies are measured on polygons round them, of so many sides.
SIDES = 32


@dataclass(frozen=True)
class Cylinder:
    """A cylinder: start (3,), unit axis (3,), radius and length, mm."""

    start: Floats
    axis: Floats
    radius: float
    length: float


@dataclass(frozen=True)
class Prism:
    """A plane convex polygon (n, 3) moved along a vector (3,) out of its plane, mm."""

    corners: Floats
    along: Floats


@dataclass(frozen=True)
class Revolved:
    """A polygon (n, 2) of (z, r) turned about the z axis of the shell's frame, mm."""

    profile: Floats


Primitive: TypeAlias = Cylinder | Prism | Revolved


@dataclass(frozen=True)
class Component:
    """A part in its place, in the frame of the shell.

    Attributes:
        name: of the part.
        what: it is.
        added: bodies it is the union of.
        removed: bodies that are cut out of it.
        downs: directions that may point down when it is printed, (d, 3); none: it is bought.
        part: its name in the lists of purchased parts; None: it is printed.
        turns: whether it turns with the base.
    """

    name: str
    what: str
    added: tuple[Primitive, ...]
    removed: tuple[Primitive, ...] = ()
    downs: tuple[tuple[float, float, float], ...] = ()
    part: str | None = None
    turns: bool = False


def perpendicular_axes(axis: Floats) -> Floats:
    """Two unit vectors across a unit axis and each other, (2, 3); right-handed with it."""
    first = unit(np.cross(np.eye(3)[int(np.argmin(np.abs(axis)))], axis))
    return np.stack([first, np.cross(axis, first)])


def cylinder_between(start: Floats, end: Floats, radius: float) -> Cylinder:
    """The cylinder from a point to another."""
    along = end - start
    return Cylinder(start, unit(along), radius, float(np.linalg.norm(along)))


def box(low: Floats, high: Floats, axes: Floats) -> Prism:
    """The box between two points (3,) whose coordinates are along the rows of axes (3, 3)."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = np.array([[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]])
    return Prism(corners @ axes, (z1 - z0) * axes[2])


def slot(
    middle: Floats, along: Floats, travel: float, radius: float, depth: Floats
) -> tuple[Primitive, ...]:
    """A hole that lets its screw move: two cylinders and what is between them.

    Args:
        middle: of its one end, mm, (3,).
        along: unit vector of the travel, (3,).
        travel: length by which a screw can be moved, mm.
        radius: of the hole, mm.
        depth: vector from the one end to the other, (3,).
    """
    if travel <= 0:
        return (cylinder_between(middle, middle + depth, radius),)
    step, side = travel / 2 * along, radius * unit(np.cross(along, depth))
    corners = middle + np.stack([-step - side, step - side, step + side, -step + side])
    ends = [cylinder_between(middle + way, middle + way + depth, radius) for way in (-step, step)]
    return (Prism(corners, depth), *ends)


def enclosing_triangles(body: Primitive) -> Floats:
    """Triangles (t, 3, 3) that enclose a body, mm."""
    if isinstance(body, Cylinder):
        turn, wide = 2 * np.pi * np.arange(SIDES) / SIDES, 1 / np.cos(np.pi / SIDES)
        circle = body.radius * wide * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        corners = body.start + circle @ perpendicular_axes(body.axis)
        return _prism(corners, body.length * body.axis)
    if isinstance(body, Prism):
        return _prism(body.corners, body.along)
    return _turned(body.profile)


def _prism(corners: Floats, along: Floats) -> Floats:
    following = np.roll(corners, -1, axis=0)
    end = np.stack([np.broadcast_to(corners[0], corners.shape), corners, following], axis=1)
    sides = np.stack([corners, following, following + along], axis=1)
    others = np.stack([corners, following + along, corners + along], axis=1)
    return np.concatenate([end[1:-1], end[1:-1] + along, sides, others])


def _turned(profile: Floats) -> Floats:
    turn = 2 * np.pi * np.arange(SIDES) / SIDES
    radius = profile[:, 1] / np.cos(np.pi / SIDES)
    height = np.broadcast_to(profile[:, 0, None], (len(profile), SIDES))
    places = [radius[:, None] * np.cos(turn), radius[:, None] * np.sin(turn), height]
    at = np.stack(places, axis=-1)
    a, b = at, np.roll(at, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    both = [np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]
    return np.concatenate(both).reshape(-1, 3, 3)
