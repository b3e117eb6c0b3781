"""tbcad build --for-process: the margins that a process needs, in the design that is built."""

import json
from pathlib import Path

import numpy as np
import pytest

from tbcad.app.cli import run
from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing import process_design as process_module
from tbcad.tolerancing.margin import OwnMargins, pixels_of_cameras
from tbcad.tolerancing.montecarlo.builds import MonteCarloCase, simulate
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.process.process import load_process, process_errors
from tbcad.tolerancing.process_design import (
    ProcessDesign,
    costs_text,
    design_for_process,
    margins_text,
    pixel_costs,
    ssim_costs,
    ssim_text,
)

SMALL = ["n=4", "mirrors.margin_mm=0"]
BUILDS = 60


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_module, "BUILDS", BUILDS)


def without_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_module, "own_margins", lambda *_: None)


def test_the_margin_is_enough_and_a_little_less_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    without_own(monkeypatch)
    process, wanted = load_process("cnc"), 0.9
    made = design_for_process(load_spec(None, SMALL), process, wanted)
    found = made.spec.mirrors.margin_mm
    assert made.is_even
    assert found == made.even_mm > 0
    shares = []
    for margin in (found, found - 0.03):
        tried = load_spec(None, ["n=4", f"mirrors.margin_mm={margin}"])
        models = edge_models(reflectors(design(tried)))
        worst = simulate(
            MonteCarloCase(models, process_errors(process), process_module.SEED), BUILDS
        ).worst
        shares.append((worst >= 60).mean())
    assert shares[0] >= wanted > shares[1]


def test_own_margins_where_they_are_smaller() -> None:
    """At the same yield, and with more pixels that see the object."""
    spec, process, wanted = load_spec(None, ["n=6", "margin_mm=0"]), load_process("cnc"), 0.9
    made = design_for_process(spec, process, wanted)
    own = made.spec.mirrors.own_margins_mm
    assert not made.is_even
    assert made.spec.mirrors.margin_mm == 0
    assert min(own) < made.even_mm < max(own)
    models = edge_models(reflectors(design(made.spec)))
    case = MonteCarloCase(models, process_errors(process), process_module.SEED)
    assert (simulate(case, BUILDS).worst >= 60).mean() >= wanted
    even, best = (
        pixels_of_cameras(design(one).arrays[0], 30.0).sum()
        for one in (load_spec(None, ["n=6", f"margin_mm={made.even_mm}"]), made.spec)
    )
    assert best > even


def test_one_margin_where_own_ones_gain_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    found = OwnMargins(np.full(49, 5.0), 5.0, 1.0)
    monkeypatch.setattr(process_module, "own_margins", lambda *_: found)
    made = design_for_process(load_spec(None, SMALL), load_process("cnc"), 0.9)
    assert made.is_even
    assert made.spec.mirrors.margin_mm == made.even_mm < 5


def test_a_margin_that_is_enough_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    """Facets need some, too: nothing is taken away. Margins of single mirrors are computed anew."""
    without_own(monkeypatch)
    spec = load_spec(None, ["n=4", "margin_mm=1.5", f"own_margins_mm={[1.6] * 49}"])
    made = design_for_process(spec, load_process("diamond"), 0.9)
    assert (made.spec.mirrors.margin_mm, made.spec.mirrors.own_margins_mm) == (1.5, ())


def test_what_margins_cost() -> None:
    """A mirror's pixels are shared by the object and what its margin shows around it."""
    spec = load_spec(None, ["n=8", "margin_mm=3"])
    costs = pixel_costs(ProcessDesign(spec, 3.0))
    assert list(costs) == ["with these margins", "with none"]
    ratio = costs["with these margins"].median / costs["with none"].median
    assert ratio == pytest.approx((60 / 63) ** 2, abs=0.01)
    half = design(spec).arrays[0]
    each = pixels_of_cameras(half, 30.0)
    assert costs["with these margins"].minimum == each.min()
    assert len(each) == 2 * len(half) - (half.u[:, 0] == 0).sum()
    assert costs_text(costs).count("minimum") == 2


@pytest.mark.slow
def test_what_margins_cost_in_views() -> None:
    """Many more pixels lost, worse views; what is said are the figures."""
    sensor = ["n=6", "camera.width_px=832", "camera.height_px=620"]
    costs = ssim_costs(ProcessDesign(load_spec(None, [*sensor, "margin_mm=18"]), 18.0))
    assert list(costs) == ["with these margins", "with none"]
    assert 0.3 < costs["with these margins"] < costs["with none"] < 1
    assert ssim_text(costs).count(f"{costs['with none']:.3f} with none") == 1


@pytest.mark.parametrize(
    ("settings", "wanted", "wrong"),
    [([], 1.0, "--yield 1"), ([], 0.0, "--yield 0"), (["radius_rule=paper"], 0.9, "rule paper")],
)
def test_what_cannot_be_asked(settings: list[str], wanted: float, wrong: str) -> None:
    with pytest.raises(InputError, match=wrong):
        design_for_process(load_spec(None, [*SMALL, *settings]), load_process("cnc"), wanted)


def test_a_process_for_which_there_is_no_margin() -> None:
    rough = load_process("fdm", ["sphere_centre_um=2000"])
    with pytest.raises(InputError, match="with any margin"):
        design_for_process(load_spec(None, SMALL), rough, 0.9)


@pytest.mark.slow
def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The edges are chosen; the design in the record gives the same mirrors without the process."""
    out = tmp_path / "exports"
    arguments = ["build", "--n", "4", "--parts", "shell", "--no-verify"]
    arguments += ["--set", "width_px=416", "--set", "height_px=310", "--out", str(out)]
    arguments += ["--set", "margin_mm=0.2"]
    assert run([*arguments, "--for-process", "cnc", "--yield", "0.9"]) == 0
    spec = json.loads((out / "design.json").read_text())["spec"]
    mirrors, edges = spec["mirrors"], spec["shell"]["edges"]
    made = ProcessDesign(load_spec(None, ["n=4", *options_of(mirrors)]), 0.0)
    said = capsys.readouterr().err
    assert margins_text(made).partition(" (")[0] in said
    assert ", for 90.0% by cnc" in said
    assert f"edges: {edges}, with a median of " in said
    assert "pixels of a virtual camera that see the object" in said
    again = tmp_path / "again"
    options = [*options_of(mirrors), f"shell.edges={edges}"]
    words = [word for option in options for word in ("--set", option)]
    assert run([*arguments[:-4], "--out", str(again), *words]) == 0
    for name in ("mirrors.csv", "shell_a.stl"):
        assert (again / name).read_bytes() == (out / name).read_bytes()
    assert run([*arguments, "--for-process", "clay"]) == 2
    assert "clay" in capsys.readouterr().err


def options_of(mirrors: dict[str, object]) -> list[str]:
    return [f"mirrors.{key}={mirrors[key]}" for key in ("margin_mm", "own_margins_mm")]
