"""Placing a part on the printer's bed: the orientation that fits and needs the least support."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.TopoDS import TopoDS_Solid
from scipy.spatial import ConvexHull

from tbcad.cad.measures import SolidProperties
from tbcad.cad.mesh import Mesh
from tbcad.cad.solids import from_bytes, moved, solids, to_bytes
from tbcad.geometry.vectors import norm
from tbcad.prototype.printing.bed import fitting_orientation, min_bed, size_text
from tbcad.prototype.printing.pads_up import NO_PADS, downward_pads, opening_up
from tbcad.spec.errors import SpecError
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Floats

MAX_OVERHANG = np.cos(np.radians(45))  # of the downward part of a facet's normal
TOUCHING_MM = 0.05  # a facet no higher lies on the bed


@dataclass(frozen=True)
class PlacedSolid:
    """A solid in its place, and its pose on the printer's bed.

    Attributes:
        name: of the part.
        shape: one closed solid in the frame of the shell, the base at angle zero.
        mesh: of the shape, as it is exported.
        properties: volume, area and centroid of the shape.
        axes: what x, y and z become on the printer's bed, as rows, (3, 3).
        origin: place of the origin on the bed, mm, (3,).
    """

    name: str
    shape: TopoDS_Solid
    mesh: Mesh
    properties: SolidProperties
    axes: Floats
    origin: Floats

    def __getstate__(self) -> dict[str, Any]:
        """The kernel's shapes are no data to Python until they are written as bytes."""
        data = self.__dict__.get("_shape_bytes") or to_bytes(self.shape)
        return {**self.__dict__, "_shape_bytes": data, "shape": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Read the shape again, and keep its bytes: a shape read and written again has others."""
        self.__dict__.update(state, shape=from_bytes(state["_shape_bytes"]))

    @property
    def on_bed(self) -> TopoDS_Solid:
        """The part as it is printed: above z = 0, about the middle of the bed."""
        return solids(moved(self.shape, self.axes, self.origin))[0]

    @property
    def mesh_on_bed(self) -> Mesh:
        """Its mesh in the pose in which it is printed."""
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

    Among these, the one that needs the least support.

    Args:
        name: of the part.
        shape: one valid solid about z, in the carrier's own frame; a move keeps it valid.
        mesh: of the shape.
        properties: of the shape.
        downs: directions of that frame that may point down, as (3,) unit vectors.
        axes: of that frame in the frame of the shell, as rows.
        printer: with its bed.
        pads: unit normals of its pads in that frame, (n, 3).

    Raises:
        SpecError: when it fits in no orientation.
    """
    corners = mesh.vertices[ConvexHull(mesh.vertices).vertices]
    opening = opening_up(pads)
    directions = [*downs, *([] if opening is None else [opening])]
    orientations = [fitting_orientation(corners, down, printer) for down in directions]
    fitting = [orientation for orientation in orientations if orientation is not None]
    if not fitting:
        bed = size_text(min_bed(corners, downs, printer))
        raise SpecError(
            f"{name} does not fit on the printer's bed: make printer.bed_mm at least {bed}, or "
            "prototype.largest_ball_mm or prototype.k smaller"
        )
    best = min(fitting, key=lambda way: (*downward_pads(pads, way), round(_overhang(mesh, way), 3)))
    placed = corners @ best
    low, high = placed.min(axis=0), placed.max(axis=0)
    origin = -np.array([*(low + high)[:2] / 2, low[2]])
    solid = solids(moved(shape, axes, np.zeros(3)))[0]
    in_place = Mesh(mesh.vertices @ axes, mesh.triangles)
    return PlacedSolid(name, solid, in_place, properties.rotated(axes), axes.T @ best, origin)


def _overhang(mesh: Mesh, orientation: Floats) -> float:
    """Area that hangs over by more than 45 degrees and does not lie on the bed, mm^2."""
    corner = (mesh.vertices @ orientation)[mesh.triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = norm(normal) / 2
    height = corner[..., 2].max(axis=1) - corner[..., 2].min()
    overhangs = (-normal[:, 2] > MAX_OVERHANG * 2 * area) & (height > TOUCHING_MM)
    return float(area[overhangs].sum())
