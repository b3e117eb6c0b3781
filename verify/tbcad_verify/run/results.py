"""Measurements of the stages, as plain data that another process can send."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from tbcad_verify.mesh.mesh import MassProperties
from tbcad_verify.report.checks import Check
from tbcad_verify.types import Floats, Progress

Row = dict[str, Any]
MirrorChecks: TypeAlias = tuple[list[Check], dict[str, Floats]]
"""Checks, and columns of `PER_MIRROR`."""
PER_MIRROR = (
    "coverage_facet_mm",
    "coverage_fitted_mm",
    "centre_error_mm",
    "radius_error_mm",
    "pixels",
)


@dataclass
class Results:
    """Measurements of one stage, or several."""

    stages: list[str] = field(default_factory=list)  # titles of the stages begun
    checks: list[Check] = field(default_factory=list)  # in the order they were made
    # figures of every recorded mirror, (M,) each: columns of `PER_MIRROR`
    mirrors: dict[str, Floats] = field(default_factory=dict)
    # mass properties of each part's mesh, by the part's name
    masses: dict[str, MassProperties] = field(default_factory=dict)
    printing: list[Row] = field(default_factory=list)  # a row for each part on each printer


ResultSink: TypeAlias = Callable[[Results], None]
"""Receives what the stages measure, as they measure it."""


@dataclass
class CollectedResults(Results):
    """The results of all stages, and a report of each stage's beginning."""

    progress: Progress = field(default=lambda _: None)

    def add(self, results: Results) -> None:
        """Add what a stage measured."""
        self.stages += results.stages
        self.checks += results.checks
        self.mirrors |= results.mirrors
        self.masses |= results.masses
        self.printing += results.printing
        for title in results.stages:
            self.progress(title)
