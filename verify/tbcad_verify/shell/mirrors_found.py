"""Every recorded mirror is on the mesh, there and with that radius, and nothing else is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.mesh.vectors import norm
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
from tbcad_verify.shell.recover import FORM_MM
from tbcad_verify.types import Floats

POSITION_MM = 5e-3
MAX_EXCHANGED = 100  # mirrors for which the record is searched
CHECKS = {
    "mirrors found": "missing or extra",
    "form error": "mm",
    "centre error": "mm",
    "radius error": "mm",
    "surface error": "mm",
}


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
