"""The hull of balls in closed form, and settings that held-out mirrors choose."""

from collections.abc import Callable, Iterable
from contextlib import nullcontext
from dataclasses import replace
from math import log
from types import SimpleNamespace

import numpy as np
import pytest

from tbcad.core.optics.camera import Camera
from tbcad.core.optics.surfaces import Surfaces
from tbcad.errors import InputError
from tbcad.light.reconstruction import fit as choice
from tbcad.light.reconstruction.field import Field, field_bytes
from tbcad.light.reconstruction.fit import (
    FACTOR,
    LEVELS,
    chosen,
    fit,
    held_out,
    held_out_loss,
    medium_of,
    weighted,
)
from tbcad.light.reconstruction.marching import composited
from tbcad.light.reconstruction.rays import (
    CapturedRays,
    captured_rays,
    noise_level,
    pixel_areas,
    pixel_places,
    with_weights,
)
from tbcad.light.reconstruction.start import MOST_DARK, Level, Settings, hull
from tbcad.light.simulate.capture.light_field import RAY_SIGMAS, CameraFrame, LightField
from tests.ray_fields import RADIUS, Ball, rays_of

RED = (0.8, 0.2, 0.1)
RAYS = rays_of([Ball((1, 0, 0), 5, (0.8, 0.4, 0.2))], 2_000)
BEGUN, HULL = Settings(), hull(RAYS)
PIXEL_MM = 0.5
BALL = Ball((1.0, 0.5, -0.5), 5.0, (0.8, 0.4, 0.2))
TWO = [Ball((-4.0, 0, 0), 2.5, (0.9, 0.1, 0.1)), Ball((4.0, 1, 0), 3.0, (0.1, 0.2, 0.9))]
SMALL = Settings(levels=(Level(14, 3), Level(28, 5)), batch=400)
TINY = Settings(levels=(Level(8, 2), Level(12, 2)), batch=500)


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


def as_of_a_cluster(patch: pytest.MonkeyPatch, workers: int) -> list[int]:
    """Numbers of trials that so many workers are given at a time, as they come."""
    pieces: list[int] = []

    def run_units(
        work: Callable[[Settings], float], units: list[Settings], _: str
    ) -> Iterable[float]:
        pieces.append(len(units))
        return [work(one) for one in units]

    client = SimpleNamespace(nthreads=lambda: dict.fromkeys(range(workers)))
    patch.setattr(choice, "one_client", lambda _: nullcontext(client))
    patch.setattr(choice, "run_units", run_units)
    return pieces


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
    for workers in (1, 3, 20):
        with monkeypatch.context() as patch:
            pieces = as_of_a_cluster(patch, workers)
            assert chosen(RAYS, HULL, BEGUN, orders, told.append, "tcp://a:1") == (found, trials)
        assert max(pieces) <= workers
        assert workers > 1 or pieces == [1] * len(trials)
        assert workers < 20 or len(pieces) == 1 < sum(pieces)
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


