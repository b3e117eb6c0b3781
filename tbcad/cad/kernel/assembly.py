"""Named, coloured solids in groups: what an assembly file shows as a tree."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from OCP.TopoDS import TopoDS_Solid

from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.meshing import meshed
from tbcad.cad.kernel.solids import moved, solids
from tbcad.types import Floats

Colour: TypeAlias = tuple[float, float, float, float]
"""Red, green, blue (sRGB) and opacity, from 0 to 1."""


# Of meshes that are only looked at.
DISPLAY_MM, DISPLAY_ANGLE = 0.1, 0.25


@dataclass(frozen=True)
class ColouredSolid:
    """One solid."""

    name: str  # unique in the assembly
    shape: TopoDS_Solid  # in its place, the base at angle zero
    colour: Colour  # red, green, blue (sRGB) and opacity, from 0 to 1
    mesh: Mesh | None = None  # of the shape; None where none is known

    def copy(self, name: str, axes: Floats, origin: Floats) -> "ColouredSolid":
        """One like it under another name, moved: axes are what x, y and z become, as rows."""
        mesh = self.mesh and Mesh(self.mesh.vertices @ axes + origin, self.mesh.triangles)
        return ColouredSolid(name, solids(moved(self.shape, axes, origin))[0], self.colour, mesh)


@dataclass(frozen=True)
class SolidGroup:
    """Bodies that belong together."""

    name: str
    bodies: tuple[ColouredSolid, ...]


@dataclass(frozen=True)
class ColouredMesh:
    """What is seen of one solid: name and colour as of `ColouredSolid`."""

    name: str
    mesh: Mesh
    colour: Colour


@dataclass(frozen=True)
class MeshGroup:
    """Meshes that belong together."""

    name: str
    bodies: tuple[ColouredMesh, ...]


def mesh_groups(groups: Sequence[SolidGroup]) -> list[MeshGroup]:
    """What is seen of groups of solids, without shapes of the kernel."""
    return [MeshGroup(group.name, tuple(map(_drawn, group.bodies))) for group in groups]


def _drawn(body: ColouredSolid) -> ColouredMesh:
    return ColouredMesh(body.name, body.mesh or display_mesh(body.shape), body.colour)


def display_mesh(shape: TopoDS_Solid) -> Mesh:
    """A coarse mesh, to be looked at."""
    return meshed(shape, DISPLAY_MM, DISPLAY_ANGLE)
