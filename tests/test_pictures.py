"""Each picture of the documentation has a command, and is known to be as old as what it shows."""

import re
import shlex
from pathlib import Path
from types import ModuleType

import pytest

from tbcad.report.prototype_pictures import SIDES
from tests.app.cli.commands import commands
from tests.docs_scripts import DOCS, docs_script

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def ages() -> ModuleType:
    return docs_script("picture_ages")


def test_every_picture_has_a_command_and_a_page(ages: ModuleType) -> None:
    """And no command is left of a picture that is gone."""
    files = {file.stem for file in ages.PICTURES.glob("[!.]*")}
    assert files == set(ages.rows())
    pages = [ROOT / "README.md", *DOCS.glob("*.md")]
    shown = {
        Path(found).stem
        for page in pages
        for found in re.findall(r"pictures/([\w.-]+)\)", page.read_text(encoding="utf-8"))
    }
    assert files - shown <= {"shell"}  # a part of overview.png


def test_commands_are_those_of_tbcad_or_programs_that_are_there(ages: ModuleType) -> None:
    known = commands()
    for name, row in ages.rows().items():
        for command in row["by"].split(" && "):
            match shlex.split(command):
                case ["tbcad", *words]:
                    assert tuple(words[:1]) in known or tuple(words[:2]) in known, name
                case ["python", program, *_]:
                    assert (ROOT / program).is_file(), name
                case [program, *_]:
                    assert program in ("xvfb-run", "cp", "pdftoppm", "pdftocairo"), name
                case _:
                    pytest.fail(name)


def test_every_picture_is_noted_or_said_to_be_old(ages: ModuleType) -> None:
    noted = ages.noted()
    assert set(noted) <= set(ages.rows())
    for name, row in ages.rows().items():
        assert set(row["shows"]) <= set(ages.SHOWN), name
        assert row.get("old") or noted.get(name, {}).keys() == set(row["shows"]), name


def test_a_picture_of_another_state_is_old(
    ages: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where something moved that it shows, and not where another thing did."""
    monkeypatch.setattr(ages, "NOTED", tmp_path / "noted.json")
    (tmp_path / "noted.json").write_text("{}")
    now = {what: ages.digest([what]) for what in ages.SHOWN}
    told = ages.rows()
    ages.note(told, now)
    assert ages.old_pictures(now) == {}
    moved = now | {"machine": ages.digest(["a foot 2 mm to the side"])}
    expected = {name for name, row in told.items() if "machine" in row["shows"]}
    assert {"rig", "sides", "base"} <= expected
    assert set(ages.old_pictures(moved)) == expected


def test_the_four_sides_differ() -> None:
    """The machine is nearly its own image in y: left and right would show the same."""
    looks = {tuple(abs(x) if axis == 1 else x for axis, x in enumerate(eye)) for _, eye, _ in SIDES}
    assert len(looks) == len(SIDES) == 4
