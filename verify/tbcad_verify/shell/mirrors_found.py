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
    "form": "mm",
    "centre error": "mm",
    "radius error": "mm",
    "surface error": "mm",
}


def checks(bench: OpticalSetup, files: str) -> list[Check]:
    """Compare what was recovered with the record."""
    found, form, centre, radius, surface = ((name, files, unit) for name, unit in CHECKS.items())
    match, ids = bench.match, bench.export.mirrors.ids
    lost = [ids[k] for k in np.flatnonzero(match.segment < 0).tolist()]
    shape = _forms(bench)
    rough = np.argsort(-shape, kind="stable")
    rough = rough[shape[rough] > FORM_MM]
    return [
        at_most(found, len(lost) + match.extra.size, 0, _who(bench, lost)),
        at_most(
            form, float(shape.max()), FORM_MM, worst_offenders(ids, shape, "mm RMS", rough, ".4f")
        ),
        _errors(bench, centre, match.centre_error, _swaps(bench) + _scale(bench)),
        _errors(bench, radius, match.radius_error, ""),
        _worst(bench, surface, match.surface_error, np.full(len(ids), POSITION_MM), ""),
    ]


def columns(setup: OpticalSetup) -> dict[str, Floats]:
    """What verify.json says of each recorded mirror."""
    return {
        "centre_error_mm": setup.match.centre_error,
        "radius_error_mm": setup.match.radius_error,
    }


def _forms(bench: OpticalSetup) -> Floats:
    """(M,) form error of each mirror's patch, mm; of the nearest patch for missing mirrors."""
    fits, segment = bench.recovery.fits, bench.match.segment.copy()
    lost = np.flatnonzero(segment < 0)
    if lost.size:
        apex = bench.export.mirrors.columns("px", 3)[:, lost]
        segment[lost] = cKDTree(fits.middle.T).query(apex.T)[1]
    return fits.form[segment]


def _who(bench: OpticalSetup, lost: list[str]) -> str:
    extra, ids = bench.match.extra, bench.export.mirrors.ids
    near = nearest_mirrors(bench.export.mirrors, bench.recovery.fits.middle[:, extra])
    said = [f"missing: {short_list(lost)}"] if lost else []
    if extra.size:
        said.append(f"{extra.size} not in the record, near {short_list([ids[k] for k in near])}")
    return "; ".join(said) + _scale(bench)


def _errors(bench: OpticalSetup, name: CheckName, errors: Floats, more: str) -> Check:
    # Of a nearly flat mirror, float32 leaves the centre in doubt, though not the surface.
    return _worst(bench, name, errors, np.maximum(POSITION_MM, bench.match.blur), more)


def _worst(
    bench: OpticalSetup, name: CheckName, errors: Floats, limits: Floats, more: str
) -> Check:
    """Hold every mirror to its own limit, and show the one that uses most of it."""
    with np.errstate(invalid="ignore"):  # infinitely wrong, of something infinitely in doubt
        used = np.nan_to_num(errors / limits, nan=-1.0, posinf=1e300)
    order = np.argsort(-used, kind="stable")
    over = order[used[order] > 1]
    if used[order[0]] < 0:
        return at_most(name, np.nan, POSITION_MM, "no mirror found")
    who = worst_offenders(bench.export.mirrors.ids, errors, "mm", over, ".4f")
    return at_most(name, float(errors[order[0]]), float(limits[order[0]]), who + more)


def _swaps(bench: OpticalSetup) -> str:
    """Mirrors whose recovered centre is the recorded one of another."""
    match, mirrors = bench.match, bench.export.mirrors
    moved = np.flatnonzero(match.centre_error > POSITION_MM)[:100]
    recorded = mirrors.columns("cx", 3)
    centre = bench.mirrors.take(moved).centre()
    far = [np.nan_to_num(np.linalg.norm(recorded.T - c, axis=1), nan=np.inf) for c in centre.T]
    pairs = [
        (k, int(np.argmin(d)))
        for k, d in zip(moved.tolist(), far, strict=True)
        if d.min() <= POSITION_MM
    ]
    said = [f"{mirrors.ids[k]} has the place of {mirrors.ids[other]}" for k, other in pairs]
    return f"; {short_list(said)}" if said else ""


def _scale(bench: OpticalSetup) -> str:
    """A hint when everything is off by one factor, as with inches."""
    ratio = norm(bench.mesh.points.T).max() / norm(bench.export.mirrors.columns("px", 3)).max()
    return "" if 0.2 < ratio < 5 else f"; the mesh is about {ratio:.2g} x the record's size"
