"""tbcad explain: terms, keys, columns and checks, and what is alike."""

import json
import pkgutil
from importlib import import_module
from pathlib import Path

import pytest
import tbcad_verify
from tbcad_verify.report.methods import method_of

from tbcad.app.cli import run

SAMPLE = Path(__file__).parents[3] / "docs" / "sample" / "verify.json"


def explain(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert run(["explain", *words]) == 0
    shown = capsys.readouterr()
    assert not shown.err
    assert "--json" in words or max(map(len, shown.out.splitlines())) <= 80
    return shown.out


def found(capsys: pytest.CaptureFixture[str], name: str) -> dict[str, dict[str, object]]:
    record = json.loads(explain(capsys, name, "--json"))
    assert record["schema"] == "tbcad-explain/1"
    return {f"{one['kind']} {one['name']}": one for one in record["found"]}


@pytest.mark.parametrize("name", ["theta1", "theta_1", "THETA1", "θ₁", "theta1_deg"])
def test_a_symbol(capsys: pytest.CaptureFixture[str], name: str) -> None:
    text = explain(capsys, name)
    for part in ("θ₁ = atan(", "rad", "eq. 1", "required_angles", "mirrors.csv"):
        assert part in text


@pytest.mark.parametrize("name", ["mirrors.margin_mm", "margin_mm"])
def test_a_key(capsys: pytest.CaptureFixture[str], name: str) -> None:
    key = found(capsys, name)["key mirrors.margin_mm"]
    assert (key["type"], key["default"], key["unit"]) == ("number", "0.6", "mm")
    assert key["allowed"] == "a number from 0 to 20"


def test_one_name_of_several_things(capsys: pytest.CaptureFixture[str]) -> None:
    assert set(found(capsys, "stage")) == {"term stage", "section prototype.stage"}
    assert set(found(capsys, "bolts")) == {
        "key shell.seam_flange.bolts",
        "key shell.foot_flange.bolts",
    }


@pytest.mark.parametrize("name", ["coverage, facets", "coverage facets"])
def test_a_check(capsys: pytest.CaptureFixture[str], name: str) -> None:
    check = found(capsys, name)["check coverage, facets"]
    assert "pinhole -> outline" in str(check["compares"])
    assert check["tolerance"] == "target"
    assert check["if it fails"]


def test_a_check_by_its_name_in_the_summary(capsys: pytest.CaptureFixture[str]) -> None:
    assert list(found(capsys, "mirrors off")) == ["check centre error"]


def every_check() -> set[str]:
    """Names of all checks, as the modules of the verification list them, and of the sample."""
    names = {check["name"] for check in json.loads(SAMPLE.read_text())["checks"]}
    for module in pkgutil.walk_packages(tbcad_verify.__path__, "tbcad_verify."):
        if not module.name.endswith("__main__"):
            checks = getattr(import_module(module.name), "CHECKS", ())
            names |= {one if isinstance(one, str) else one[0] for one in checks}
    return names


def test_every_check_is_known() -> None:
    assert len(every_check()) > 90
    assert {name for name in every_check() if method_of(name) is None} == set()


def test_alone_it_lists_what_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    text = explain(capsys)
    for part in ("θ₁", "[prototype.base]", "margin_mm", "coverage, facets"):
        assert part in text
    listed = json.loads(explain(capsys, "--json"))
    assert {"term", "section", "key", "check"} <= set(listed)
    for name in (*listed["term"], *listed["key"], *listed["check"])[::20]:
        assert found(capsys, name)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("mirrors.margn_mm", "mirrors.margin_mm"),
        ("coverage facet", "coverage, facets"),
        ("tetha1", "theta_1"),
        ("xyzzy", "tbcad explain lists what there is"),
        ("\N{SNOWMAN}\n", "tbcad explain lists what there is"),
        ("", "tbcad explain lists what there is"),
    ],
)
def test_an_unknown_name(capsys: pytest.CaptureFixture[str], name: str, hint: str) -> None:
    assert run(["explain", name]) == 2
    shown = capsys.readouterr()
    assert not shown.out
    assert shown.err.count("\n") == 1
    assert hint in shown.err
