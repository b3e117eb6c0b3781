"""How large an object the mirrors see whole, flat and convex (Fig. 5c)."""

from functools import partial

import numpy as np

from tbcad.mirrors.array import MirrorArray
from tbcad.simulate.study.paper import claimed, claims
from tbcad.simulate.study.pixels import virtual_cameras
from tbcad.simulate.study.plots import Panel, Series
from tbcad.simulate.study.study import Study
from tbcad.simulate.study.sweep import DesignAttempt, for_each_n, spec_with, try_design
from tbcad.simulate.study.tables import SUMMARY, Cell, Table, joined
from tbcad.spec.design import Spec
from tbcad.types import Progress

RULES = ("flat", "paper", "traced")
MEASURED = ("least_mm", "median_mm", "short", "reason")
COLUMNS = (
    *("n", "virtual_cameras", "flat_closed_mm"),
    *(f"{rule}_{name}" for rule in RULES for name in MEASURED),
    *("paper_claim_flat_mm", "paper_claim_convex_mm"),
)
NOTES = (
    "flat_closed_mm: 2 d sin(min theta_0), the largest sphere that every flat mirror sees whole "
    "when its neighbours bound it on all sides.",
    "Other figures: exact coverage diameter, twice the least distance from the centre of the rays "
    "off a mirror's edge, of all mirrors of a half. Edges at the foot count, at the seam only for "
    "mirrors that it does not halve. short: mirrors below the capture diameter.",
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
    rows = for_each_n(partial(_of, spec), ns, progress, scheduler)
    table = Table("capture-area", COLUMNS, joined(rows), NOTES)
    summary = Table("capture-area-summary", SUMMARY, _summary(table))
    return Study("capture-area", summary, (table,), (_panel(table, spec),))


def _of(spec: Spec, n: int) -> list[Cell]:
    return _row(spec_with(spec, n=n))


def _row(spec: Spec) -> list[Cell]:
    wanted, n = spec.optics.capture_diameter_mm, spec.optics.n
    tried = {rule: try_design(spec_with(spec, rule=rule)) for rule in RULES}
    made = next((one.made for one in tried.values() if one.made), None)
    closed = None if made is None else _closed(made.halves[0])
    cameras = None if made is None else virtual_cameras(made.halves[0])
    measured = [cell for rule in RULES for cell in _measured(tried[rule], wanted)]
    flat = claims().get(f"flat_capture_n{n}")
    convex = claimed("convex_capture") if n == claimed("design_n") else None
    return [n, cameras, closed, *measured, flat.value if flat else None, convex]


def _closed(half: MirrorArray) -> float:
    return float(2 * half.ellipsoid.camera_distance * np.sin(half.theta0.min()))


def _measured(tried: DesignAttempt, wanted: float) -> tuple[Cell, ...]:
    """Least, median, how many fall short (by more than rounding), and why there is none."""
    if tried.made is None:
        return None, None, None, tried.reason
    coverage = tried.made.halves[0].coverage
    short = int((coverage < wanted * (1 - 1e-5)).sum())
    return float(coverage.min()), float(np.median(coverage)), short, ""


def _summary(table: Table) -> tuple[tuple[Cell, ...], ...]:
    rows: list[tuple[Cell, ...]] = []
    for row in table.rows:
        at = dict(zip(table.columns, row, strict=True))
        n = at["n"]
        if at["paper_claim_flat_mm"] is not None:
            claim = at["paper_claim_flat_mm"]
            rows += [
                (f"flat, n = {n}, 2 d sin(min theta_0)", "mm", at["flat_closed_mm"], claim),
                (f"flat, n = {n}, exact least", "mm", at["flat_least_mm"], claim),
            ]
        if at["paper_claim_convex_mm"] is not None:
            claim = at["paper_claim_convex_mm"]
            rows += [
                (
                    f"convex, n = {n}, {rule} radii, exact {kind}",
                    "mm",
                    at[f"{rule}_{kind}_mm"],
                    claim,
                )
                for rule in ("paper", "traced")
                for kind in ("least", "median")
            ]
    where = claims()["convex_capture"].where
    return tuple((*row, where) for row in rows)


def _panel(table: Table, spec: Spec) -> Panel:
    n = np.array(table.numbers("n"))
    drawn = (
        ("traced radii, least", "traced_least_mm", "C2.-"),
        ("eqs. 1 and 2, median", "paper_median_mm", "C1.--"),
        ("eqs. 1 and 2, least", "paper_least_mm", "C1.-"),
        ("flat, median", "flat_median_mm", "C0.--"),
        ("flat, least", "flat_least_mm", "C0.-"),
        ("flat, 2 d sin(min theta_0)", "flat_closed_mm", "k:"),
        ("the paper: flat", "paper_claim_flat_mm", "r+"),
        ("the paper: convex", "paper_claim_convex_mm", "rx"),
    )
    series = tuple(Series(label, n, np.array(table.numbers(c)), style) for label, c, style in drawn)
    wanted = spec.optics.capture_diameter_mm
    return Panel(f"Capture diameter, {wanted:g} mm wanted", "n", "mm", series)
