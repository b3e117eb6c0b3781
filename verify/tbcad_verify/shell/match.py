"""Which recovered mirror is which recorded one, how far off it is, and whether any is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad_verify.mesh.fits import SurfaceFits
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.vectors import chunks, norm, unit
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_most,
    check_names,
    each_at_most,
    short_list,
    worst_offenders,
)
from tbcad_verify.run.results import MirrorChecks
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.shell.recover import FLAT_MM, FORM_MM, Recovery
from tbcad_verify.types import Bools, Floats, Ints

POSITION_MM = 5e-3
MAX_EXCHANGED = 100  # mirrors for which the record is searched
CHECKS = {
    "mirrors found": "missing or extra",
    "form error": "mm",
    "centre error": "mm",
    "radius error": "mm",
    "surface error": "mm",
}


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

    Args:
        mirrors: the record.
        recovery: all parts' patches, K.
        mesh: all parts.
        camera: (K,) the camera that each patch's part is for.
        seen: (M,) the patch that each mirror's camera sees in line with its apex; -1 for none.
        coating_mm: the coat that the mesh does not show.
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
    surface = _surface_errors(mirrors, recovery, mesh, segment, coating_mm)
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


def _surface_errors(
    mirrors: Mirrors, recovery: Recovery, mesh: Mesh, segment: Ints, coating_mm: float
) -> Floats:
    mirror = owners(segment, recovery.segments.count)[recovery.segments.label]
    facets = np.flatnonzero(mirror >= 0)
    modelled = mirrors.surfaces().coated(-coating_mm)
    worst = np.where(segment >= 0, 0.0, np.nan)
    for part in chunks(facets.size):
        mine = mirror[facets[part]]
        surfaces = modelled.take(mine)
        for k in range(3):
            x = np.take(mesh.points, mesh.faces[facets[part], k], axis=0).T
            np.maximum.at(worst, mine, np.abs(surfaces.height(x)))
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


def checks(setup: OpticalSetup, files: str) -> MirrorChecks:
    """The recovered mirrors against the record, and the errors of each."""
    found, form, centre, radius, surface = check_names(CHECKS, files)
    match, ids = setup.match, setup.export.mirrors.ids
    missing = [ids[k] for k in np.flatnonzero(match.segment < 0).tolist()]
    number = len(missing) + match.extra.size
    # Of a nearly flat mirror, float32 leaves the centre in doubt, though not the surface.
    sphere_limit = np.maximum(POSITION_MM, match.blur)
    surface_limit = np.full(len(ids), POSITION_MM)
    hint = _exchanged(setup) + _scale(setup)
    columns = {"centre_error_mm": match.centre_error, "radius_error_mm": match.radius_error}
    return [
        at_most(found, number, 0, _missing_and_extra(setup, missing) + _scale(setup)),
        each_at_most(form, ids, _form_errors(setup), FORM_MM, "mm RMS"),
        _within_limits(centre, ids, match.centre_error, sphere_limit, hint),
        _within_limits(radius, ids, match.radius_error, sphere_limit),
        _within_limits(surface, ids, match.surface_error, surface_limit),
    ], columns


def _form_errors(setup: OpticalSetup) -> Floats:
    """(M,) form error of each mirror's patch, mm; of the nearest patch for missing mirrors."""
    fits, segment = setup.recovery.fits, setup.match.segment.copy()
    missing = np.flatnonzero(segment < 0)
    if missing.size:
        apex = setup.export.mirrors.columns("px", 3)[:, missing]
        segment[missing] = cKDTree(fits.middle.T).query(apex.T)[1]
    return fits.form[segment]


def _missing_and_extra(setup: OpticalSetup, missing: list[str]) -> str:
    extra, mirrors = setup.match.extra, setup.export.mirrors
    parts = [f"missing: {short_list(missing)}"] if missing else []
    if extra.size:
        apices = cKDTree(mirrors.columns("px", 3).T)
        near = np.atleast_1d(apices.query(setup.recovery.fits.middle[:, extra].T)[1])
        names = short_list([mirrors.ids[k] for k in near])
        parts.append(f"{extra.size} not in the record, near {names}")
    return "; ".join(parts)


def _within_limits(
    name: CheckName, ids: Sequence[str], errors: Floats, limits: Floats, hint: str = ""
) -> Check:
    """Every mirror against a limit of its own; the figure is that of the worst."""
    with np.errstate(invalid="ignore"):  # infinite errors of what is infinitely in doubt
        share = np.nan_to_num(errors / limits, nan=-1.0, posinf=1e300)
    worst = int(share.argmax())
    if share[worst] < 0:
        return at_most(name, np.nan, POSITION_MM, "no mirror found")
    who = worst_offenders(ids, errors, "mm", share > 1, ".4f", share)
    return at_most(name, float(errors[worst]), float(limits[worst]), who + hint)


def _exchanged(setup: OpticalSetup) -> str:
    """Mirrors whose recovered centre is the recorded centre of another."""
    match, mirrors = setup.match, setup.export.mirrors
    moved = np.flatnonzero(match.centre_error > POSITION_MM)[:MAX_EXCHANGED]
    centres = setup.mirrors.take(moved).centre()
    known = np.isfinite(centres).all(axis=0)
    spheres = np.flatnonzero(~mirrors.flat)
    recorded = cKDTree(mirrors.columns("cx", 3)[:, spheres].T)
    distance, other = (np.atleast_1d(x) for x in recorded.query(centres[:, known].T))
    pairs = [
        f"{mirrors.ids[k]} has the place of {mirrors.ids[spheres[j]]}"
        for k, j, d in zip(moved[known], other, distance, strict=True)
        if d <= POSITION_MM
    ]
    return f"; {short_list(pairs)}" if pairs else ""


def _scale(setup: OpticalSetup) -> str:
    """A hint when everything is off by one factor, as with inches."""
    ratio = norm(setup.mesh.points.T).max() / norm(setup.export.mirrors.columns("px", 3)).max()
    return "" if 0.2 < ratio < 5 else f"; the mesh is about {ratio:.2g} x the record's size"
