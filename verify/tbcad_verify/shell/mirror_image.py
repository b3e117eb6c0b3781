"""What one mesh shows holds for its mirror image in the plane x = 0, and is measured once.

Camera b's shell is camera a's, reflected. Where the facets in both files are the same to the last
bit but for the sign of x and the order of each facet's corners, every figure of one follows from
the other's; where a single bit differs, nothing does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.holes import RoundHoles
from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.segments import Edges
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.printing.orientations import part_hull
from tbcad_verify.printing.part_measures import PartMeasures
from tbcad_verify.printing.walls import WallThickness
from tbcad_verify.record.export import Camera
from tbcad_verify.shell.recover import Recovery
from tbcad_verify.types import Floats

FLIP = np.array([-1.0, 1.0, 1.0])
# The half-edge between the same two corners when a facet's three are taken in reverse.
REVERSED = np.array([1, 0, 2])


def is_mirror_image(one: Facets, other: Facets) -> bool:
    """Whether two files hold the same facets, in the same order, but for the reflection."""
    flip = FLIP.astype(np.float32)
    return (
        one.corners.shape == other.corners.shape
        and np.array_equal(one.corners[:, ::-1] * flip, other.corners)
        and np.array_equal(one.normals * flip, other.normals)
    )


def is_image_of_camera(other: Camera, one: Camera) -> bool:
    """Whether one camera's pixels see along the mirror images of the other's, in any order."""
    across = one.right * FLIP
    same = [(one.pinhole * FLIP, other.pinhole), (one.forward * FLIP, other.forward)]
    return (
        (one.width, one.height, one.hfov_deg) == (other.width, other.height, other.hfov_deg)
        and all(np.array_equal(*pair) for pair in same)
        and (np.array_equal(across, other.right) or np.array_equal(-across, other.right))
    )


def flipped_mesh(mesh: Mesh) -> Mesh:
    """The mesh of the mirror image, its facets and vertices in the same order."""
    twin = _reversed_half_edges(mesh.twin).reshape(-1, 3)[:, REVERSED].ravel().astype(np.int32)
    faces = np.ascontiguousarray(mesh.faces[:, ::-1])
    return Mesh(mesh.points * FLIP, faces, twin, _flipped_columns(mesh.area))


def flipped_edges(edges: Edges) -> Edges:
    """The edges of the mirror image, in the order of their half-edges."""
    half = _reversed_half_edges(edges.half).astype(np.intp)
    order = np.argsort(half)
    return Edges(half[order], edges.angle[order], edges.noise[order])


def flipped_mass(mass: MassProperties) -> MassProperties:
    """Volume, area, centroid and box of the mirror image."""
    low, high = [-mass.high[0], *mass.low[1:]], [-mass.low[0], *mass.high[1:]]
    centroid = [-mass.centroid[0], *mass.centroid[1:]]
    return replace(mass, centroid=centroid, low=low, high=high)


def flipped_recovery(recovery: Recovery) -> Recovery:
    """The patches of the mirror image, under the same numbers."""
    fits = recovery.fits
    surfaces = Surfaces(
        _flipped_columns(fits.surfaces.point),
        _flipped_columns(fits.surfaces.normal),
        fits.surfaces.curvature,
    )
    middle, normal = _flipped_columns(fits.middle), _flipped_columns(fits.normal)
    return replace(recovery, fits=replace(fits, surfaces=surfaces, middle=middle, normal=normal))


def flipped_measures(measures: PartMeasures, mesh: Mesh, mass: MassProperties) -> PartMeasures:
    """What a printer needs to know of the mirror image, given its mesh and mass."""
    walls, holes = measures.walls, measures.holes
    return replace(
        measures,
        mesh=mesh,
        mass=mass,
        walls=WallThickness(walls.thickness, walls.share, walls.minimum, walls.where * FLIP),
        holes=RoundHoles(
            holes.diameter,
            _flipped_columns(holes.middle),
            _flipped_columns(holes.axis),
            holes.depth,
            holes.wall,
        ),
        hull=part_hull(mesh.points),
    )


def _flipped_columns(columns: Floats) -> Floats:
    """Mirror images of points or directions (3, N)."""
    return np.asarray(columns * FLIP[:, None])


def _reversed_half_edges(half: NDArray[np.integer]) -> NDArray[np.integer]:
    """Numbers of half-edges after each facet's corners are reversed; -1 stays."""
    return np.where(half < 0, -1, half - half % 3 + REVERSED[half % 3])
