"""Shells with mirrors on pedestals, in a CAD program and in a slicer."""

from pathlib import Path

import pytest
from tbcad_verify.programs import check_with_programs, is_skipped
from tbcad_verify.report.checks import Check

from tbcad.app.cli import run
from tests.clients.test_programs import PROGRAMS, wanted

pytestmark = [pytest.mark.clients, pytest.mark.slow]


def checked(out: Path, *settings: str) -> list[Check]:
    """What programs say of both halves on pedestals."""
    build = ["build", "--parts", "shell", "--set", "shell.edges=pedestal", "--no-verify"]
    assert run([*build, *settings, "--out", str(out)]) == 0
    parts = wanted(out, 5e-3)
    assert [part.name for part in parts] == ["shell_a", "shell_b"]
    return list(check_with_programs(out, parts))


@pytest.fixture(scope="module")
def checks(tmp_path_factory: pytest.TempPathFactory) -> list[Check]:
    """Of the paper's design."""
    return checked(tmp_path_factory.mktemp("clients") / "exports")


@pytest.mark.parametrize("program", ["freecad", "gmsh", "admesh"])
def test_each_program_takes_both_halves(checks: list[Check], program: str) -> None:
    mine = [check for check in checks if check.name.split()[0] == program]
    if all(map(is_skipped, mine)):
        pytest.skip(mine[0].detail)
    names = [f"{program} {question}" for question in PROGRAMS[program]]
    assert [check.name for check in mine] == 2 * names
    for check in mine:
        assert check.passed is True, check


def test_the_slicer_takes_both_halves(checks: list[Check]) -> None:
    mine = [check for check in checks if check.name.startswith("prusa")]
    if all(map(is_skipped, mine)):
        pytest.skip(mine[0].detail)
    assert sum(check.name == "prusa slices" for check in mine) == 2
    assert [check for check in mine if check.passed is not True] == []
