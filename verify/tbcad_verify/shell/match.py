"""Which recovered mirror is which recorded one, and how far off it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad_verify.mesh.fits import SurfaceFits
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import chunks, norm, unit
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.shell.recover import FLAT_MM, Recovery
from tbcad_verify.types import Bools, Floats, Ints


@dataclass(frozen=True)
class Match:
    """Recorded mirrors (M, in the record's order) against recovered patches."""

    segment: Ints  # (M,) the patch of each mirror; -1 where it is missing
    extra: Ints  # patches that are mirrors but match none of the record
    centre_error: Floats  # (M,) mm; NaN where missing. For planes: see `compare`.
    radius_error: Floats  # (M,) mm; NaN where missing, 0 for planes
    blur: Floats  # (M,) how well float32 lets either be known, mm; 0 for planes
    surface_error: Floats  # (M,) largest distance of a patch's vertex from the recorded surface, mm


def match(
    mirrors: Mirrors,
    recovery: Recovery,
    mesh: Mesh,
    camera: NDArray[np.str_],
    seen: Ints,
    coating_mm: float,
) -> Match:
    """Pair mirrors and patches that are each other's nearest, camera by camera.

    The middle of a long patch may be nearer to another mirror's apex. So of what is left a mirror
    gets the patch that its camera sees at its apex.

    `camera`: (K,) the camera that each patch's part is for.
    `seen`: (M,) the patch that each mirror's camera sees in line with its apex; -1 for none.
    """
    segment = np.full(len(mirrors), -1, dtype=np.intp)
    for name in np.unique(mirrors.camera):
        rows = np.flatnonzero(mirrors.camera == name)
        patches = np.flatnonzero(recovery.mirror & (camera == name))
        segment[rows] = _mutual(
            mirrors.columns("px", 3)[:, rows], recovery.fits.middle[:, patches], patches
        )
    segment = _with_seen(segment, seen, recovery.mirror)
    extra = np.setdiff1d(np.flatnonzero(recovery.mirror), segment)
    centre, radius = centre_and_radius_errors(mirrors, recovery.fits, segment, coating_mm)
    blur = np.where(mirrors.flat | (segment < 0), 0.0, recovery.fits.blur[segment])
    own = owners(segment, recovery.segments.count)[recovery.segments.label]
    modelled = mirrors.surfaces().coated(-coating_mm)
    surface = surface_errors(mesh, own, modelled, np.where(segment >= 0, 0.0, np.nan))
    return Match(segment, extra, centre, radius, blur, surface)


def centre_and_radius_errors(
    mirrors: Mirrors, fits: SurfaceFits, segment: Ints, coating_mm: float
) -> tuple[Floats, Floats]:
    """Centre and radius errors of matched mirrors, (M,) mm each; NaN where there is no patch.

    A planar mirror has neither. Its centre error is the largest of: the apex's distance from the
    patch, the angle between the normals times the patch's half width, and the patch's bulge.
    """
    matched = np.flatnonzero(segment >= 0)
    surfaces = fits.surfaces.take(segment[matched]).coated(coating_mm)
    flat = mirrors.flat[matched]
    centre, radius = mirrors.columns("cx", 3)[:, matched], mirrors.columns("radius_mm")[0, matched]
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = norm(surfaces.centre() - centre)
        grown = np.abs(1 / surfaces.curvature - radius)
    extent, sag = fits.extent[segment[matched]], fits.sag[segment[matched]]
    apex, normal = mirrors.columns("px", 3)[:, matched], mirrors.columns("nx", 3)[:, matched]
    tilt = norm(unit(surfaces.gradient(apex)) - normal) * extent
    plane = np.max([np.abs(surfaces.height(apex)), tilt, np.where(sag > FLAT_MM, sag, 0)], axis=0)
    errors = np.full((2, len(mirrors)), np.nan)
    errors[0, matched] = np.where(flat, plane, moved)
    errors[1, matched] = np.where(flat, 0.0, grown)
    return errors[0], errors[1]


def owners(segment: Ints, count: int) -> Ints:
    """(K,) the mirror of each of `count` patches, by the patch (M,) of each mirror; -1 for none."""
    owner = np.full(count, -1, dtype=np.intp)
    matched = np.flatnonzero(segment >= 0)
    owner[segment[matched]] = matched
    return owner


def mirror_corners(mesh: Mesh, own: Ints) -> Iterator[tuple[Ints, Floats]]:
    """Mirrors (N,) of facets, and one corner (3, N) of each, mm; a part of them at a time.

    `own`: (F,) mirror of each facet, negative for none.
    """
    facets = np.flatnonzero(own >= 0)
    for part in chunks(facets.size):
        for k in range(3):
            corner = np.take(mesh.points, mesh.faces[facets[part], k], axis=0).T
            yield own[facets[part]], corner


def surface_errors(mesh: Mesh, own: Ints, surfaces: Surfaces, least: Floats) -> Floats:
    """(M,) largest distance of each mirror's corners from its surface, or `least` (M,), mm."""
    worst = least.copy()
    for mine, x in mirror_corners(mesh, own):
        np.maximum.at(worst, mine, np.abs(surfaces.take(mine).height(x)))
    return worst


def _with_seen(segment: Ints, seen: Ints, mirror: Bools) -> Ints:
    """Patches of mirrors (M,) with those added that one unpaired mirror alone is seen on."""
    free = mirror.copy()
    free[segment[segment >= 0]] = False
    rows = np.flatnonzero((segment < 0) & (seen >= 0))
    rows = rows[free[seen[rows]]]
    patch, first, count = np.unique(seen[rows], return_index=True, return_counts=True)
    result = segment.copy()
    result[rows[first[count == 1]]] = patch[count == 1]
    return result


def _mutual(apex: Floats, middle: Floats, patches: Ints) -> Ints:
    if not patches.size:
        return np.full(apex.shape[1], -1, dtype=np.intp)
    nearest = np.atleast_1d(cKDTree(middle.T).query(apex.T)[1])
    back = np.atleast_1d(cKDTree(apex.T).query(middle.T)[1])
    mutual = back[nearest] == np.arange(apex.shape[1])
    return np.where(mutual, patches[nearest], -1)
