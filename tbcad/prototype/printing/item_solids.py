"""Solids of bodies: added ones fused, removed ones cut out."""

import numpy as np
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.brep import InvalidSolidError
from tbcad.cad.solids import (
    cut,
    cylinder,
    fused,
    one_solid,
    polygon,
    prism,
    ring,
    volume,
    volume_by_meshes,
)
from tbcad.geometry.primitives import Component, Cylinder, Primitive, Revolved
from tbcad.geometry.primitives import Prism as Straight
from tbcad.prototype.printing.placing import PlacedSolid, placed_on_bed
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Floats

COARSE_MM = 0.02
VOLUME_ERROR = 2e-3


def shape(body: Primitive) -> TopoDS_Shape:
    """The solid of a body."""
    if isinstance(body, Cylinder):
        return cylinder(body.start, body.axis, body.radius, body.length)
    if isinstance(body, Revolved):
        return ring(body.profile, 0.0, 2 * np.pi)
    return prism(polygon(_upward(body)), body.along)


def solid(item: Component) -> TopoDS_Solid:
    """The one solid of a part, in the frame of the shell.

    Raises:
        InvalidSolidError: when the kernel fails, or its volume is not what meshes give.
    """
    added = [shape(body) for body in item.added]
    removed = [shape(body) for body in item.removed]
    found = one_solid(item.name, cut(fused(added), removed))
    expected = volume_by_meshes(added, removed, COARSE_MM)
    if abs(volume(found) - expected) > VOLUME_ERROR * expected:
        raise InvalidSolidError(
            f"{item.name}: the kernel made {volume(found):.0f} mm^3 of {expected:.0f}"
        )
    return found


def printed(item: Component, printer: PrinterSpec) -> PlacedSolid:
    """A part laid on the printer's bed.

    Raises:
        SpecError: when it does not fit.
        InvalidSolidError: when the kernel fails.
    """
    downs = [np.array(down) for down in item.downs]
    return placed_on_bed(item.name, solid(item), downs, np.eye(3), printer)


def _upward(body: Straight) -> Floats:
    """The corners with their normal along the prism, so that the solid is not inside out."""
    a, b = body.corners[1] - body.corners[0], body.corners[2] - body.corners[0]
    return body.corners if np.cross(a, b) @ body.along > 0 else body.corners[::-1]
