"""The search, with candidates whose figures are a closed form: the mirrors themselves take long."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tbcad.errors import InputError
from tbcad.optimize import search as search_module
from tbcad.optimize.candidate import STEP_MM, Candidate, Figures, Place
from tbcad.optimize.files import design_text, search_files
from tbcad.optimize.search import (
    Search,
    SearchResult,
    _front,
    parse_objectives,
    search,
)
from tbcad.spec.design import Spec
from tbcad.spec.load import load_spec

SPEC = load_spec(None, ["n=4", "shell.wall_mm=4"])
BEST = (123.0, -140.0, 111.5)


def closed_form(spec: Spec, place: Place) -> Candidate:
    """Pixels are most at BEST; the machine grows with x; there is none with a small axis."""
    if place[2] < 60:
        return Candidate(place, None, "the ellipsoid is too small: enlarge it")
    off = float(np.linalg.norm(np.subtract(place, BEST)))
    size = 3 * place[0]
    return Candidate(place, Figures(1000 - off, 2000 - off, 7 - off / 100, 1 + off, size, 89.0))


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search_module, "evaluate", closed_form)


def asked(budget: int = 720, size_mm: float | None = 400.0) -> Search:
    return Search(SPEC, ("minimum", "evenness"), budget, size_mm)


def test_the_best_place_is_found() -> None:
    best = search(asked()).best
    assert np.abs(np.subtract(best.place, BEST)).max() <= 2 * STEP_MM


def test_limits_hold() -> None:
    """By default the machine may be no larger than the first one: x stays at 100."""
    result = search(asked(size_mm=None))
    assert result.limits.size_mm == 300
    assert result.best.figures is not None
    assert result.best.figures.size_mm <= 300
    assert np.abs(np.subtract(result.best.place, (100, *BEST[1:]))).max() <= 2 * STEP_MM
    kept = [one for one, on in zip(result.candidates, result.on_front, strict=True) if on]
    assert all(one.figures and one.figures.size_mm <= 300 for one in kept)


def test_the_start_where_none_is_better() -> None:
    spec = load_spec(None, ["n=4", "camera_mm=[123, 0, -140]", "semi_minor_mm=111.5"])
    result = search(Search(spec, ("minimum",), 48))
    assert result.best == result.start


def test_a_search_that_was_stopped_ends_like_one_that_was_not(tmp_path: Path) -> None:
    whole, parted = tmp_path / "whole.jsonl", tmp_path / "parted.jsonl"
    expected = search(asked(240), whole)
    search(asked(96), parted)
    assert parted.read_bytes() != whole.read_bytes()
    assert search(asked(240), parted) == expected
    assert parted.read_bytes() == whole.read_bytes()
    assert search_files(expected, SPEC, Path("x.toml")) == search_files(
        search(asked(240)), SPEC, Path("x.toml")
    )


def test_judgements_are_not_made_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = search(asked(96), tmp_path / "store.jsonl")

    def never(spec: Spec, place: Place) -> Candidate:
        raise AssertionError(place)

    monkeypatch.setattr(search_module, "evaluate", never)
    assert search(asked(96), tmp_path / "store.jsonl") == expected


def test_a_store_of_another_design_is_refused(tmp_path: Path) -> None:
    store = tmp_path / "store.jsonl"
    search(asked(48), store)
    before = store.read_bytes()
    other = Search(load_spec(None, ["n=5"]), ("minimum",), 48)
    with pytest.raises(InputError, match="another design"):
        search(other, store)
    assert store.read_bytes() == before


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]\n", '{"design": 1}\n{"place": 1}\n', '{"design": 1}\n{"place": [1, 2]}\n'],
)
def test_a_broken_store_is_refused(tmp_path: Path, text: str) -> None:
    store = tmp_path / "store.jsonl"
    store.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"store.jsonl: (no list of candidates|of another)"):
        search(asked(48), store)


def test_a_first_design_that_cannot_be_made() -> None:
    spec = load_spec(None, ["n=4", "capture_diameter_mm=10", "semi_minor_mm=50"])
    with pytest.raises(InputError, match="cannot be made: the ellipsoid is too small"):
        search(Search(spec, ("size",), 48))


def test_objectives_by_name() -> None:
    assert parse_objectives(["size", "minimum", "size"]) == ("minimum", "size")
    with pytest.raises(InputError, match="--for is 'ssim', allowed is one of minimum, pixels"):
        parse_objectives(["ssim"])


@given(arrays(float, st.tuples(st.integers(1, 8), st.integers(1, 3)), elements=st.floats(-2, 2)))
def test_front_against_brute_force(losses: np.ndarray) -> None:
    def bettered(k: int) -> bool:
        return any((row <= losses[k]).all() and (row < losses[k]).any() for row in losses)

    assert _front(losses) == tuple(not bettered(k) for k in range(len(losses)))


def test_the_design_that_is_written_is_the_best_one(tmp_path: Path) -> None:
    result: SearchResult = search(asked(96))
    file = tmp_path / "better.toml"
    file.write_text(design_text(result, SPEC), encoding="utf-8")
    spec = load_spec(file)
    x, z, semi_minor = result.best.place
    assert spec.optics.camera_mm == (x, 0.0, z)
    assert spec.optics.semi_minor_mm == semi_minor
    assert (spec.optics.n, spec.shell.wall_mm) == (4, 4)
    assert json.dumps(4.0) in file.read_text(encoding="utf-8")
