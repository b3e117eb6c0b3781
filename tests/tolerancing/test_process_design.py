"""tbcad build --process: the margins that a process needs, in the design that is built."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec, spec_dict
from tbcad.errors import InputError
from tbcad.light.simulate.capture.photograph import virtual_camera_pixels
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing import process_design as process_module
from tbcad.tolerancing.margin import OwnMargins, SeeingPixels, seeing_pixels
from tbcad.tolerancing.montecarlo.builds import MonteCarloCase, simulate
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.process.process import Process, load_process, process_errors
from tbcad.tolerancing.process_design import (
    ProcessDesign,
    costs_text,
    design_for_process,
    edges_for_process,
    edges_text,
    margins_text,
    pixel_costs,
    ssim_costs,
    ssim_text,
)

pytestmark = pytest.mark.usefixtures("standing")

SMALL = ["n=4", "mirrors.margin_mm=0"]
BUILDS = 60
WANTED = 0.9
# Mirrors set one by one, each smooth: what one of them is off should cost its neighbours nothing.
INSERTS = ["sphere_centre_um=60", "sphere_radius_um=60", "waviness_um=0.1", "groove_wall_um=1"]


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_module, "BUILDS", BUILDS)


def test_own_margins_where_they_are_smaller() -> None:
    """At the same yield, and with more pixels that see the object."""
    spec, process, wanted = load_spec(None, ["n=4", "margin_mm=0"]), load_process("cnc"), 0.9
    made = design_for_process(spec, process, wanted)
    own = made.spec.mirrors.own_margins_mm
    assert not made.is_even
    assert made.spec.mirrors.margin_mm == 0
    assert min(own) < made.even_mm < max(own)
    models = edge_models(reflectors(design(made.spec)))
    case = MonteCarloCase(models, process_errors(process), process_module.SEED)
    assert (simulate(case, BUILDS).worst >= 60).mean() >= wanted
    even, best = (
        virtual_camera_pixels(design(one).arrays[0], 30.0).sum()
        for one in (load_spec(None, ["n=4", f"margin_mm={made.even_mm}"]), made.spec)
    )
    assert best > even


def test_margins_stay_where_others_gain_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """One for all, or those that there are; margins of single mirrors are computed anew."""
    found = OwnMargins(np.full(49, 5.0), 5.0, 1.0)
    monkeypatch.setattr(process_module, "own_margins", lambda *_: found)
    made = design_for_process(load_spec(None, SMALL), load_process("cnc"), 0.9)
    assert made.is_even
    assert made.spec.mirrors.margin_mm == made.even_mm < 5
    spec = load_spec(None, ["n=4", "margin_mm=1.5", f"own_margins_mm={[1.6] * 49}"])
    made = design_for_process(spec, load_process("diamond"), 0.9)
    assert (made.spec.mirrors.margin_mm, made.spec.mirrors.own_margins_mm) == (1.5, ())


def test_what_margins_cost() -> None:
    """A mirror's pixels are shared by the object and what its margin shows around it."""
    spec = load_spec(None, ["n=5", "margin_mm=3"])
    costs = pixel_costs(ProcessDesign(spec, 3.0))
    assert list(costs) == ["with these margins", "with none"]
    ratio = costs["with these margins"].median / costs["with none"].median
    assert ratio == pytest.approx((60 / 63) ** 2, abs=0.01)
    half = design(spec).arrays[0]
    each = virtual_camera_pixels(half, 30.0)
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
    [
        ([], 1.0, "--yield 1"),
        ([], 0.0, "--yield 0"),
        (["radius_rule=paper"], 0.9, "rule paper"),
        ([], 0.9, "with any margin"),
    ],
)
def test_what_cannot_be_asked(settings: list[str], wanted: float, wrong: str) -> None:
    rough = load_process("fdm", ["sphere_centre_um=2000"])
    for search in (design_for_process, edges_for_process):
        with pytest.raises(InputError, match=wrong):
            search(load_spec(None, [*SMALL, "shell.edges=valley", *settings]), rough, wanted)


@pytest.mark.slow
def test_command(tmp_path: Path, cli: Callable[..., Any]) -> None:
    """The edges are chosen; the design in the record gives the same mirrors without the process."""
    out, again = tmp_path / "exports", tmp_path / "again"
    build = ["build", "--n", "4", "--parts", "shell", "--no-verify"]
    build += ["--set", "width_px=416", "--set", "height_px=310"]
    asked = [*build, "--out", out, "--set", "margin_mm=0.2"]
    said = cli(*asked, "--process", "cnc", "--yield", "0.9").err
    spec = json.loads((out / "design.json").read_text())["spec"]
    mirrors, edges = spec["mirrors"], spec["shell"]["edges"]
    options = [f"mirrors.{key}={mirrors[key]}" for key in ("margin_mm", "own_margins_mm")]
    made = ProcessDesign(load_spec(None, ["n=4", *options]), 0.0)
    assert margins_text(made).partition(" (")[0] in said
    assert ", for 90.0% by cnc" in said
    assert f"edges: {edges}, with a median of " in said
    words = [word for option in (*options, f"shell.edges={edges}") for word in ("--set", option)]
    cli(*build, "--out", again, *words)
    for name in ("mirrors.csv", "shell_a.stl"):
        assert (again / name).read_bytes() == (out / name).read_bytes()
    assert "clay" in cli(*asked, "--process", "clay", code=2).err


