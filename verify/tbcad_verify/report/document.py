"""The summary of a verification for other programs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from tbcad_verify.report.checks import Check
from tbcad_verify.report.key_figures import key_figures
from tbcad_verify.report.paper import changed_files
from tbcad_verify.report.remedies import remedy

if TYPE_CHECKING:
    from tbcad_verify.report.report import Report

SCHEMA = "tbcad-verify-summary/1"


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
    processes = [
        {"process": one.process, "yield": one.share, "coverage_mm": one.coverage_mm}
        for one in as_made.processes
    ]
    return {"builds": as_made.builds, "processes": processes, "reason": as_made.reason or None}
