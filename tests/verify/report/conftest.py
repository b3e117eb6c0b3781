"""The report of one good export, verified once; tests change copies of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tbcad_verify.report.as_made import AsMade, ProcessYield
from tbcad_verify.report.checks import Check, at_most
from tbcad_verify.report.methods import KEY_FIGURES
from tbcad_verify.report.report import Report
from tbcad_verify.run.verify import verify
from tbcad_verify.shell import integrity

from tests.verify.optical_setups import IN_PROCESS
from tests.verify.synthetic_export import Cells

YIELDS = (
    *(("diamond", 0.98, 60.04, 50), ("cnc", 0.7, 59.98, 10), ("sla", 0, 51.4, 5)),
    *(("fdm", 0, 42, 5), ("sls", 0, 0, 0)),
)


@pytest.fixture(scope="session")
def shell_report(synthetic_shells: tuple[Path, Cells]) -> Report:
    """Of shells only."""
    with pytest.MonkeyPatch.context() as meshes_alone:
        meshes_alone.setattr(integrity, "KINDS", {"stl": ".stl"})
        report = verify(synthetic_shells[0], options=replace(IN_PROCESS, write=False))
    return replace(report, folder=Path("exports"))


@pytest.fixture(scope="session")
def long_report(shell_report: Report) -> Report:
    """Of an export that has every key figure, with large figures and limits."""
    known = {check.name for check in shell_report.checks}
    files = ", ".join(f"part_{k}_of_the_prototype.stl" for k in range(12))
    more = tuple(
        Check(one.check, files, True, 1234.5678, 12345.678, "mm^3")
        for one in KEY_FIGURES
        if one.check not in known
    )
    more += tuple(at_most(("printable", f"{k}.stl", "problems"), 0, 0) for k in "ab")
    return replace(
        shell_report,
        checks=shell_report.checks + more,
        balls=16,
        seconds=1234.5,
        as_made=AsMade(
            50,
            tuple(ProcessYield(*one) for one in YIELDS),
            prototype=ProcessYield("fdm", 0.8, 59.91, 15),
        ),
        note="No prototype: " + "it reaches into the light, and there is no place for it; " * 3,
    )
