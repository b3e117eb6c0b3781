"""Every recorded mirror is on the mesh, there and with that radius, and nothing else is."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.mesh.vectors import norm
from tbcad_verify.report.checks import Check, CheckName, at_most, short_list, worst_offenders
from tbcad_verify.shell.match import nearest_mirrors
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.shell.recover import FORM_MM
from tbcad_verify.types import Floats

POSITION_MM = 5e-3
CHECKS = {
    "mirrors found": "missing or extra",
    "form error": "mm",
    "centre error": "mm",
    "radius error": "mm",
    "surface error": "mm",
}


def checks(setup: OpticalSetup, files: str) -> list[Check]:
    """Compare what was recovered with the record."""
    found, form, centre, radius, surface = ((name, files, unit) for name, unit in CHECKS.items())
    match, ids = setup.match, setup.export.mirrors.ids
    lost = [ids[k] for k in np.flatnonzero(match.segment < 0).tolist()]
    shape = _forms(setup)
    rough = np.argsort(-shape, kind="stable")
    rough = rough[shape[rough] > FORM_MM]
    return [
        at_most(found, len(lost) + match.extra.size, 0, _who(setup, lost)),
        at_most(
            form, float(shape.max()), FORM_MM, worst_offenders(ids, shape, "mm RMS", rough, ".4f")
        ),
        _errors(setup, centre, match.centre_error, _swaps(setup) + _scale(setup)),
        _errors(setup, radius, match.radius_error, ""),
        _worst(setup, surface, match.surface_error, np.full(len(ids), POSITION_MM), ""),
    ]


def columns(setup: OpticalSetup) -> dict[str, Floats]:
    """What verify.json says of each recorded mirror."""
    return {
        "centre_error_mm": setup.match.centre_error,
        "radius_error_mm": setup.match.radius_error,
    }


def _forms(setup: OpticalSetup) -> Floats:
    """(M,) form error of each mirror's patch, mm; of the nearest patch for missing mirrors."""
    fits, segment = setup.recovery.fits, setup.match.segment.copy()
    lost = np.flatnonzero(segment < 0)
    if lost.size:
        apex = setup.export.mirrors.columns("px", 3)[:, lost]
        segment[lost] = cKDTree(fits.middle.T).query(apex.T)[1]
    return fits.form[segment]


def _who(setup: OpticalSetup, lost: list[str]) -> str:
    extra, ids = setup.match.extra, setup.export.mirrors.ids
    near = nearest_mirrors(setup.export.mirrors, setup.recovery.fits.middle[:, extra])
    said = [f"missing: {short_list(lost)}"] if lost else []
    if extra.size:
        said.append(f"{extra.size} not in the record, near {short_list([ids[k] for k in near])}")
    return "; ".join(said) + _scale(setup)


def _errors(setup: OpticalSetup, name: CheckName, errors: Floats, more: str) -> Check:
    # Of a nearly flat mirror, float32 leaves the centre in doubt, though not the surface.
    return _worst(setup, name, errors, np.maximum(POSITION_MM, setup.match.blur), more)


def _worst(
    setup: OpticalSetup, name: CheckName, errors: Floats, limits: Floats, more: str
) -> Check:
    """Hold every mirror to its own limit, and show the one that uses most of it."""
    with np.errstate(invalid="ignore"):  # infinitely wrong, of something infinitely in doubt
        used = np.nan_to_num(errors / limits, nan=-1.0, posinf=1e300)
    order = np.argsort(-used, kind="stable")
    over = order[used[order] > 1]
    if used[order[0]] < 0:
        return at_most(name, np.nan, POSITION_MM, "no mirror found")
    who = worst_offenders(setup.export.mirrors.ids, errors, "mm", over, ".4f")
    return at_most(name, float(errors[order[0]]), float(limits[order[0]]), who + more)


def _swaps(setup: OpticalSetup) -> str:
    """Mirrors whose recovered centre is the recorded one of another."""
    match, mirrors = setup.match, setup.export.mirrors
    moved = np.flatnonzero(match.centre_error > POSITION_MM)[:100]
    recorded = mirrors.columns("cx", 3)
    centre = setup.mirrors.take(moved).centre()
    far = [np.nan_to_num(np.linalg.norm(recorded.T - c, axis=1), nan=np.inf) for c in centre.T]
    pairs = [
        (k, int(np.argmin(d)))
        for k, d in zip(moved.tolist(), far, strict=True)
        if d.min() <= POSITION_MM
    ]
    said = [f"{mirrors.ids[k]} has the place of {mirrors.ids[other]}" for k, other in pairs]
    return f"; {short_list(said)}" if said else ""


def _scale(setup: OpticalSetup) -> str:
    """A hint when everything is off by one factor, as with inches."""
    ratio = norm(setup.mesh.points.T).max() / norm(setup.export.mirrors.columns("px", 3)).max()
    return "" if 0.2 < ratio < 5 else f"; the mesh is about {ratio:.2g} x the record's size"
