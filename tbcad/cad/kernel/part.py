"""Solids as parts of build123d and cadquery, for users who model on."""

from typing import TYPE_CHECKING

from build123d import Part
from build123d import Solid as Build123dSolid
from OCP.TopoDS import TopoDS_Shape

from tbcad.errors import InputError

if TYPE_CHECKING:
    from cadquery import Workplane


def as_part(label: str, shape: TopoDS_Shape) -> Part:
    """Return a solid of the kernel as a build123d part with a label; both share the geometry."""
    part = Part([Build123dSolid(shape)])
    part.label = label
    return part


def as_workplane(part: Part) -> "Workplane":
    """Return a part as a cadquery workplane that is tagged with its label; both share the geometry.

    InputError if cadquery is not installed.
    """
    try:
        from cadquery import Shape, Workplane
    except ImportError:
        raise InputError("cadquery is not installed: pip install 'tbcad[cadquery]'") from None
    shapes = [Shape.cast(solid.wrapped) for solid in part.solids()]
    return Workplane().newObject(shapes).tag(part.label or "part")
