"""What a proof found: as JSON in the export, as a table and one verdict line on screen."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from tbcad_verify.programs import is_skipped
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.record.poses import virtual_cameras
from tbcad_verify.report.checks import NAMED, Check, all_passed, finite
from tbcad_verify.report.table import table
from tbcad_verify.run.results import PER_MIRROR
from tbcad_verify.types import Floats

DIGITS = 9
NAME = "verify.json"


@dataclass(frozen=True)
class Findings:
    """One row a recorded mirror, M of them; NaN is unknown. Halves of one mirror share coverage.

    Attributes:
        ids: names.
        virtual: (M,) virtual camera of each mirror.
        coverage_facet: (M,) mm.
        coverage_fitted: (M,) mm.
        centre_error: (M,) mm.
        radius_error: (M,) mm.
        pixels: (M,) of the real camera that see the object in this mirror.
    """

    ids: tuple[str, ...]
    virtual: NDArray[np.intp]
    coverage_facet: Floats
    coverage_fitted: Floats
    centre_error: Floats
    radius_error: Floats
    pixels: Floats


def findings(mirrors: Mirrors, columns: Mapping[str, Floats]) -> Findings:
    """Findings from the columns that the stages could make; the others are unknown.

    Args:
        mirrors: as recorded.
        columns: of `PER_MIRROR`, (M,) each.
    """
    blank = np.full(len(mirrors), np.nan)
    return Findings(
        mirrors.ids,
        virtual_cameras(mirrors).index,
        *(columns.get(name, blank) for name in PER_MIRROR),
    )


@dataclass(frozen=True)
class Report:
    """The proof of one export.

    Attributes:
        target_mm: diameter that every virtual camera must see.
        checks: in the order they were made.
        findings: mirror by mirror.
        programs: what other programs on this machine said; empty unless they were asked.
        printing: what making each part on each machine comes to.
        shell: whether there is a shell; without, the mirrors are only wanted.
        prototype: what is found of the machine with balls; None where there is none.
    """

    target_mm: float
    checks: tuple[Check, ...]
    findings: Findings
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
        return all_passed(self.checks + self.programs)

    @property
    def verdict(self) -> str:
        """One line: PASS or FAIL, and what decides it."""
        return _pass_line(self) if self.passed else _fail_line(self)

    def to_json(self) -> str:
        """The text of verify.json.

        The same for the same export, but for what other programs said, if they were asked.
        """
        document = {
            "pass": self.passed,
            "target_mm": self.target_mm,
            "checks": [_check_row(check) for check in self.checks],
            "printing": list(self.printing),
            "mirrors": _mirror_rows(self.findings),
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
    return row | {"detail": check.detail} if check.detail and not _held(check) else row


def _held(check: Check) -> bool:
    """Whether a check passed against a limit, and so needs no words."""
    return check.passed is True and check.limit is not None


def _mirror_rows(found: Findings) -> list[dict[str, Any]]:
    values = (
        found.coverage_facet,
        found.coverage_fitted,
        found.centre_error,
        found.radius_error,
        found.pixels,
    )
    columns = dict(zip(PER_MIRROR, values, strict=True))
    order = sorted(range(len(found.ids)), key=found.ids.__getitem__)
    return [
        {"id": found.ids[k]} | {key: _rounded(finite(column[k])) for key, column in columns.items()}
        for k in order
    ]


def _rounded(value: float | None) -> float | int | None:
    if value is None:
        return None
    return int(value) if float(value).is_integer() else round(float(value), DIGITS)


def _pass_line(report: Report) -> str:
    left = sum(map(is_skipped, report.programs))
    skipped = f"; {left} questions to other programs skipped" if left else ""
    said = [_shell_line(report)] if report.shell else ["no shell in this export"]
    said += [_machine_line(report)] if report.prototype is not None else []
    return f"PASS: {'; '.join(said)}{skipped}"


def _shell_line(report: Report) -> str:
    found = report.findings
    return (
        f"{len(found.ids)} mirrors, {_cameras(found)} virtual cameras see "
        f"{report.target_mm:g} mm or more (facets {np.min(found.coverage_facet):.2f}, spheres "
        f"{np.min(found.coverage_fitted):.2f}); nothing blocked; centres within "
        f"{np.max(found.centre_error) * 1e3:.2f} and radii within "
        f"{np.max(found.radius_error) * 1e3:.2f} micrometres of the record"
    )


def _machine_line(report: Report) -> str:
    made = report.prototype or {}
    balls, stops = made["balls"], made["stops"]
    least = min(ball["coverage_mm"] for ball in balls)
    worst = max(ball["centre_error_um"] for ball in balls)
    return (
        f"prototype: {len(balls)} balls at {len(stops)} stops show {report.target_mm:g} mm or "
        f"more for every mirror ({least:.2f}); nothing blocked; pads hold the balls within "
        f"{worst:.2f} micrometres of the record"
    )


def _fail_line(report: Report) -> str:
    wrong = [check.name for check in (*report.checks, *report.programs) if check.passed is False]
    unsure = [check.name for check in (*report.checks, *report.programs) if check.passed is None]
    said = [
        f"{word}: {', '.join(dict.fromkeys(names))}"
        for word, names in (("failed", wrong), ("unknown", unsure))
        if names
    ]
    said = said if report.shell else ["no shell in this export", *said]
    return f"FAIL: {'; '.join([*_short_mirrors(report), *said])}"


def _short_mirrors(report: Report) -> list[str]:
    found = report.findings
    least = np.fmin(found.coverage_facet, found.coverage_fitted)
    _, first = np.unique(found.virtual, return_index=True)  # a halved mirror is named once
    short = first[least[first] < report.target_mm]
    if not short.size:
        return []
    worst = short[np.argsort(least[short], kind="stable")]
    named = [
        f"{found.ids[k]} sees {least[k]:.2f} mm, {report.target_mm - least[k]:.2f} short"
        for k in worst[:NAMED].tolist()
    ]
    return [
        f"{short.size} of {_cameras(found)} virtual cameras fall short of {report.target_mm:g} mm",
        *named,
    ]


def _cameras(found: Findings) -> int:
    return np.unique(found.virtual).size
