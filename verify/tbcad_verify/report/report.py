"""The result of a verification: JSON in the build, a table and a verdict on screen."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rich.console import Console

from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.record.poses import virtual_cameras
from tbcad_verify.report.as_made import AsMade, ProcessYield, prototype_line, shells_line
from tbcad_verify.report.checks import Check, finite
from tbcad_verify.report.methods import key_figures, remedy
from tbcad_verify.report.text import (
    WIDTH,
    changed_files,
    changed_lines,
    listed_names,
    printer_lines,
    summary,
    table,
)
from tbcad_verify.types import Floats

DIGITS = 9
LIMIT_DIGITS = 12  # significant
NAME = "verify.json"
SCHEMA = "tbcad-verify-summary/1"
BEGIN = "Files: FAIL, "
PRINTABLE = "printable"  # the check of a part by the printer that the design names
STATES = (("failed", False), ("unknown", None))
Output = Literal["summary", "full", "quiet", "json"]


@dataclass(frozen=True)
class Report:
    """The verification of one build.

    Attributes:
        target_mm: diameter that every virtual camera must see.
        checks: in the order they were made.
        mirrors: M, as recorded.
        measured: (M,) figures of each mirror, by the name they have in verify.json; NaN is unknown.
        programs: answers of other programs on this computer; empty unless they were asked.
        printing: a row for each part on each printer.
        shell: whether there is a shell; without one, the mirrors are requirements only.
        valleys: whether its mirrors meet in valleys, which solids have without a cutter's fillets.
        balls: number of the prototype's balls; 0 without a prototype.
        note: what the build says of itself, such as why a part was left out; "" for nothing.
        folder: where the build lies.
        seconds: what the command took.
        as_made: simulated builds of the design; None if nobody simulated any.
    """

    target_mm: float
    checks: tuple[Check, ...]
    mirrors: Mirrors
    measured: Mapping[str, Floats]
    programs: tuple[Check, ...] = ()
    printing: tuple[dict[str, Any], ...] = ()
    shell: bool = True
    valleys: bool = False
    balls: int = 0
    note: str = ""
    folder: Path | None = None
    seconds: float | None = None
    as_made: AsMade | None = None

    def __repr__(self) -> str:
        """Return the verdict, not the hundreds of figures."""
        return f"<Report: {self.verdict}>"

    @property
    def passed(self) -> bool:
        """True if every check passed; what is unknown does not."""
        return all(check.passed is True for check in self.checks + self.programs)

    @property
    def verdict(self) -> str:
        """One line on the files: PASS or FAIL, and what decides it."""
        return _pass_line(self) if self.passed else _fail_line(self)

    @property
    def verdict_lines(self) -> list[str]:
        """The verdict on the files, then whether shells and prototype can be made."""
        parts = [check for check in self.checks if check.name == PRINTABLE]
        shells = [shells_line(self.as_made)] if self.shell else []
        printed = prototype_line(self.as_made, len(parts), len(self.unprintable))
        return [self.verdict, *shells, *([printed] if self.balls else [])]

    @property
    def unprintable(self) -> list[str]:
        """STL files of the prototype's parts that its printer cannot make."""
        return [one.file for one in self.checks if one.name == PRINTABLE and not one.passed]

    def names_of(self, state: bool | None) -> list[str]:
        """Names of the checks that passed (True), failed (False) or are unknown (None)."""
        checks = (*self.checks, *self.programs)
        return list(dict.fromkeys(check.name for check in checks if check.passed is state))

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

    def show(self, console: Console, output: Output = "summary") -> None:
        """Print the result.

        `output`: "summary" (at most fourteen lines), "full" (every check before it), "quiet" (the
        verdict, and what was changed), or "json" (the summary for other programs).
        """
        if output == "full":
            self._show_all(console)
        if output in ("summary", "full"):
            for line in summary(self):
                console.print(line, highlight=False, soft_wrap=True)
        else:
            verdict = self.verdict_lines if self.as_made else [self.verdict]
            lines = [*verdict, *changed_lines(self.checks)]
            text = "\n".join(lines) if output == "quiet" else summary_json(self)
            console.print(text, markup=False, highlight=False, soft_wrap=True)

    def _show_all(self, console: Console) -> None:
        width = min(console.width, WIDTH)
        shown = [check for check in self.checks if not self._is_unasked_print(check)]
        console.print(table((*shown, *self.programs)), width=width)
        for line in printer_lines(self.printing):
            console.print(line, markup=False, highlight=False, width=width)
        console.print()

    def _is_unasked_print(self, check: Check) -> bool:
        """A line for a part on a printer that nobody asked for: printers are listed apart."""
        printers = {f"print {row['profile']}" for row in self.printing}
        return check.limit is None and check.passed is True and check.name in printers


def _check_row(check: Check) -> dict[str, Any]:
    row = {
        "name": check.name,
        "file": check.file,
        "pass": check.passed,
        "measured": _rounded(check.measured),
        "limit": _same_each_time(check.limit),
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


def _same_each_time(limit: float | None) -> float | None:
    """A limit without its last digits: sums that it comes from depend on where arrays lie."""
    if limit is None or float(limit).is_integer():
        return limit
    return float(f"{limit:.{LIMIT_DIGITS}g}")


def _rounded(value: float | None) -> float | int | None:
    if value is None:
        return None
    return int(value) if float(value).is_integer() else round(float(value), DIGITS)


def _pass_line(report: Report) -> str:
    sees = f"see {report.target_mm:g} mm"
    if not report.shell:
        return f"Files: PASS, as designed all mirrors {sees} on {report.balls} balls; no shell"
    count = virtual_cameras(report.mirrors).count
    too = f", on {report.balls} balls too" if report.balls else ""
    return f"Files: PASS, as designed {count} virtual cameras {sees}{too}"


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


def summary_json(report: Report) -> str:
    """Verdict, key figures and what failed as a JSON object, explained in verify/README.md."""
    document = {
        "schema": SCHEMA,
        "verdict": "pass" if report.passed else "fail",
        "target_mm": report.target_mm,
        "figures": [
            {"label": one.label, **_figures(check), "pass": check.passed}
            for one, check in key_figures(report)
        ],
        "failed": [
            {
                **_figures(check),
                "pass": check.passed,
                "detail": check.detail,
                "remedy": remedy(check),
            }
            for check in (*report.checks, *report.programs)
            if check.passed is not True
        ],
        "changed": changed_files(report.checks),
        "as_made": _as_made(report),
        "note": report.note or None,
        "folder": None if report.folder is None else str(report.folder),
        "seconds": None if report.seconds is None else round(report.seconds, 1),
    }
    return json.dumps(document, indent=1, allow_nan=False)


def _figures(check: Check) -> dict[str, Any]:
    bound = None if check.limit is None else check.bound
    return {
        "check": check.name,
        "file": check.file,
        "measured": check.measured,
        "bound": bound,
        "limit": check.limit,
        "unit": check.unit,
    }


def _as_made(report: Report) -> dict[str, Any] | None:
    as_made = report.as_made
    if as_made is None:
        return None
    made = as_made.prototype
    return {
        "builds": as_made.builds,
        "processes": [_yield(one) for one in as_made.processes],
        "prototype": made and _yield(made),
        "reason": as_made.reason or None,
    }


def _yield(one: ProcessYield) -> dict[str, Any]:
    return {
        "process": one.process,
        "yield": one.share,
        "builds": one.builds,
        "coverage_mm": one.coverage_mm,
    }