@pytest.mark.slow
def test_workers_of_a_cluster_choose_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(choice, "LEVELS", TINY.levels)
    alone = chosen(RAYS, HULL, TINY, (0, 1), str)
    with distributed.LocalCluster(
        n_workers=2, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        assert chosen(RAYS, HULL, TINY, (0, 1), str, cluster.scheduler_address) == alone


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


@pytest.mark.parametrize("area", [False, True])
@pytest.mark.parametrize("blur_px", [0.45, 2.0])
@pytest.mark.parametrize("count", [3, 12, 40])
def test_mean_and_variance(count: int, blur_px: float, area: bool) -> None:
    places = pixel_places(count, blur_px, area=area).astype(np.float64)
    assert np.mean(pixel_places(count).astype(np.float64) ** 2) == pytest.approx(1 / 12)
    assert places.shape[1:] == (count, 2)
    assert np.abs(places.mean(axis=1)).max() < 1e-6
    both = (places**2).sum(axis=2).mean(axis=1)
    assert both == pytest.approx(np.full(len(both), 2 * (area / 12 + blur_px**2)), rel=1e-5)
    of_both_ways = (places**2).mean(axis=(0, 1))
    assert of_both_ways[0] == pytest.approx(of_both_ways[1], rel=1e-5)


@pytest.fixture
def parallel() -> LightField:
    """Rays down, 0.5 mm apart, by three mirrors side by side, each of 4 x 8 pixels."""
    column, row = np.meshgrid(np.arange(12), np.arange(8))
    x, y = PIXEL_MM * (column - 5.5), PIXEL_MM * (row - 3.5)
    planes = {
        "colour": np.full((8, 12, 3), 100, dtype=np.uint8),
        "mirror": (column // 4 + 1).astype(np.uint16),
        "origin": np.stack([x, y, 0 * x + 50], axis=2).astype(np.float32),
        "direction": np.broadcast_to(np.float32([0, 0, -1]), (8, 12, 3)),
    }
    up = np.tile([0.0, 0.0, 1.0], (3, 1))
    camera = Camera(np.array([0.0, 0, 90]), np.array([0.0, 0, -1]), np.array([1.0, 0, 0]), 12, 8, 1)
    boxes = np.array([[4 * k, 4 * k + 4, 0, 8] for k in range(3)])
    frame = CameraFrame(camera, up, Surfaces(50 * up, up, np.zeros(3)), boxes, planes)
    return LightField({"a": frame}, 60.0, {})


def weights(source: LightField, *sigmas: float | None) -> list[float]:
    """Of one ray of each mirror."""
    told = replace(source, facts={RAY_SIGMAS: {"a": list(sigmas)}})
    rays = with_weights(captured_rays(told, footprint=True), told)
    return [float(rays.weight[rays.mirror == k].mean()) for k in range(3)]


def test_the_formula(parallel: LightField) -> None:
    rays = captured_rays(parallel, footprint=True)
    assert pixel_areas(rays) == pytest.approx(np.full(len(rays), PIXEL_MM**2), rel=1e-3)
    found = weights(parallel, 0.0, PIXEL_MM / 12, PIXEL_MM / 2)
    assert found == pytest.approx([1, 1 / (1 + 6 / 144), 0.4], rel=1e-3)
    found = weights(parallel, 0.1, None, 0.3)  # what is unknown counts as the worst
    assert found[1] == pytest.approx(found[2], rel=1e-4)


def test_a_pixel_without_neighbours_counts_as_the_others(parallel: LightField) -> None:
    parallel.frames["a"].planes["mirror"][1:, 4:8] = 0  # leaves a row of the second mirror
    parallel.frames["a"].planes["mirror"][0, 5:8] = 0
    found = weights(parallel, PIXEL_MM / 2, PIXEL_MM / 2, PIXEL_MM / 2)
    assert found == pytest.approx([0.4, 0.4, 0.4], rel=1e-3)


def test_nothing_known_changes_nothing(parallel: LightField) -> None:
    assert weights(parallel, None, None, None) == [1, 1, 1]
    rays = captured_rays(parallel, footprint=True)
    assert with_weights(rays, parallel) is rays


@pytest.mark.parametrize("sigmas", [[0.1, 0.2], [0.1, 0.2, -1], [0.1, "x", 0.2], 3])
def test_what_does_not_fit_is_refused(parallel: LightField, sigmas: object) -> None:
    told = replace(parallel, facts={RAY_SIGMAS: {"a": sigmas}})
    with pytest.raises(InputError, match="does not fit its mirrors"):
        with_weights(captured_rays(told, footprint=True), told)


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


def backward(work: Callable[..., object], items: Iterable[object]) -> list[object]:
    """As `in_threads`, in one thread that does the last item first."""
    return [work(item) for item in reversed(list(items))][::-1]


@pytest.mark.parametrize("order", [0, 1])
def test_threads_and_the_order_of_their_work_change_no_bit(
    monkeypatch: pytest.MonkeyPatch, order: int
) -> None:
    settings, found = replace(TINY, order=order), set()
    for threads in (1, 3):
        monkeypatch.setattr("tbcad.light.simulate.parallel.THREADS", threads)
        found.add(field_bytes(fitted(rays_of(TWO, 6_000), settings)))
    for module in ("reconstruction.fit", "simulate.parallel"):
        monkeypatch.setattr(f"tbcad.light.{module}.in_threads", backward)
    assert found == {field_bytes(fitted(rays_of(TWO, 6_000), settings))}


def test_another_seed_is_another_field() -> None:
    rays = rays_of([BALL], 3_000)
    seeds = [replace(TINY, seed=seed) for seed in (0, 1)]
    assert len({field_bytes(fitted(rays, settings)) for settings in seeds}) == 2
