"""Weights and view dependence that held-out mirrors choose."""

from math import log

import numpy as np
import pytest

from tbcad.light.reconstruction import choice
from tbcad.light.reconstruction.choice import (
    FACTOR,
    LEVELS,
    chosen,
    held_out,
    held_out_loss,
    weighted,
)
from tbcad.light.reconstruction.start import Level, Settings, hull
from tests.ray_fields import Ball, rays_of

RAYS = rays_of([Ball((1, 0, 0), 5, (0.8, 0.4, 0.2))], 2_000)
BEGUN, HULL = Settings(), hull(RAYS)


def choose(
    monkeypatch: pytest.MonkeyPatch, best: float, gloss: float, orders: tuple[int, ...] = (0, 1)
) -> tuple[Settings, int]:
    """What is chosen where the loss is least at that power of the factor, and number of trials."""

    def loss(_: object, __: object, settings: Settings) -> float:
        assert settings.levels == LEVELS
        power = log(settings.sparse / BEGUN.sparse) / log(FACTOR)
        return (1 + (power - best) ** 2) * (gloss if settings.order else 1.0)

    monkeypatch.setattr(choice, "held_out_loss", loss)
    told: list[str] = []
    found, trials = chosen(RAYS, HULL, BEGUN, orders, told.append)
    assert len(told) == len(trials)
    assert found.levels == BEGUN.levels
    return found, len(trials)


@pytest.mark.parametrize("power", [-2, 0, 1])
def test_weights_are_those_of_the_least_loss(monkeypatch: pytest.MonkeyPatch, power: int) -> None:
    found, _ = choose(monkeypatch, power, 2.0)
    expected = weighted(BEGUN, FACTOR**power)
    assert found.order == 0
    for name in ("smooth_density", "smooth_colour", "sparse"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name))


def test_view_dependence_is_chosen_where_it_predicts_better(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert choose(monkeypatch, -1, 0.8)[0].order == 1
    assert choose(monkeypatch, -1, 0.8, orders=(0,))[0].order == 0


def test_a_walk_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    assert choose(monkeypatch, -99, 2.0)[1] <= 5


def test_held_out_rays_have_no_part_in_the_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    small = Settings(levels=(Level(10, 1),), batch=500)
    held = held_out(RAYS)
    assert 0 < held.mean() < 0.1
    before = held_out_loss(RAYS, HULL, small)
    mirrors = {*RAYS.mirror[held].tolist()}
    assert mirrors.isdisjoint(RAYS.mirror[~held].tolist())
    seen: list[np.ndarray] = []
    real = choice.fit

    def watched(rays: object, settings: Settings, used: np.ndarray, state: object) -> object:
        seen.append(used)
        return real(rays, settings, used, state)

    monkeypatch.setattr(choice, "fit", watched)
    assert held_out_loss(RAYS, HULL, small) == before
    assert np.array_equal(seen[0], ~held)
