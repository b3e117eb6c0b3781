"""The mirrors in a mesh: it is cut into patches, splinters are merged, and each is judged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.fits import SurfaceFits
from tbcad_verify.mesh.holes import round_holes
from tbcad_verify.mesh.merge import MIN_VERTICES, merge_splinters
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.segments import (
    Edges,
    Segmentation,
    count_folds,
    measure_edges,
    segment_mesh,
)
from tbcad_verify.mesh.surfaces import reflect_directions
from tbcad_verify.mesh.vectors import dot, joined, norm
from tbcad_verify.types import Bools, Floats

# A patch is a mirror's only if its vertices lie on one sphere or plane to within this, RMS.
FORM_MM = 1e-3
# And only if its facets, which are flat, follow the surface to within this, or to within this
# share of its bulge: vertices alone may fit by chance, as those of a cone or a bore do, whose few
# circles lie on a sphere.
CHORD_MM, CHORD_SHARE = 0.1, 0.05
# What bulges less than this over its extent is a plane: ten times what float32 rounding does.
FLAT_MM = 1e-4
# Minimum cosine of incidence on a mirror.
GRAZING = 0.05


@dataclass(frozen=True)
class Recovery:
    """The patches of one or more meshes."""

    segments: Segmentation  # patch of every facet
    fits: SurfaceFits  # surface of every patch
    mirror: Bools  # (K,) true for those that are mirrors
    folds: int  # edges at which the mesh is folded onto itself


def recover(
    mesh: Mesh, pinhole: Floats | None, radius_mm: float, edges: Edges | None = None
) -> Recovery:
    """Find the mirrors of one part, from triangles alone.

    A mirror is a patch of a bulging sphere, or of a plane that sends the camera's light into the
    capture sphere and is no strip of a round hole's wall; it faces both the camera and the object.

    Args:
        mesh: the part.
        pinhole: (3,) mm; None for parts that have no mirrors.
        radius_mm: of the capture sphere about the origin.
        edges: of the mesh, if they are measured.
    """
    edges = edges or measure_edges(mesh)
    segments, fits = merge_splinters(mesh, edges, segment_mesh(mesh, edges))
    mirror = _judge(fits, pinhole, radius_mm)
    if (mirror & _planes(fits)).any():
        mirror &= ~_hole_walls(mesh, edges, segments)
    return Recovery(segments, fits, mirror, count_folds(edges))


def join_recoveries(parts: list[Recovery]) -> Recovery:
    """Several parts' patches, numbered on."""
    starts = np.cumsum([0, *(part.segments.count for part in parts)])
    label = np.concatenate(
        [part.segments.label + start for part, start in zip(parts, starts, strict=False)]
    )
    return Recovery(
        Segmentation(label.astype(np.int32), int(starts[-1])),
        joined([part.fits for part in parts]),
        np.concatenate([part.mirror for part in parts]),
        sum(part.folds for part in parts),
    )


def follows_fit(fits: SurfaceFits) -> Bools:
    """(K,) true where the fitted surface is what the patch really is."""
    followed = fits.chord < np.maximum(CHORD_MM, CHORD_SHARE * np.abs(fits.sag))
    return np.asarray((fits.form < FORM_MM) & followed)


def _judge(fits: SurfaceFits, pinhole: Floats | None, radius_mm: float) -> Bools:
    if pinhole is None:
        return np.zeros(fits.form.size, dtype=np.bool_)
    middle, normal = fits.middle, fits.normal
    incoming = middle - pinhole[:, None]
    facing = [-dot(d, normal) > GRAZING * norm(d) for d in (incoming, middle)]
    outgoing = reflect_directions(incoming, normal)
    along = dot(middle, outgoing) / dot(outgoing, outgoing)
    # Some of its light lands: what leaves the middle may miss by the patch's own image.
    image = fits.extent * (1 + norm(middle) / norm(incoming))
    lands = norm(middle - along * outgoing) <= radius_mm + image
    bulges = (fits.sag > FLAT_MM) & (fits.count >= MIN_VERTICES)
    is_mirror = bulges | (_planes(fits) & lands)
    return np.asarray(follows_fit(fits) & facing[0] & facing[1] & is_mirror)


def _planes(fits: SurfaceFits) -> Bools:
    return np.asarray(np.abs(fits.sag) <= FLAT_MM)


def _hole_walls(mesh: Mesh, edges: Edges, segments: Segmentation) -> Bools:
    """(K,) the patches in walls of round holes: each facet of a coarse cylinder is a plane."""
    walls = np.zeros(segments.count, dtype=np.bool_)
    walls[segments.label[round_holes(mesh, edges).wall]] = True
    return walls
