"""The hull of balls in closed form, and settings that held-out mirrors choose."""

from dataclasses import replace
from math import log

import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.light.reconstruction import fit as choice
from tbcad.light.reconstruction.fit import (
    FACTOR,
    LEVELS,
    chosen,
    held_out,
    held_out_loss,
    weighted,
)
from tbcad.light.reconstruction.rays import CapturedRays, noise_level
from tbcad.light.reconstruction.start import MOST_DARK, Level, Settings, hull
from tests.ray_fields import RADIUS, Ball, rays_of

RED = (0.8, 0.2, 0.1)
RAYS = rays_of([Ball((1, 0, 0), 5, (0.8, 0.4, 0.2))], 2_000)
BEGUN, HULL = Settings(), hull(RAYS)


def hull_of(rays: CapturedRays) -> tuple[np.ndarray, np.ndarray, float]:
    """Nodes in the hull, all nodes' places (..., 3), and their pitch."""
    inside = hull(rays)
    axis = np.linspace(-RADIUS, RADIUS, len(inside))
    return inside, np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1), axis[1] - axis[0]


@pytest.mark.parametrize("radius", [2.0, 6.0, 7.5])
def test_a_ball_is_in_its_hull_and_little_else(radius: float) -> None:
    """A point at the distance d is missed by the share sqrt(1 - (r / d)^2) of its lines."""
    centre = np.array([0.5, -1.0, 0.3]) if radius < 7 else np.zeros(3)
    inside, places, pitch = hull_of(rays_of([Ball(tuple(centre), radius, RED)], 200_000))
    away = np.linalg.norm(places - centre, axis=-1)
    assert inside[away < radius].all()
    limit = radius / np.sqrt(1 - MOST_DARK**2)
    most = limit + pitch * (
        1 + 2 * np.sqrt(3) / 2
    )  # the dilation; lines pass a node half a cell away
    assert (away[inside] < most).mean() > 0.998


def test_two_balls_are_two_hulls() -> None:
    balls = [Ball((-5, 0, 0), 2, RED), Ball((5, 0, 0), 2, RED)]
    inside, places, _ = hull_of(rays_of(balls, 200_000))
    assert not inside[np.abs(places[..., 0]) < 1].any()
    for side in (-1, 1):
        assert inside[np.linalg.norm(places - [5 * side, 0, 0], axis=-1) < 2].all()


def test_photographs_without_background_are_refused() -> None:
    everywhere = np.random.default_rng(0).uniform(0.3, 1, (5_000, 3)).astype(np.float32)
    level = noise_level(everywhere.max(axis=1))
    with pytest.raises(InputError, match="what is behind it must be black"):
        hull_of(replace(rays_of([], 5_000), colour=everywhere, noise_level=level))


def test_a_ball_that_almost_fills_the_capture_sphere_is_not_background() -> None:
    rays = rays_of([Ball((0, 0, 0), 0.98 * RADIUS, (0.8, 0.8, 0.8))], 50_000)
    shades = np.random.default_rng(0).uniform(0.3, 1, (50_000, 1)).astype(np.float32)
    inside, places, _ = hull_of(replace(rays, colour=rays.colour * shades))
    assert inside[np.linalg.norm(places, axis=-1) < 0.9 * RADIUS].all()


def test_few_rays_lose_nothing() -> None:
    inside, places, _ = hull_of(rays_of([Ball((0, 0, 0), 6, RED)], 2_000))
    assert inside[np.linalg.norm(places, axis=-1) < 6].mean() > 0.99


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
    assert choose(monkeypatch, -99, 2.0)[1] <= 5  # the walk ends


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
