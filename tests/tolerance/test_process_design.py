"""tbcad build --for-process: the margin that a process needs, in the design that is built."""

import json
from pathlib import Path

import pytest

from tbcad.cli import run
from tbcad.errors import InputError
from tbcad.mirrors.array import design
from tbcad.simulate.scene.reflector import reflectors
from tbcad.spec.load import load_spec
from tbcad.tolerance import margin as margin_module
from tbcad.tolerance.margin import spec_for_process
from tbcad.tolerance.montecarlo.builds import MonteCarloCase, simulate
from tbcad.tolerance.montecarlo.edge_model import edge_models
from tbcad.tolerance.process.process import load_process, process_errors

SMALL = ["n=4", "mirrors.margin_mm=0"]
BUILDS = 60


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(margin_module, "BUILDS", BUILDS)


def test_the_margin_is_enough_and_a_little_less_is_not() -> None:
    process, wanted = load_process("cnc"), 0.9
    spec = spec_for_process(load_spec(None, SMALL), process, wanted)
    found = spec.mirrors.margin_mm
    assert found > 0
    shares = []
    for margin in (found, found - 0.03):
        tried = load_spec(None, ["n=4", f"mirrors.margin_mm={margin}"])
        models = edge_models(reflectors(design(tried)))
        worst = simulate(
            MonteCarloCase(models, process_errors(process), margin_module.SEED), BUILDS
        ).worst
        shares.append((worst >= 60).mean())
    assert shares[0] >= wanted > shares[1]


def test_a_looser_process_needs_more() -> None:
    spec = load_spec(None, SMALL)
    margins = [
        spec_for_process(spec, load_process(name), 0.9).mirrors.margin_mm
        for name in ("diamond", "cnc", "sla")
    ]
    assert margins == sorted(margins)
    assert margins[0] < margins[2]


@pytest.mark.parametrize(
    ("settings", "wanted", "wrong"),
    [([], 1.0, "--yield 1"), ([], 0.0, "--yield 0"), (["radius_rule=paper"], 0.9, "rule paper")],
)
def test_what_cannot_be_asked(settings: list[str], wanted: float, wrong: str) -> None:
    with pytest.raises(InputError, match=wrong):
        spec_for_process(load_spec(None, [*SMALL, *settings]), load_process("cnc"), wanted)


def test_a_process_for_which_there_is_no_margin() -> None:
    rough = load_process("fdm", ["sphere_centre_um=2000"])
    with pytest.raises(InputError, match="with any margin"):
        spec_for_process(load_spec(None, SMALL), rough, 0.9)


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "exports"
    arguments = ["build", "--n", "4", "--parts", "shell", "--no-verify", "--out", str(out)]
    assert run([*arguments, "--for-process", "diamond", "--yield", "0.9"]) == 0
    margin = json.loads((out / "design.json").read_text())["spec"]["mirrors"]["margin_mm"]
    said = capsys.readouterr().err
    assert f"margin {margin:g} mm, for 90.0% by diamond" in said
    assert run([*arguments, "--for-process", "clay"]) == 2
    assert "clay" in capsys.readouterr().err
