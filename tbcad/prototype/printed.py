"""Printed parts, and their place on the bed: what fits and needs the least support."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
from manifold3d import Manifold
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from tbcad.cad.kernel.checks import SolidProperties, check_volume, closed_mesh, properties, volume
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.meshing import mesh_difference, mesh_of, primitive_mesh, without_degenerate
from tbcad.cad.kernel.solids import (
    cut,
    cylinder,
    from_bytes,
    fused,
    moved,
    one_solid,
    polygon,
    prism,
    revolved_polygon,
    slot_face,
    solids,
    to_bytes,
)
from tbcad.common.reuse import kept
from tbcad.core.geometry.primitives import Component, Cylinder, Primitive, Prism, Revolved, Slot
from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.geometry.vectors import norm
from tbcad.core.spec.design import PrinterSpec
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.print_bed import fitting_orientation, min_bed, size_text
from tbcad.types import Floats

LEVEL = 1e-6  # of a normal's downward part
STEEP = np.sin(np.radians(45))  # of it, from which on a printer needs support
EXACT = 1e3  # weight of the sum of shares, which is one
POSES = 4000  # directions that are tried where a part does not fit as its pads would have it
NO_PADS = np.zeros((0, 3))
MAX_OVERHANG = np.cos(np.radians(40))  # of the downward part of a facet's normal: see slicing
# Base and caps turn, stage and frame are static; a tool is not in the assembly.
Role: TypeAlias = Literal["base", "cap", "stage", "frame", "tool"]
VOLUME_ERROR = 1e-4
TOUCHING_MM = 0.05  # a facet no higher lies on the bed


def downward_pads(normals: Floats, orientation: Floats) -> tuple[int, int]:
    """Pads that face down by more than 45 degrees, and all that do, by unit normals (n, 3).

    Rows of the orientation (3, 3) are what the axes become; the third is up on the bed.
    """
    height = normals @ orientation[:, 2]
    return int((height < -STEEP).sum()), int((height < -LEVEL).sum())


def opening_up(normals: Floats) -> Floats | None:
    """Unit direction that is down when the pad nearest to facing down is as far up as possible.

    The point of the convex hull of the unit normals (n, 3) that is nearest to the origin is up.
    None where some pad faces down in every direction.
    """
    if not len(normals):
        return None
    weighed = np.vstack([normals.T, np.full(len(normals), EXACT)])
    shares, _ = nnls(weighed, np.array([0.0, 0.0, 0.0, EXACT]))
    up = normals.T @ shares
    length = float(np.linalg.norm(up))
    if length < LEVEL or float((normals @ up).min()) < LEVEL * length:
        return None
    return np.asarray(-up / length)


def leaning_poses(normals: Floats) -> Floats:
    """Directions that may point down, (d, 3): the higher the lowest pad then faces, the earlier.

    Of directions spread evenly over the sphere by a spiral, those in which no pad of the unit
    normals (n, 3) faces down by more than 45 degrees: such a pad needs no support.
    """
    share, turn = (np.arange(POSES) + 0.5) / POSES, np.pi * (1 + np.sqrt(5)) * np.arange(POSES)
    up = 1 - 2 * share
    downs = np.column_stack([np.sqrt(1 - up**2)[:, None] * unit_circle(turn), up])
    lowest = (normals @ -downs.T).min(axis=0)
    return downs[np.argsort(-lowest, kind="stable")[: int((lowest >= -STEEP).sum())]]


@dataclass(frozen=True)
class PlacedSolid:
    """A solid in its place, and its pose on the printer's bed."""

    name: str  # of the part
    shape: TopoDS_Solid  # one closed solid in the frame of the shell, the base at angle zero
    mesh: Mesh  # of the shape, as it is exported
    properties: SolidProperties  # volume, area and centroid of the shape
    axes: Floats  # what x, y and z become on the printer's bed, as rows, (3, 3)
    origin: Floats  # place of the origin on the bed, mm, (3,)

    def __getstate__(self) -> dict[str, Any]:
        """The kernel's shapes are no data to Python until they are written as bytes."""
        data = self.__dict__.get("_shape_bytes") or to_bytes(self.shape)
        return {**self.__dict__, "_shape_bytes": data, "shape": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Read the shape again, and keep its bytes: a shape read and written again has others."""
        self.__dict__.update(state, shape=from_bytes(state["_shape_bytes"]))

    @property
    def mesh_on_bed(self) -> Mesh:
        """Its mesh as it is printed: above z = 0, about the middle of the bed."""
        return Mesh(self.mesh.vertices @ self.axes + self.origin, self.mesh.triangles)

    @property
    def volume(self) -> float:
        """Volume, mm^3."""
        return self.properties.volume

    def mass_g(self, density: float) -> float:
        """Mass when printed solid, grams, for a density in g/cm^3."""
        return self.volume / 1000 * density


def placed_on_bed(
    name: str,
    shape: TopoDS_Solid,
    mesh: Mesh,
    properties: SolidProperties,
    downs: Sequence[Floats],
    axes: Floats,
    printer: PrinterSpec,
    pads: Floats = NO_PADS,
) -> PlacedSolid:
    """A part on the bed: of the orientations that fit, one with the fewest pads that face down.

    Among these, the one that needs the least support. The shape is one valid solid in a frame of
    its own, whose axes in the frame of the shell are rows; a move keeps it valid. Directions that
    may point down are unit vectors (3,) of that frame, as are the normals of pads, (n, 3).

    SpecError when it fits in no orientation.
    """
    corners = mesh.vertices[ConvexHull(mesh.vertices).vertices]
    opening = opening_up(pads)
    directions = [*downs, *([] if opening is None else [opening])]
    orientations = [fitting_orientation(corners, down, printer) for down in directions]
    if len(pads) and orientations[-1] is None:  # the bed is too small for the cups to open upward
        leaning = (fitting_orientation(corners, down, printer) for down in leaning_poses(pads))
        orientations.append(next((one for one in leaning if one is not None), None))
    fitting = [orientation for orientation in orientations if orientation is not None]
    if not fitting:
        bed = size_text(min_bed(corners, downs, printer))
        raise SpecError(
            f"{name} does not fit on the printer's bed: make printer.bed_mm at least {bed}, or "
            "prototype.largest_ball_mm or prototype.k smaller"
        )
    best = min(
        fitting, key=lambda way: (*downward_pads(pads, way), round(_support_room(mesh, way)))
    )
    placed = corners @ best
    low, high = placed.min(axis=0), placed.max(axis=0)
    origin = -np.array([*(low + high)[:2] / 2, low[2]])
    solid = solids(moved(shape, axes, np.zeros(3)))[0]
    in_place = Mesh(mesh.vertices @ axes, mesh.triangles)
    return PlacedSolid(name, solid, in_place, properties.rotated(axes), axes.T @ best, origin)


def _support_room(mesh: Mesh, orientation: Floats) -> float:
    """Volume between the bed and what needs support above it, mm^3."""
    corner = (mesh.vertices @ orientation)[mesh.triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    height = corner[..., 2] - corner[..., 2].min()
    overhangs = -normal[:, 2] > MAX_OVERHANG * norm(normal)
    overhangs &= height.max(axis=1) > TOUCHING_MM
    return float((-normal[:, 2] / 2 * height.mean(axis=1))[overhangs].sum())


@dataclass(frozen=True)
class PrintedPart:
    """One printed part."""

    solid: PlacedSolid  # in its place, and how it is laid on the bed
    role: Role  # what it belongs to
    what: str  # it is for
    ball: int = -1  # of a cap, the number of its seat, from 0; -1 for all others

    @property
    def name(self) -> str:
        """Name of the part and of its files."""
        return self.solid.name


def part_mesh(part: PrintedPart) -> Mesh:
    """The part's mesh on the printer's bed, its coordinates rounded to 32 bits as in an STL.

    Vertices that become equal are merged.
    """
    mesh = part.solid.mesh_on_bed
    single = mesh.vertices.astype(np.float32).astype(np.float64) + 0.0
    corners, group = np.unique(single, axis=0, return_inverse=True)
    return without_degenerate(corners, group.reshape(-1)[mesh.triangles])


def primitive_solid(body: Primitive) -> TopoDS_Shape:
    """The solid of a primitive."""
    if isinstance(body, Cylinder):
        return cylinder(body.start, body.axis, body.radius, body.length)
    if isinstance(body, Revolved):
        return moved(revolved_polygon(body.profile, 0.0, 2 * np.pi), body.axes, body.start)
    if isinstance(body, Slot):
        return prism(slot_face(body.middle, body.step, body.radius, body.along), body.along)
    return prism(polygon(_outward(body)), body.along)


def component_solid(component: Component) -> TopoDS_Solid:
    """The one solid of a component, in the frame of the shell.

    InvalidSolidError when the kernel fails, or its volume is not what meshes give.
    """
    if len(component.added) == 1 and not component.removed:  # no boolean that could go wrong
        return one_solid(component.name, primitive_solid(component.added[0]))
    added = [primitive_solid(body) for body in component.added]
    removed = [primitive_solid(body) for body in component.removed]
    solid = one_solid(component.name, cut(fused(added), removed))
    check_volume(component.name, volume(solid), _net(component).volume(), VOLUME_ERROR)
    return solid


def component_mesh(component: Component) -> Mesh:
    """A component by booleans of meshes, in the frame of the shell."""
    return mesh_of(_net(component))


def _net(component: Component) -> Manifold:
    bodies = (component.added, component.removed)
    return mesh_difference(*([primitive_mesh(one) for one in some] for some in bodies))


@kept("printed parts")
def placed_component(component: Component, printer: PrinterSpec, mesh_mm: float) -> PlacedSolid:
    """A component placed on the printer's bed, its mesh within a distance of the surface.

    SpecError when it does not fit; InvalidSolidError when the kernel fails.
    """
    solid, name = component_solid(component), component.name
    mesh, downs = closed_mesh(name, solid, mesh_mm), component.downs
    return placed_on_bed(name, solid, mesh, properties(solid), downs, np.eye(3), printer)


def _outward(body: Prism) -> Floats:
    """The corners in the order that turns the prism's faces outward."""
    a, b = body.corners[1] - body.corners[0], body.corners[2] - body.corners[0]
    return body.corners if np.cross(a, b) @ body.along > 0 else body.corners[::-1]
