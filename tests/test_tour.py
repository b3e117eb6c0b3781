"""The tour of the documentation: its commands print what the page shows."""

import os
import re
import subprocess
import sys
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.printed_lines import main, same

ROOT = Path(__file__).parents[1]
TOUR = ROOT / "docs" / "tour.md"
BLOCKS = re.compile(r"```sh\n(.*?)```(?:\n\n```text\n(.*?)```)?", re.DOTALL)
LEFT_OUT = "..."


class Step(NamedTuple):
    """A block of commands, the lines that the page shows of what they print, and the status."""

    commands: str
    shown: list[str]
    status: int


def steps() -> list[Step]:
    found = []
    for commands, shown in BLOCKS.findall(TOUR.read_text(encoding="utf-8")):
        status = re.search(r"# .*exit (\d)", commands)
        found.append(Step(commands, shown.splitlines(), int(status[1]) if status else 0))
    return found


@pytest.mark.slow
def test_commands_print_what_the_page_shows(tmp_path: Path) -> None:
    """Lines in their order; between those that the page leaves out there is nothing else."""
    assert {step.status for step in steps()} == {0, 1, 2}
    assert sum(bool(step.shown) for step in steps()) > 8
    tbcad = tmp_path / "bin" / "tbcad"
    tbcad.parent.mkdir()
    tbcad.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tbcad "$@"\n', encoding="utf-8")
    tbcad.chmod(0o755)
    places = os.pathsep.join([str(ROOT), str(ROOT / "verify")])
    path = f"{tbcad.parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "PYTHONPATH": places}
    for step in steps():
        done = subprocess.run(
            ["bash", "-c", step.commands],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        printed = done.stdout if step.status != 2 else done.stderr
        assert done.returncode == step.status, done.stderr
        assert follows(step.shown, printed.splitlines()), (step.shown, printed)


def follows(shown: list[str], printed: list[str]) -> bool:
    """Whether what is shown is what was printed, but for lines left out where it says so."""
    start = 0
    for left_out, group in groupby(shown, lambda line: line == LEFT_OUT):
        lines = list(group)
        if left_out:
            continue
        places = range(start, len(printed) - len(lines) + 1)
        found = [k for k in places if all(map(same, lines, printed[k : k + len(lines)]))]
        if not found:
            return False
        start = found[0] + len(lines)
    return True


def test_what_is_left_out_is_said() -> None:
    printed = ["a", "b", "c"]
    assert follows(["a", "b"], printed)
    assert follows(["a", LEFT_OUT, "c"], printed)
    assert not follows(["a", "c"], printed)
    assert not follows(["b", LEFT_OUT, "a"], printed)


def test_rounding_is_no_difference() -> None:
    for shown, printed, alike in (
        ("0.078 mm (median)", "0.079 mm  (median)", True),
        ("0.078 mm (median)", "0.080 mm (median)", False),
        ("1585 highlights", "1586 highlights", True),
        ("PASS: 193 cameras", "FAIL: 193 cameras", False),
        ("5 balls", "6 balls", False),
        ("off by 1.4e-07 mm", "off by 1.4e-06 mm", False),
    ):
        assert same(shown, printed) == alike


def test_files_are_compared_but_for_seconds(tmp_path: Path) -> None:
    shown, printed = tmp_path / "shown", tmp_path / "printed"
    shown.write_text("12 s; done\n5 balls\n", encoding="utf-8")
    for text, code in (("7 s; done\n5 balls\n", 0), ("7 s; done\n", 1), ("7 s\n6 balls\n", 1)):
        printed.write_text(text, encoding="utf-8")
        assert main(shown, printed) == code
