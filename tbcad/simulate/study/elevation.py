"""Radius of the mirrors against their polar angle (the paper's elevation, Fig. 7b)."""

import numpy as np

from tbcad.mirrors.array import MirrorArray, design
from tbcad.simulate.study.plots import Panel, Series
from tbcad.simulate.study.study import Study
from tbcad.simulate.study.sweep import spec_with
from tbcad.simulate.study.tables import SUMMARY, Cell, Table
from tbcad.spec.design import Spec
from tbcad.types import Floats, Progress

RULES = ("traced", "paper")
COLUMNS = ("id", "polar_deg", "azimuth_deg", "traced_radius_mm", "paper_radius_mm", "nearly_flat")
CORRELATION = ("radii", "of", "with", "correlation", "mirrors")
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
    for rule in RULES:
        progress(f"radii by rule {rule}")
        halves[rule] = design(spec_with(spec, rule=rule)).halves[0]
    mirrors = Table("elevation", COLUMNS, _rows(halves, spec), NOTES)
    found = tuple(row for rule in RULES for row in _correlations(rule, halves[rule]))
    correlated = Table("elevation-correlation", CORRELATION, found)
    summary = Table("elevation-summary", SUMMARY, _summary(halves, correlated))
    panels = (_panel(halves, "radius", ""), _panel(halves, "radius, logarithmic", "y"))
    return Study("elevation", summary, (mirrors, correlated), panels)


def _rows(halves: dict[str, MirrorArray], spec: Spec) -> tuple[tuple[Cell, ...], ...]:
    traced, paper = halves["traced"], halves["paper"]
    longest = spec.mirrors.max_radius_widths * traced.half_width
    numbers = np.column_stack(
        [
            np.degrees(traced.polar),
            np.degrees(traced.azimuth),
            traced.mirrors.radius,
            paper.mirrors.radius,
        ]
    )
    flat = traced.mirrors.radius >= longest * (1 - 1e-9)
    return tuple(
        (name, *row, int(nearly))
        for name, row, nearly in zip(traced.ids, numbers.tolist(), flat.tolist(), strict=True)
    )


def _correlations(rule: str, half: MirrorArray) -> list[tuple[Cell, ...]]:
    radius = half.mirrors.radius
    values = {"radius": radius, "log radius": np.log(radius)}
    angles = {"polar angle": half.polar, "absolute azimuth": np.abs(half.azimuth)}
    return [
        (rule, name, other, correlation(value, angle), len(half))
        for name, value in values.items()
        for other, angle in angles.items()
    ]


def correlation(x: Floats, y: Floats) -> float:
    """Pearson's coefficient of two arrays (k,)."""
    return float(np.corrcoef(x, y)[0, 1])


def _summary(halves: dict[str, MirrorArray], correlated: Table) -> tuple[tuple[Cell, ...], ...]:
    where = "Fig. 7b"
    rows: list[tuple[Cell, ...]] = []
    for rule in RULES:
        radius, polar = halves[rule].mirrors.radius, np.degrees(halves[rule].polar)
        rows += [
            (f"radii by rule {rule}, least", "mm", float(radius.min()), None, where),
            (f"radii by rule {rule}, largest", "mm", float(radius.max()), None, where),
        ]
    rows += [
        ("polar angle, least", "deg", float(polar.min()), None, where),
        ("polar angle, largest", "deg", float(polar.max()), None, where),
    ]
    return (
        *rows,
        *(
            (f"correlation of {of} with {with_}, {rule}", "", value, None, where)
            for rule, of, with_, value, _ in correlated.rows
        ),
    )


def _panel(halves: dict[str, MirrorArray], what: str, logarithmic: str) -> Panel:
    styles = {"traced": ("exact rays", "C0."), "paper": ("eqs. 1 and 2", "C1.")}
    series = tuple(
        Series(
            f"{styles[rule][0]}: correlation {_drawn(half, logarithmic):.3f}",
            np.degrees(half.polar),
            half.mirrors.radius,
            styles[rule][1],
        )
        for rule, half in halves.items()
    )
    return Panel(f"Mirrors' {what}", "polar angle about w, deg", "mm", series, logarithmic)


def _drawn(half: MirrorArray, logarithmic: str) -> float:
    radius = half.mirrors.radius
    return correlation(np.log(radius) if logarithmic else radius, half.polar)
