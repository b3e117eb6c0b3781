"""Radius of the mirrors against their polar angle (the paper's elevation, Fig. 7b)."""

import numpy as np
from numpy.typing import ArrayLike

from tbcad.mirrors.array import MirrorArray, design
from tbcad.simulate.study.plots import Panel, Series
from tbcad.simulate.study.study import Figure, Study
from tbcad.simulate.study.sweep import spec_with
from tbcad.simulate.study.tables import Record, Table
from tbcad.spec.design import Spec
from tbcad.types import Floats, Progress

CURVES = {"traced": ("exact rays", "C0."), "paper": ("eqs. 1 and 2", "C1.")}
WHERE = "Fig. 7b"
NOTES = (
    "The paper's elevation of a mirror is its polar angle about w, the axis from the object to "
    "the camera; azimuth 0 is the zenith's side. Mirrors of camera a; b's mirror them.",
    "Radii: paper: eqs. 1 and 2; traced: exact coverage of the capture diameter and "
    "mirrors.margin_mm. nearly_flat: traced radius set by mirrors.max_radius_widths.",
    "Correlation: Pearson's coefficient over all mirrors. The paper states a correlation; its "
    "coefficient is not known to us.",
)


def elevation(spec: Spec, progress: Progress = lambda _: None) -> Study:
    """The study: radii of every mirror by both rules, and how they follow the angles.

    Raises:
        SpecError: the mirrors cannot be made.
    """
    halves = {}
    for rule in CURVES:
        progress(f"radii by rule {rule}")
        halves[rule] = design(spec_with(spec, mirrors={"radius_rule": rule})).halves[0]
    correlations = [record for rule, half in halves.items() for record in _correlations(rule, half)]
    tables = (
        _mirrors(halves["traced"], halves["paper"], spec.mirrors.max_radius_widths),
        Table.of_records("elevation-correlation", correlations),
    )
    panels = (_panel(halves, "radius", ""), _panel(halves, "radius, logarithmic", "y"))
    return Study("elevation", _figures(halves, correlations), tables, panels)


def _mirrors(traced: MirrorArray, paper: MirrorArray, max_radius_widths: float) -> Table:
    longest = max_radius_widths * traced.half_width
    columns: dict[str, ArrayLike] = {
        "id": traced.ids,
        "polar_deg": np.degrees(traced.polar),
        "azimuth_deg": np.degrees(traced.azimuth),
        "traced_radius_mm": traced.mirrors.radius,
        "paper_radius_mm": paper.mirrors.radius,
        "nearly_flat": (traced.mirrors.radius >= longest * (1 - 1e-9)).astype(int),
    }
    return Table.of_columns("elevation", columns, NOTES)


def _correlations(rule: str, half: MirrorArray) -> list[Record]:
    radius = half.mirrors.radius
    values = {"radius": radius, "log radius": np.log(radius)}
    angles = {"polar angle": half.polar, "absolute azimuth": np.abs(half.azimuth)}
    return [
        {
            "radii": rule,
            "of": name,
            "with": other,
            "correlation": correlation(value, angle),
            "mirrors": len(half),
        }
        for name, value in values.items()
        for other, angle in angles.items()
    ]


def correlation(x: Floats, y: Floats) -> float:
    """Pearson's coefficient of two arrays (k,)."""
    return float(np.corrcoef(x, y)[0, 1])


def _figures(halves: dict[str, MirrorArray], correlations: list[Record]) -> tuple[Figure, ...]:
    ranges = {f"radii by rule {rule}": ("mm", half.mirrors.radius) for rule, half in halves.items()}
    ranges["polar angle"] = ("deg", np.degrees(halves["traced"].polar))
    extremes = (
        Figure(f"{name}, {which}", unit, value, where=WHERE)
        for name, (unit, values) in ranges.items()
        for which, value in (("smallest", float(values.min())), ("largest", float(values.max())))
    )
    names = "correlation of {of} with {with}, {radii}"
    return (
        *extremes,
        *(Figure(names.format(**r), "", r["correlation"], where=WHERE) for r in correlations),
    )


def _panel(halves: dict[str, MirrorArray], what: str, logarithmic: str) -> Panel:
    series = []
    for rule, (label, style) in CURVES.items():
        radius, polar = halves[rule].mirrors.radius, halves[rule].polar
        drawn = correlation(np.log(radius) if logarithmic else radius, polar)
        named = f"{label}: correlation {drawn:.3f}"
        series.append(Series(named, np.degrees(polar), radius, style))
    return Panel(f"Mirrors' {what}", "polar angle about w, deg", "mm", tuple(series), logarithmic)
