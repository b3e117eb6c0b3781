"""tbcad init: a design to change, and the designs that come with tbcad."""

import json
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.core.spec.load import load_spec, shipped_designs


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def refusal(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert run(["init", *words]) == 2
    shown = capsys.readouterr()
    assert (shown.out, shown.err.count("\n")) == ("", 1)
    return shown.err


def test_writes_the_papers_design() -> None:
    assert run(["init", "my.toml"]) == 0
    assert load_spec(Path("my.toml")) == load_spec(None)


def test_does_not_overwrite_unless_told_to(capsys: pytest.CaptureFixture[str]) -> None:
    Path("my.toml").write_text("mine", encoding="utf-8")
    assert "my.toml exists" in refusal(capsys, "my.toml")
    assert Path("my.toml").read_text(encoding="utf-8") == "mine"
    assert run(["init", "my.toml", "--force"]) == 0
    assert "[optics]" in Path("my.toml").read_text(encoding="utf-8")


def test_lists_the_designs(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", "--list"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("turtleback: The design of the paper")
    assert "mukaigawa-flat: " in text
    assert run(["init", "--list", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["designs"]) == len(shipped_designs())


def test_a_design_nearly_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["build", "afternon-print", "--dry-run"]) == 2
    assert "did you mean afternoon-print?" in capsys.readouterr().err


def test_a_file_is_preferred_to_a_design_of_its_name() -> None:
    Path("turtleback").write_text('name = "mine"', encoding="utf-8")
    assert load_spec(Path("turtleback")).name == "mine"
