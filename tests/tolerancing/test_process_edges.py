"""tbcad build --for-process: the edges that leave most pixels with the margins of a process."""

from collections.abc import Sequence

import pytest

from tbcad.core.spec.load import load_spec, spec_dict
from tbcad.errors import InputError
from tbcad.tolerancing import process_design as process_module
from tbcad.tolerancing.margin import SeeingPixels, seeing_pixels
from tbcad.tolerancing.process.process import Process, load_process
from tbcad.tolerancing.process_design import (
    ProcessDesign,
    design_for_process,
    edges_for_process,
    edges_text,
)

SMALL = ["n=4", "mirrors.margin_mm=0"]
WANTED = 0.9
# Mirrors set one by one, each smooth: what one of them is off should cost its neighbours nothing.
INSERTS = ["sphere_centre_um=60", "sphere_radius_um=60", "waviness_um=0.1", "groove_wall_um=1"]


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_module, "BUILDS", 60)


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


@pytest.mark.parametrize("edges", ["valley", "pedestal"])
def test_edges_that_the_design_names_stay(edges: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        process_module, "design_for_process", lambda spec, *_: ProcessDesign(spec, 0.0)
    )
    monkeypatch.setattr(process_module, "seeing_pixels", lambda _: SeeingPixels(1000, 100))
    process = {"valley": inserts(), "pedestal": load_process("diamond")}[edges]
    choice = edges_for_process(load_spec(None, named(edges)), process, WANTED)
    assert (choice.made.spec.shell.edges, choice.other) == (edges, None)
    assert choice.pixels == SeeingPixels(1000, 100)
    assert edges_text(choice) == f"edges: {edges}, as the design says"


@pytest.mark.parametrize(
    ("more", "taken"), [(1.0, "valley"), (1.009, "valley"), (1.01, "pedestal")]
)
def test_pedestals_must_leave_a_per_cent_more(
    monkeypatch: pytest.MonkeyPatch, more: float, taken: str
) -> None:
    def pixels(spec):  # type: ignore[no-untyped-def]
        return SeeingPixels(1000 * (more if spec.shell.edges == "pedestal" else 1.0), 100)

    monkeypatch.setattr(process_module, "seeing_pixels", pixels)
    monkeypatch.setattr(
        process_module, "design_for_process", lambda spec, *_: ProcessDesign(spec, 0.0)
    )
    choice = edges_for_process(load_spec(None, SMALL), inserts(), WANTED)
    assert choice.made.spec.shell.edges == taken


def test_one_kind_without_margins_leaves_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    def search(spec, *rest):  # type: ignore[no-untyped-def]
        if spec.shell.edges in impossible:
            raise InputError(f"no {spec.shell.edges}")
        return ProcessDesign(spec, 0.0)

    monkeypatch.setattr(process_module, "design_for_process", search)
    spec = load_spec(None, SMALL)
    impossible: Sequence[str] = ("valley",)
    choice = edges_for_process(spec, inserts(), WANTED)
    assert choice.made.spec.shell.edges == "pedestal"
    assert edges_text(choice).endswith("; valley: no margin is enough")
    impossible = ("valley", "pedestal")
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


def test_what_cannot_be_asked_is_refused_before_anything_is_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(process_module, "seeing_pixels", lambda _: pytest.fail("tried"))
    with pytest.raises(InputError, match="rule paper"):
        edges_for_process(load_spec(None, [*SMALL, "radius_rule=paper"]), inserts(), WANTED)
