"""Fits to rays of balls in closed form; threads and pauses change no bit of them."""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest

from tbcad.light.reconstruction import fit as fitting
from tbcad.light.reconstruction import start as starting
from tbcad.light.reconstruction.field import Field, field_bytes
from tbcad.light.reconstruction.fit import fit, medium_of
from tbcad.light.reconstruction.marching import composited
from tbcad.light.reconstruction.rays import CapturedRays
from tbcad.light.reconstruction.start import Level, Settings
from tbcad.light.simulate import parallel
from tests.ray_fields import RADIUS, Ball, rays_of

BALL = Ball((1.0, 0.5, -0.5), 5.0, (0.8, 0.4, 0.2))
TWO = [Ball((-4.0, 0, 0), 2.5, (0.9, 0.1, 0.1)), Ball((4.0, 1, 0), 3.0, (0.1, 0.2, 0.9))]
SMALL = Settings(levels=(Level(14, 3), Level(28, 5)), batch=400)
TINY = Settings(levels=(Level(8, 2), Level(12, 2)), batch=500)


def fitted(rays: CapturedRays, settings: Settings = SMALL) -> Field:
    *_, last = fit(rays, settings)
    return last.field()


def toward(centre: tuple[float, float, float], made: Field, count: int = 200) -> np.ndarray:
    """Colour, opacity, and distance from a point to where rays toward it end, (n, 5)."""
    ways = np.random.default_rng(7).normal(size=(count, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    length = 2 * (RADIUS - np.linalg.norm(centre))
    entry = np.array(centre) - length / 2 * ways
    single = [a.astype(np.float32) for a in (entry, ways, np.full(count, length))]
    found = composited(*single, medium_of(made, 0.2))
    found[:, 4] = length / 2 - found[:, 4]
    return found


@pytest.mark.parametrize("order", [0, 1])
def test_a_ball_is_found_with_its_radius_and_colour(order: int) -> None:
    made = fitted(rays_of([BALL], 30_000), replace(SMALL, order=order))
    assert made.order == order
    found = toward(BALL.centre, made)
    assert found[:, 3].min() > 0.9
    assert np.abs(found[:, 4] - BALL.radius).mean() < 0.7 * made.grid.pitch_mm
    assert np.abs(found[:, :3] - BALL.colour).mean() < 0.02


def test_two_balls_are_found_with_nothing_between() -> None:
    made = fitted(rays_of(TWO, 40_000))
    for ball in TWO:
        found = toward(ball.centre, made)
        assert np.abs(found[:, 4] - ball.radius).mean() < 0.7 * made.grid.pitch_mm
        assert np.abs(found[:, :3] - ball.colour).mean() < 0.03
    between = [np.float32([a]) for a in ([0.3, -9, 0], [0, 1, 0], 18)]
    assert composited(*between, medium_of(made, 0.2))[0, 3] < 0.02


def backward(work: Callable[..., object], items: Iterable[object]) -> list[object]:
    """As `in_threads`, in one thread that does the last item first."""
    return [work(item) for item in reversed(list(items))][::-1]


@pytest.mark.parametrize("order", [0, 1])
def test_threads_and_the_order_of_their_work_change_no_bit(
    monkeypatch: pytest.MonkeyPatch, order: int
) -> None:
    settings, found = replace(TINY, order=order), set()
    for threads in (1, 3):
        monkeypatch.setattr(parallel, "THREADS", threads)
        found.add(field_bytes(fitted(rays_of(TWO, 6_000), settings)))
    for module in (fitting, starting):
        monkeypatch.setattr(module, "in_threads", backward)
    assert found == {field_bytes(fitted(rays_of(TWO, 6_000), settings))}


def test_another_seed_is_another_field() -> None:
    rays = rays_of([BALL], 3_000)
    seeds = [replace(TINY, seed=seed) for seed in (0, 1)]
    assert len({field_bytes(fitted(rays, settings)) for settings in seeds}) == 2
