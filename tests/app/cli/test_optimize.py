"""tbcad optimize: its files, its refusals, and that it goes on where it was stopped."""

import json
import tomllib
from pathlib import Path

import pytest

import tbcad
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import load_spec, shipped_designs
from tbcad.errors import InputError
from tbcad.optimizing import search as search_module
from tbcad.optimizing.candidate import DesignCandidate, Figures, MachineLimits, Place
from tests.app.cli.commands import Command
from tests.exported_files import read_csv


def closed_form(
    spec: Spec, ssim_within: MachineLimits | None, place: Place, **_: str
) -> DesignCandidate:
    """More pixels with a larger ellipsoid, in place of mirrors, which take long."""
    axis = place[2]
    return DesignCandidate(place, Figures(axis, 2 * axis, axis / 100, 100 / axis, 276, 89))


@pytest.fixture(autouse=True)
def quick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(search_module, "evaluate", closed_form)


WORDS = ("optimize", "--set", "n=4", "--candidates", "80", "--out", "found/better.toml")


def test_design_table_and_plot(cli: Command) -> None:
    printed, folder = cli(*WORDS).out, Path("found")
    names = {"better.toml", "better-candidates.csv", "better-candidates.jsonl", "better.svg"}
    assert {file.name for file in folder.iterdir()} == names
    table = tomllib.loads((folder / "better.toml").read_text(encoding="utf-8"))
    rows = read_csv(folder / "better-candidates.csv")
    best = max(float(row["semi_minor_mm"]) for row in rows)
    assert table["optics"]["semi_minor_mm"] == best > 100
    assert float(rows[0]["semi_minor_mm"]) == 100
    assert "pixels, minimum                    100" in printed
    assert len(printed.splitlines()) <= 12


def test_json(cli: Command) -> None:
    result = json.loads(cli(*WORDS, "--json", "--for", "minimum").out)
    assert result["before"]["place"] == [100, -100, 100, 1, 1]
    assert result["after"]["figures"]["minimum_px"] > 100
    assert result["after"] in result["front"]


def test_in_python(tmp_path: Path) -> None:
    out = tmp_path / "found" / "better.toml"
    asked = {"settings": ["n=4"], "out": out, "candidates": 80}
    result = tbcad.optimize(objectives=("minimum",), **asked)  # type: ignore[call-overload]
    assert result.best.figures.minimum_px > result.start.figures.minimum_px == 100
    assert tbcad.load_spec(out).optics.semi_minor_mm == result.best.place[2]
    again = tbcad.optimize(tbcad.load_spec(out), out=tmp_path / "more.toml", candidates=80)
    assert again.start.place == result.best.place
    with pytest.raises(InputError, match=r"better\.toml exists"):
        tbcad.optimize(**asked)  # type: ignore[call-overload]
    with pytest.raises(InputError, match="design is 3, allowed is a spec, a design file"):
        tbcad.optimize(3)  # type: ignore[call-overload]
    with pytest.raises(InputError, match="candidates is 3, allowed is a whole number from 80"):
        tbcad.optimize(candidates=3)


def test_a_search_that_was_stopped_goes_on(monkeypatch: pytest.MonkeyPatch, cli: Command) -> None:
    def stopped(
        spec: Spec, ssim_within: MachineLimits | None, place: Place, **_: str
    ) -> DesignCandidate:
        if place[2] > 130:
            raise KeyboardInterrupt
        return closed_form(spec, ssim_within, place)

    monkeypatch.setattr(search_module, "evaluate", stopped)
    cli(*WORDS, code=130)
    monkeypatch.setattr(search_module, "evaluate", closed_form)
    said = cli(*WORDS, code=2).err
    assert "go on with --resume, or begin anew with --force" in said
    cli(*WORDS, "--resume")


def test_init_writes_the_papers_design(cli: Command) -> None:
    Path("my.toml").write_text("mine", encoding="utf-8")
    cli("init", "my.toml", "--force")
    assert load_spec(Path("my.toml")) == load_spec(None)


def test_lists_the_designs(cli: Command) -> None:
    text = cli("init", "--list").out
    assert text.startswith("turtleback: The design of the paper")
    assert "mukaigawa-flat: " in text
    listed = json.loads(cli("init", "--list", "--json").out)
    assert len(listed["designs"]) == len(shipped_designs())


def test_a_file_is_preferred_to_a_design_of_its_name() -> None:
    Path("turtleback").write_text('name = "mine"', encoding="utf-8")
    assert load_spec(Path("turtleback")).name == "mine"
