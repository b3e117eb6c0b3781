"""The verdict in one line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tbcad_verify.record.poses import virtual_cameras
from tbcad_verify.report.text import WIDTH, listed_names

if TYPE_CHECKING:
    from tbcad_verify.report.report import Report

BEGIN = "FAIL: "
STATES = (("failed", False), ("unknown", None))


def verdict_line(report: Report) -> str:
    """PASS or FAIL, what the files show as designed, and what failed, in one line."""
    return _pass_line(report) if report.passed else _fail_line(report)


def _pass_line(report: Report) -> str:
    sees, balls = f"{report.target_mm:g} mm or more", report.prototype and report.prototype["balls"]
    if not report.shell:
        return f"PASS: as designed, every mirror sees {sees} on {len(balls or ())} balls; no shell"
    count = virtual_cameras(report.mirrors).count
    too = f", on {len(balls)} balls too" if balls else ""
    return f"PASS: as designed, {count} virtual cameras see {sees}{too}"


def _fail_line(report: Report) -> str:
    parts = _short_of_target(report)
    groups = [(word, names) for word, state in STATES if (names := report.names_of(state))]
    for k, (word, names) in enumerate(groups):
        used = len("; ".join([BEGIN, *parts])) + len(f"; {word}: ")
        parts.append(f"{word}: {listed_names(names, (WIDTH - used) // (len(groups) - k))}")
    return BEGIN + "; ".join(parts)


def _short_of_target(report: Report) -> list[str]:
    """How many virtual cameras see too little."""
    measured, target = report.measured, report.target_mm
    coverage = np.fmin(measured["coverage_facet_mm"], measured["coverage_fitted_mm"])
    virtual = virtual_cameras(report.mirrors)
    short = np.unique(virtual.index[coverage < target]).size
    text = f"{short} of {virtual.count} virtual cameras see less than {target:g} mm"
    return [text] if short else []