def inserts() -> Process:
    return load_process("cnc", INSERTS)


def named(edges: str) -> list[str]:
    return [*SMALL, f"shell.edges={edges}"]


@pytest.mark.slow
def test_pedestals_where_mirrors_err_by_themselves() -> None:
    choice = edges_for_process(load_spec(None, SMALL), inserts(), WANTED)
    valley, pedestal = (
        design_for_process(load_spec(None, named(edges)), inserts(), WANTED)
        for edges in ("valley", "pedestal")
    )
    assert spec_dict(choice.made.spec) == spec_dict(pedestal.spec)
    assert choice.pixels == seeing_pixels(pedestal.spec)
    assert choice.other is not None
    assert (choice.other.edges, choice.other.pixels) == ("valley", seeing_pixels(valley.spec))
    assert choice.pixels.median > 1.05 * seeing_pixels(valley.spec).median


@pytest.mark.slow
def test_valleys_where_pedestals_cannot_leave_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """No margins are searched for that could change nothing; those that there are leave less."""
    process, searched = load_process("diamond"), []

    def search(spec, *rest):  # type: ignore[no-untyped-def]
        searched.append(spec.shell.edges)
        return design_for_process(spec, *rest)

    monkeypatch.setattr(process_module, "design_for_process", search)
    choice = edges_for_process(load_spec(None, SMALL), process, WANTED)
    assert searched == [choice.made.spec.shell.edges] == ["valley"]
    assert choice.other is not None
    assert choice.other.made is None
    assert choice.other.pixels is not None
    assert choice.other.pixels.median <= choice.pixels.median
    pedestal = design_for_process(load_spec(None, named("pedestal")), process, WANTED)
    assert seeing_pixels(pedestal.spec).median <= choice.other.pixels.median


def made_up(monkeypatch: pytest.MonkeyPatch, gain: float, impossible: Sequence[str] = ()) -> None:
    """Pixels without mirrors: those of pedestals are so many times those of valleys."""

    def search(spec, *_):  # type: ignore[no-untyped-def]
        if spec.shell.edges in impossible:
            raise InputError(f"no {spec.shell.edges}")
        return ProcessDesign(spec, 0.0)

    def pixels(spec):  # type: ignore[no-untyped-def]
        return SeeingPixels(1000 * (gain if spec.shell.edges == "pedestal" else 1.0), 100)

    monkeypatch.setattr(process_module, "design_for_process", search)
    monkeypatch.setattr(process_module, "seeing_pixels", pixels)


def test_edges_of_the_design_stay_and_pedestals_must_leave_a_per_cent_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for options, gain, edges, other in (
        (named("valley"), 2.0, "valley", None),
        (named("pedestal"), 0.5, "pedestal", None),
        (SMALL, 1.009, "valley", "pedestal"),
        (SMALL, 1.01, "pedestal", "valley"),
    ):
        made_up(monkeypatch, gain)
        choice = edges_for_process(load_spec(None, options), inserts(), WANTED)
        assert choice.made.spec.shell.edges == edges
        assert (choice.other and choice.other.edges) == other
        assert edges_text(choice).startswith(f"edges: {edges}, ")


def test_one_kind_without_margins_leaves_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = load_spec(None, SMALL)
    made_up(monkeypatch, 1.0, ["valley"])
    choice = edges_for_process(spec, inserts(), WANTED)
    assert choice.made.spec.shell.edges == "pedestal"
    assert edges_text(choice).endswith("; valley: no margin is enough")
    made_up(monkeypatch, 1.0, ["valley", "pedestal"])
    with pytest.raises(InputError, match="no valley"):
        edges_for_process(spec, inserts(), WANTED)


def test_pedestals_that_cannot_be_made_are_not_taken() -> None:
    """A coat thicker than the grooves fills them."""
    spec = load_spec(None, [*SMALL, "mirrors.coating_um=200", "shell.groove_mm=0.02"])
    choice = edges_for_process(spec, load_process("diamond"), WANTED)
    assert choice.made.spec.shell.edges == "valley"
    assert choice.other is not None
    assert "coat thinner or shell.groove_mm larger" in str(choice.other.error)
    assert edges_text(choice).endswith("; pedestal: cannot be made")
