"""Named, coloured solids in groups: what an assembly file shows as a tree."""

from dataclasses import dataclass
from typing import TypeAlias

from OCP.TopoDS import TopoDS_Solid

from tbcad.cad.mesh import Mesh

Colour: TypeAlias = tuple[float, float, float, float]
"""Red, green, blue (sRGB) and opacity, from 0 to 1."""


@dataclass(frozen=True)
class ColouredSolid:
    """One solid.

    Attributes:
        name: unique in the assembly.
        shape: in its place, the base at angle zero.
        colour: red, green, blue (sRGB) and opacity, from 0 to 1.
        mesh: of the shape; None where none is known.
    """

    name: str
    shape: TopoDS_Solid
    colour: Colour
    mesh: Mesh | None = None


@dataclass(frozen=True)
class SolidGroup:
    """Bodies that belong together."""

    name: str
    bodies: tuple[ColouredSolid, ...]
