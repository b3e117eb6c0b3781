"""How large an object the mirrors see whole, flat and convex (Fig. 5c)."""

from functools import partial

import numpy as np

from tbcad.common.results import Cell, Figure, PlotPanel, Record, Series, Study, Table
from tbcad.core.spec.design import Spec
from tbcad.light.simulate.capture.pixel_counts import virtual_cameras
from tbcad.studies.paper import claims
from tbcad.studies.sweep import DesignAttempt, for_each_n, try_design
from tbcad.types import Progress

RULES = ("flat", "paper", "traced")
# By more than rounding in the coverage that the search for radii leaves.
SHORT_BY = 1e-5
CURVES = {
    "traced_minimum_mm": ("traced radii, minimum", "C2.-"),
    "paper_median_mm": ("eqs. 1 and 2, median", "C1.--"),
    "paper_minimum_mm": ("eqs. 1 and 2, minimum", "C1.-"),
    "flat_median_mm": ("flat, median", "C0.--"),
    "flat_minimum_mm": ("flat, minimum", "C0.-"),
    "flat_closed_form_mm": ("flat, 2 d sin(min theta_0)", "k:"),
    "paper_claim_flat_mm": ("the paper: flat", "k+"),
    "paper_claim_convex_mm": ("the paper: convex", "kx"),
}
NOTES = (
    "flat_closed_form_mm: 2 d sin(min theta_0), the largest sphere that every flat mirror sees "
    "whole when its neighbours bound it on all sides.",
    "Other figures: exact coverage diameter, twice the minimum distance from the centre of the "
    "rays off a mirror's edge, of all mirrors of a half. Edges at the foot count, at the seam only "
    "for mirrors that it does not halve. mirrors_short: number of mirrors below the capture "
    "diameter.",
    "Radii: flat: none; paper: eqs. 1 and 2; traced: exact coverage of the capture diameter and "
    "mirrors.margin_mm, or more where a mirror is nearly flat.",
    "Of the paper's curve of flat mirrors we know n = 4 and n = 18.",
)


def capture_area(
    spec: Spec,
    ns: range,
    progress: Progress = lambda _: None,
    scheduler: str | None = None,
) -> Study:
    """The study: coverage of flat and convex mirrors for every n."""
    records = for_each_n(partial(_record, spec), ns, progress, scheduler)
    table = Table.of_records("capture-area", records, NOTES)
    n = table.numbers("n")
    curves = (Series(label, n, table.numbers(c), style) for c, (label, style) in CURVES.items())
    title = f"Capture diameter, {spec.optics.capture_diameter_mm:g} mm wanted"
    return Study(
        "capture-area",
        tuple(figure for record in records for figure in _figures(record)),
        (table,),
        (PlotPanel(title, "subdivision n", "diameter seen whole, mm", tuple(curves)),),
    )


def _record(spec: Spec, n: int) -> Record:
    """One row: the figures of all radius rules at one n."""
    attempts = {
        rule: try_design(spec, optics={"n": n}, mirrors={"radius_rule": rule}) for rule in RULES
    }
    array = next((attempt.array for attempt in attempts.values() if attempt.array), None)
    record: Record = {"n": n, "virtual_cameras": None, "flat_closed_form_mm": None}
    if array:
        smallest = float(np.sin(array.theta0.min()))
        record["virtual_cameras"] = virtual_cameras(array)
        record["flat_closed_form_mm"] = 2 * array.ellipsoid.camera_distance * smallest
    for rule, attempt in attempts.items():
        coverage = _coverage(attempt, spec.optics.capture_diameter_mm)
        record |= {f"{rule}_{name}": cell for name, cell in coverage.items()}
    flat, convex = claims().get(f"flat_capture_n{n}"), claims()["convex_capture"]
    record["paper_claim_flat_mm"] = flat.value if flat else None
    record["paper_claim_convex_mm"] = convex.value if n == claims()["design_n"].value else None
    return record


def _coverage(attempt: DesignAttempt, capture_mm: float) -> dict[str, Cell]:
    if attempt.array is None:
        empty = dict.fromkeys(("minimum_mm", "median_mm", "mirrors_short"))
        return {**empty, "reason": attempt.reason}
    coverage = attempt.array.coverage
    return {
        "minimum_mm": float(coverage.min()),
        "median_mm": float(np.median(coverage)),
        "mirrors_short": int((coverage < capture_mm * (1 - SHORT_BY)).sum()),
        "reason": "",
    }


def _figures(record: Record) -> list[Figure]:
    n, where = record["n"], claims()["convex_capture"].where
    figures = {
        f"flat, n = {n}, 2 d sin(min theta_0)": ("flat_closed_form_mm", "paper_claim_flat_mm"),
        f"flat, n = {n}, exact minimum": ("flat_minimum_mm", "paper_claim_flat_mm"),
    }
    for rule in ("paper", "traced"):
        for kind in ("minimum", "median"):
            name = f"convex, n = {n}, {rule} radii, exact {kind}"
            figures[name] = (f"{rule}_{kind}_mm", "paper_claim_convex_mm")
    return [
        Figure(name, "mm", record[ours], record[paper], where)
        for name, (ours, paper) in figures.items()
        if record[paper] is not None
    ]
