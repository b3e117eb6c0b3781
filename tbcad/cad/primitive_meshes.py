"""Primitives as meshes of the same volume, without the CAD kernel.

A circle becomes a regular polygon of the same area, so that round bodies keep their volume.
"""

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold, OpType

from tbcad.geometry.primitives import Cylinder, Primitive, Prism, Revolved, Slot, slot_parts
from tbcad.geometry.vectors import perpendicular_axes, unit
from tbcad.types import Floats

SIDES = 48


def growth(angle: float) -> float:
    """Radius of a polygon to that of a circle of the same area, by the angle of a side, radians."""
    return float(np.sqrt(angle / np.sin(angle)))


GROWTH = growth(2 * np.pi / SIDES)


def primitive_mesh(body: Primitive) -> Manifold:
    """The mesh of a primitive in its place."""
    if isinstance(body, Cylinder):
        rod = Manifold.cylinder(body.length, GROWTH * body.radius, circular_segments=SIDES)
        axes = np.vstack([perpendicular_axes(body.axis), body.axis])
        return moved_mesh(rod, axes, body.start)
    if isinstance(body, Revolved):
        z, r = body.profile.T
        ring = Manifold.revolve(_section(np.column_stack([GROWTH * r, z])), SIDES)
        return moved_mesh(ring, body.axes, body.start)
    if isinstance(body, Slot):
        parts = [primitive_mesh(part) for part in slot_parts(body)]
        return Manifold.batch_boolean(parts, OpType.Add)
    return _prism_mesh(body)


def moved_mesh(mesh: Manifold, axes: Floats, origin: Floats) -> Manifold:
    """A mesh moved: axes (3, 3) are what x, y and z become, as rows; origin what 0 becomes."""
    return mesh.transform(np.column_stack([axes.T, origin]))


def _prism_mesh(body: Prism) -> Manifold:
    """The section in the plane of its first three corners, extruded along the third axis."""
    first = unit(body.corners[1] - body.corners[0])
    normal = unit(np.cross(first, body.corners[2] - body.corners[0]))
    across = np.stack([first, np.cross(normal, first)])
    section = (body.corners - body.corners[0]) @ across.T
    unit_high = Manifold.extrude(_section(section), 1.0)
    return moved_mesh(unit_high, np.vstack([across, body.along]), body.corners[0])


def _section(outline: Floats) -> CrossSection:
    return CrossSection([outline], FillRule.NonZero)
