"""The search, with candidates whose figures are a closed form: the mirrors themselves take long."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.optimizing import search as search_module
from tbcad.optimizing.candidate import STEP_MM, DesignCandidate, Figures, MachineLimits, Place
from tbcad.optimizing.search import (
    _front,
    comparison,
    design_text,
    search,
    search_files,
    weightings,
)
from tbcad.options.builds import OptimizeOptions

SPEC = load_spec(None, ["n=4", "shell.wall_mm=4"])
BEST = (123.0, -140.0, 111.5, 1.3, 1.15)


def closed_form(
    spec: Spec, ssim_within: MachineLimits | None, place: Place, **_: str
) -> DesignCandidate:
    """Pixels are most at BEST; the machine grows with x; there is none with a small axis."""
    if place[2] < 60:
        return DesignCandidate(place, None, "the ellipsoid is too small: enlarge it")
    off = float(np.linalg.norm(np.subtract(place, BEST) * [1, 1, 1, 50, 50]))
    figures = Figures(1000 - off, 2000 - off, 7 - off / 100, 1 + off, 3 * place[0], 89.0)
    return DesignCandidate(place, figures)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search_module, "evaluate", closed_form)


def asked(budget: int = 1600, size_mm: float | None = 400.0) -> OptimizeOptions:
    return OptimizeOptions(
        objectives=("minimum", "evenness"), candidates=budget, max_size_mm=size_mm
    )


def test_the_best_place_is_found() -> None:
    best = search(SPEC, asked()).best
    assert np.abs(np.subtract(best.place, BEST))[:3].max() <= 4 * STEP_MM
    assert np.abs(np.subtract(best.place, BEST))[3:].max() <= 0.1


def test_limits_hold() -> None:
    """By default the machine may be no larger than the first one: x stays at 100."""
    result = search(SPEC, asked(size_mm=None))
    assert result.limits.size_mm == 300
    assert result.best.figures is not None
    assert result.best.figures.size_mm <= 300
    assert np.abs(np.subtract(result.best.place, (100, *BEST[1:]))).max() <= 2 * STEP_MM
    kept = [one for one, on in zip(result.candidates, result.on_front, strict=True) if on]
    assert all(one.figures and one.figures.size_mm <= 300 for one in kept)


def test_a_search_that_was_stopped_ends_like_one_that_was_not(tmp_path: Path) -> None:
    whole, parted = tmp_path / "whole.jsonl", tmp_path / "parted.jsonl"
    expected = search(SPEC, asked(280), whole)
    search(SPEC, asked(120), parted)
    assert parted.read_bytes() != whole.read_bytes()
    assert search(SPEC, asked(280), parted) == expected
    assert parted.read_bytes() == whole.read_bytes()
    assert search_files(expected, SPEC, OptimizeOptions()) == search_files(
        search(SPEC, asked(280)), SPEC, OptimizeOptions()
    )


def test_a_store_of_another_design_is_refused(tmp_path: Path) -> None:
    store = tmp_path / "store.jsonl"
    search(SPEC, asked(80), store)
    before = store.read_bytes()
    with pytest.raises(InputError, match="another design"):
        search(load_spec(None, ["n=5"]), asked(80), store)
    assert store.read_bytes() == before


def test_a_broken_store_is_refused(tmp_path: Path) -> None:
    store = tmp_path / "store.jsonl"
    for text in ("", "{", "[]\n", '{"design": 1}\n{"place": 1}\n', '{"design": 1}\n'):
        store.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=r"store.jsonl: (no list of candidates|of another)"):
            search(SPEC, asked(80), store)


def test_a_first_design_that_cannot_be_made() -> None:
    spec = load_spec(None, ["n=4", "capture_diameter_mm=10", "semi_minor_mm=50"])
    with pytest.raises(InputError, match="cannot be made: the ellipsoid is too small"):
        search(spec, OptimizeOptions(objectives=("size",), candidates=80))


@given(arrays(float, st.tuples(st.integers(1, 8), st.integers(1, 3)), elements=st.floats(-2, 2)))
def test_front_against_brute_force(losses: np.ndarray) -> None:
    def bettered(k: int) -> bool:
        return any((row <= losses[k]).all() and (row < losses[k]).any() for row in losses)

    assert _front(losses) == tuple(not bettered(k) for k in range(len(losses)))


def test_the_design_that_is_written_is_the_best_one(tmp_path: Path) -> None:
    result = search(SPEC, asked(120))
    file = tmp_path / "better.toml"
    file.write_text(design_text(result, SPEC), encoding="utf-8")
    spec = load_spec(file)
    x, z, semi_minor, *stretch = result.best.place
    assert spec.optics.camera_mm == (x, 0.0, z)
    assert spec.optics.semi_minor_mm == semi_minor
    assert list(spec.optics.stretch) == stretch
    assert (spec.optics.n, spec.shell.wall_mm) == (4, 4)
    assert json.dumps(4.0) in file.read_text(encoding="utf-8")


def test_ssim_is_measured_where_an_earlier_search_did_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What that search judged beyond the limits, or found impossible, is not judged again."""
    store = tmp_path / "store.jsonl"
    search(SPEC, asked(80), store)
    again: list[Place] = []

    def with_ssim(
        spec: Spec, ssim_within: MachineLimits | None, place: Place, **_: str
    ) -> DesignCandidate:
        again.append(place)
        one = closed_form(spec, ssim_within, place)
        assert ssim_within
        if one.figures and ssim_within.excess(one.figures) == 0:
            measured = replace(one.figures, ssim=0.8 + place[3] / 100)
            return replace(one, figures=measured)
        return one

    monkeypatch.setattr(search_module, "evaluate", with_ssim)
    views = OptimizeOptions(objectives=("ssim",), candidates=280, max_size_mm=400.0)
    result = search(SPEC, views, store)
    within = [one for one in result.candidates if one.figures and one.figures.ssim]
    assert all(one.figures and one.figures.size_mm <= 400 for one in within)
    assert len(within) > 20
    assert len(again) == len(set(again))
    assert result.best.place[3] == max(one.place[3] for one in within)
    kept = [one for one, on in zip(result.candidates, result.on_front, strict=True) if on]
    assert {one.place[3] for one in kept} == {result.best.place[3]}
    assert any("SSIM of views" in line for line in comparison(result))
    assert search(SPEC, views, store) == result


def test_weights_of_a_front() -> None:
    assert [one.tolist() for one in weightings(1)] == [[1.0]]
    every = np.array(weightings(3))
    assert every.shape == (4, 3)
    assert every.sum(axis=1) == pytest.approx(np.ones(4))
    assert every.argmax(axis=1).tolist() == [0, 0, 1, 2]
    assert every[1:].max(axis=1) == pytest.approx(np.full(3, 0.8))
