"""Solids as build123d parts, for users who model on."""

from build123d import Part
from build123d import Solid as Build123dSolid
from OCP.TopoDS import TopoDS_Shape


def as_part(label: str, shape: TopoDS_Shape) -> Part:
    """Return a solid of the kernel as a build123d part with a label; both share the geometry."""
    part = Part([Build123dSolid(shape)])
    part.label = label
    return part
