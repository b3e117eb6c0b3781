"""The result of a verification: JSON in the export, a table and a verdict on screen."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from tbcad_verify.programs import is_skipped
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.record.poses import virtual_cameras
from tbcad_verify.report.checks import MAX_NAMED, Check, finite, short_list
from tbcad_verify.report.table import table
from tbcad_verify.types import Floats

DIGITS = 9
NAME = "verify.json"
NO_SHELL = "no shell in this export"


@dataclass(frozen=True)
class Report:
    """The verification of one export.

    Attributes:
        target_mm: diameter that every virtual camera must see.
        checks: in the order they were made.
        mirrors: M, as recorded.
        measured: (M,) figures of each mirror, by the name they have in verify.json; NaN is unknown.
        programs: answers of other programs on this computer; empty unless they were asked.
        printing: a row for each part on each printer.
        shell: whether there is a shell; without one, the mirrors are requirements only.
        prototype: what is known of each ball and stop; None without a prototype.
    """

    target_mm: float
    checks: tuple[Check, ...]
    mirrors: Mirrors
    measured: Mapping[str, Floats]
    programs: tuple[Check, ...] = ()
    printing: tuple[dict[str, Any], ...] = ()
    shell: bool = True
    prototype: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        """Return the verdict, not the hundreds of figures."""
        return f"<Report: {self.verdict}>"

    @property
    def passed(self) -> bool:
        """True if every check passed; what is unknown does not."""
        return all(check.passed is True for check in self.checks + self.programs)

    @property
    def verdict(self) -> str:
        """One line: PASS or FAIL, and the figures that decide it."""
        return _pass_line(self) if self.passed else _fail_line(self)

    def to_json(self) -> str:
        """The text of verify.json.

        The same export gives the same text, but for the answers of other programs.
        """
        document = {
            "pass": self.passed,
            "target_mm": self.target_mm,
            "checks": [_check_row(check) for check in self.checks],
            "printing": list(self.printing),
            "mirrors": _mirror_rows(self),
        }
        if self.prototype is not None:
            document["prototype"] = self.prototype
        if self.programs:
            document["programs"] = [_check_row(check) for check in self.programs]
        return json.dumps(document, indent=1, allow_nan=False) + "\n"

    def write(self, folder: Path) -> Path:
        """Write verify.json whole or not at all."""
        handle, name = tempfile.mkstemp(prefix=".verify-", suffix=".json", dir=folder)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as stream:
                stream.write(self.to_json())
                stream.flush()
                os.fsync(stream.fileno())
            Path(name).chmod(0o644)
            Path(name).replace(folder / NAME)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
        return folder / NAME

    def show(self, console: Console) -> None:
        """Print the table and the verdict."""
        console.print(table(self.checks + self.programs))
        console.print(self.verdict, markup=False, highlight=False, soft_wrap=True)


def _check_row(check: Check) -> dict[str, Any]:
    row = {
        "name": check.name,
        "file": check.file,
        "pass": check.passed,
        "measured": _rounded(check.measured),
        "limit": check.limit,
        "unit": check.unit,
    }
    decided = check.passed is True and check.limit is not None  # and so needs no words
    return row | {"detail": check.detail} if check.detail and not decided else row


def _mirror_rows(report: Report) -> list[dict[str, Any]]:
    ids = report.mirrors.ids
    return [
        {"id": ids[k]}
        | {name: _rounded(finite(column[k])) for name, column in report.measured.items()}
        for k in sorted(range(len(ids)), key=ids.__getitem__)
    ]


def _rounded(value: float | None) -> float | int | None:
    if value is None:
        return None
    return int(value) if float(value).is_integer() else round(float(value), DIGITS)


def _pass_line(report: Report) -> str:
    skipped = sum(map(is_skipped, report.programs))
    parts = [_shell_line(report)] if report.shell else [NO_SHELL]
    if report.prototype is not None:
        parts.append(_prototype_line(report.target_mm, report.prototype))
    if skipped:
        parts.append(f"{skipped} questions to other programs skipped")
    return f"PASS: {'; '.join(parts)}"


def _shell_line(report: Report) -> str:
    mirrors, columns = report.mirrors, report.measured
    return (
        f"{len(mirrors)} mirrors, {virtual_cameras(mirrors).count} virtual cameras see "
        f"{report.target_mm:g} mm or more (facets {np.min(columns['coverage_facet_mm']):.2f}, "
        f"spheres {np.min(columns['coverage_fitted_mm']):.2f}); nothing blocked; centres within "
        f"{np.max(columns['centre_error_mm']) * 1e3:.2f} and radii within "
        f"{np.max(columns['radius_error_mm']) * 1e3:.2f} micrometres of the record"
    )


def _prototype_line(target_mm: float, prototype: Mapping[str, Any]) -> str:
    balls, stops = prototype["balls"], prototype["stops"]
    minimum = min(ball["coverage_mm"] for ball in balls)
    worst = max(ball["centre_error_um"] for ball in balls)
    return (
        f"prototype: {len(balls)} balls at {len(stops)} stops show {target_mm:g} mm or "
        f"more for every mirror ({minimum:.2f}); nothing blocked; pads hold the balls within "
        f"{worst:.2f} micrometres of the record"
    )


def _fail_line(report: Report) -> str:
    parts = [] if report.shell else [NO_SHELL]
    for word, verdict in (("failed", False), ("unknown", None)):
        checks = (*report.checks, *report.programs)
        names = dict.fromkeys(check.name for check in checks if check.passed is verdict)
        parts += [f"{word}: {short_list(list(names))}"] if names else []
    return f"FAIL: {'; '.join([*_short_of_target(report), *parts])}"


def _short_of_target(report: Report) -> list[str]:
    """How many virtual cameras see too little, and the worst of them."""
    ids, target = report.mirrors.ids, report.target_mm
    measured = report.measured
    coverage = np.fmin(measured["coverage_facet_mm"], measured["coverage_fitted_mm"])
    virtual = virtual_cameras(report.mirrors)
    _, first = np.unique(virtual.index, return_index=True)  # a halved mirror is named once
    short = first[coverage[first] < target]
    if not short.size:
        return []
    worst = short[np.argsort(coverage[short], kind="stable")][:MAX_NAMED].tolist()
    return [
        f"{short.size} of {virtual.count} virtual cameras fall short of {target:g} mm",
        *(f"{ids[k]} sees {coverage[k]:.2f} mm, {target - coverage[k]:.2f} short" for k in worst),
    ]
