"""The margin a process needs: with made-up losses, by brute force, and with real designs."""

from collections.abc import Callable
from dataclasses import replace
from math import sqrt
from unittest.mock import Mock

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import design
from tbcad.core.spec.design import MAX_MARGIN, MirrorsSpec, Spec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.margin import (
    FLIP_Y,
    STEP_MM,
    Margin,
    MirrorLosses,
    margin,
    mirror_losses,
    needed_margins,
    own_margins,
    solved_designs,
    with_margin,
    with_own_margins,
)
from tbcad.tolerancing.montecarlo.builds import CoverageCase, MonteCarloCase, simulate
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.process.process import load_process, process_errors

Loss = Callable[[float], np.ndarray]
TARGET = 60.0


@pytest.fixture(scope="module")
def spec() -> Spec:
    return load_spec(None, ["n=4"])


def found_margin(
    spec: Spec,
    loss: Loss,
    wanted: float = 0.99,
    mirrors: Callable[[Spec], MirrorsSpec] = lambda spec: spec.mirrors,
) -> Margin:
    """Where builds see the target and the margin but for what they lose; no mirrors are made."""

    def seen(_: Errors, made: MirrorsSpec) -> np.ndarray:
        return TARGET + made.margin_mm - loss(made.margin_mm)

    return margin(spec, Errors(), wanted, seen, designs=mirrors)  # type: ignore[arg-type]


def steady(loss: float | np.ndarray) -> Loss:
    return lambda _: np.broadcast_to(loss, np.shape(loss) or (10,))


def brute(lost: np.ndarray, wanted: float) -> float:
    """The least step with which the share is good, all of them tried."""
    steps = np.arange(round(MAX_MARGIN / STEP_MM) + 1) * STEP_MM
    good = (TARGET + steps[:, None] - lost >= TARGET).mean(axis=1) >= wanted
    return float(steps[np.argmax(good)])


class TestMadeUpLosses:
    @pytest.mark.parametrize("start", [0.0, 3.0, 20.0])
    @pytest.mark.parametrize(
        ("loss", "needed"),
        [
            (steady(1.234), 1.24),
            (steady(-1.0), 0.0),
            (lambda m: np.full(10, 1 + 0.1 * m), 1.12),  # 1 + m / 10 is made up for by 10 / 9
        ],
    )
    def test_closed_forms_wherever_the_design_starts(
        self, start: float, loss: Loss, needed: float
    ) -> None:
        spec = load_spec(None, ["n=4", f"mirrors.margin_mm={start}"])
        found = found_margin(spec, loss)
        assert (found.mm, found.share) == (pytest.approx(needed, abs=1e-9), 1.0)

    @pytest.mark.parametrize("wanted", [0.5, 0.985, 0.999])
    @pytest.mark.parametrize("seed", range(2))
    def test_random_losses_against_brute_force(self, spec: Spec, seed: int, wanted: float) -> None:
        """Also with shares between those that 100 builds can have."""
        lost = np.random.default_rng(seed).normal(1.5, 0.4, 100).clip(0.05)
        found = found_margin(spec, steady(lost), wanted)
        assert found.mm == pytest.approx(brute(lost, wanted), abs=1e-9)
        assert found.share == (found.mm >= lost).mean() >= wanted

    @pytest.mark.parametrize(
        "loss", [steady(MAX_MARGIN + 0.001), lambda m: np.full(10, m + 1)], ids=["much", "growing"]
    )
    def test_no_margin_is_enough(self, spec: Spec, loss: Loss) -> None:
        found = found_margin(spec, loss)
        assert (found.mm, found.share) == (None, 0)
        assert found.reason


def test_mirrors_that_cannot_be_made(spec: Spec) -> None:
    def refusing(made: Spec) -> MirrorsSpec:
        if made.mirrors.margin_mm > 1:
            raise SpecError("mirrors overlap")
        return made.mirrors

    found = found_margin(spec, steady(np.array([0.5, 2.0, 2.0, 2.0])), mirrors=refusing)
    assert (found.mm, found.share) == (None, 0.25)
    assert found.reason == "mirrors of margin 2.00 mm: mirrors overlap"


def unsymmetric(loss: np.ndarray) -> MirrorLosses:
    """Losses (s, 2, m) of mirrors of which none is nearly flat nor another's image."""
    m = loss.shape[2]
    return MirrorLosses(loss, np.full(m, -np.inf), np.arange(m))


def normal_losses(builds: int, mean: np.ndarray, deviation: np.ndarray, seed: int) -> np.ndarray:
    drawn = np.random.default_rng(seed).standard_normal((builds, 2, len(mean)))
    return np.asarray(mean + deviation * drawn)


class TestKnownLosses:
    @pytest.mark.parametrize("wanted", [0.5, 0.9, 0.985, 0.99])
    @pytest.mark.parametrize("seed", range(3))
    def test_least_level_by_brute_force(self, wanted: float, seed: int) -> None:
        """Of all common levels the least that is enough, but for the rounding of margins."""
        mean, deviation = np.linspace(0.5, 2, 6), np.linspace(0.3, 0.6, 6)
        both = normal_losses(400, mean, deviation, seed)
        margins = needed_margins(unsymmetric(both), wanted)
        loss, other = both[:200], both[200:]

        def share(of: np.ndarray) -> float:
            return float((loss <= of).all(axis=(1, 2)).mean())

        every = other.reshape(-1, 6)
        middle = every.mean(axis=0)
        above = np.sqrt((np.maximum(every - middle, 0) ** 2).mean(axis=0))
        levels = np.arange(0, 12, 1e-3)
        enough = next(k for k in levels if share(middle + k * above) >= wanted)
        assert share(margins) >= wanted
        assert (margins >= middle + (enough - 1e-3) * above - 1e-12).all()
        assert (margins <= middle + enough * above + STEP_MM).all()

    def test_skew_losses_count_by_their_upper_side(self) -> None:
        """Of the unit variance of exponential losses 2 / e lies above the mean."""
        drawn = np.random.default_rng(3).exponential(1.0, (40_000, 2, 2)) - 1
        drawn[..., 1] *= -1
        up, down = needed_margins(unsymmetric(2 + drawn), 0.9) - 2
        assert up / down == pytest.approx(sqrt(2 / (np.e - 2)), rel=0.03)

    def test_images_have_the_same_and_gains_need_nothing(self) -> None:
        loss = normal_losses(100, np.array([1.0, 1, 2]), np.array([0.3, 0.3, 0.3]), seed=4)
        margins = needed_margins(replace(unsymmetric(loss), partner=np.array([1, 0, 2])), 0.9)
        assert margins[0] == margins[1] < margins[2]
        assert needed_margins(unsymmetric(np.full((10, 2, 3), -1.0)), 0.99).tolist() == [0, 0, 0]

    def test_nearly_flat_mirrors_need_none(self) -> None:
        """Nor do they drive the level of the others, unless they lose all that they have spare."""
        loss = normal_losses(500, np.array([1.0, 1.0]), np.array([0.1, 2.0]), seed=5)
        alone, both = (needed_margins(unsymmetric(loss[..., :k]), 0.9) for k in (1, 2))
        for spare, expected in ((50.0, [alone[0], 0]), (1.0, both)):
            flat = replace(unsymmetric(loss), spare=np.array([-np.inf, spare]))
            assert needed_margins(flat, 0.9) == pytest.approx(expected)


def models_of(*options: str) -> EdgeModels:
    return edge_models(reflectors(design(load_spec(None, options))))


def test_losses_of_halves_and_images() -> None:
    """Losses of made-up coverages come back at both halves; images are images in y = 0."""
    models = models_of("n=4")
    m, halved = len(models[0]), models[0].halved
    cameras = 2 * m - int(halved.sum())
    designed = np.full(cameras, TARGET + 1)
    seen = designed - np.arange(cameras)
    losses = mirror_losses(models, designed, seen[None], TARGET, np.ones(1))
    assert losses.loss[0, 0].tolist() == list(range(m))
    assert losses.loss[0, 1, ~halved].tolist() == list(range(m, cameras))
    assert losses.loss[0, 1, halved].tolist() == np.flatnonzero(halved).tolist()
    assert not losses.nearly_flat.any()
    u = models[0].screen[:, 2]
    assert norm(u[losses.partner] - u * FLIP_Y).max() < 1e-12


def test_no_images_where_the_camera_is_off_the_plane() -> None:
    models = models_of("n=3", "camera_mm=[100, 5, -100]")
    m = len(models[0])
    designed = np.full(2 * m - int(models[0].halved.sum()), TARGET)
    losses = mirror_losses(models, designed, designed[None], TARGET, np.zeros(1))
    assert losses.partner.tolist() == list(range(m))


class TestRealOwnMargins:
    BUILDS = 60  # that are judged

    def coverage(self, errors: Errors, models: EdgeModels) -> np.ndarray:
        return simulate(CoverageCase(models, errors, 1), 2 * self.BUILDS).coverage

    def test_margins_give_the_yield_and_less_does_not(self) -> None:
        spec, wanted = load_spec(None, ["n=4", "margin_mm=0"]), 0.9
        errors = process_errors(load_process("sla"))
        found = own_margins(spec, errors, wanted, 1.0, self.coverage)
        assert found is not None

        def share(margins: np.ndarray) -> float:
            text = f"mirrors.own_margins_mm={margins.tolist()}"
            models = models_of("n=4", "margin_mm=0", text)
            worst = simulate(MonteCarloCase(models, errors, 1), self.BUILDS).worst
            return float((worst >= TARGET).mean())

        assert share(found.mm) == found.share >= wanted
        assert share(np.maximum(found.mm - 0.1, 0)) < wanted
        assert np.ptp(found.mm) > 0.1

    def test_no_mirror_gets_less_than_the_margin_of_the_spec(self) -> None:
        spec = load_spec(None, ["n=4", "margin_mm=1.45"])
        found = own_margins(spec, process_errors(load_process("sla")), 0.9, 2.0, self.coverage)
        assert found is not None
        assert found.mm.min() == 1.45 < found.mm.max()

    def test_known_loss_of_all_is_the_margin_of_all(self) -> None:
        """Facets are taken off the coverage: each mirror that is not nearly flat needs as much."""
        spec = load_spec(None, ["n=5", "margin_mm=0"])
        found = own_margins(spec, Errors(facets=Error(0, 0.505)), 0.99, 1.0, self.coverage)
        assert found is not None
        assert set(found.mm.tolist()) <= {0.0, 0.51}
        assert found.average_mm == pytest.approx(0.51)

    def test_margins_that_cannot_be_are_none(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Too large ones, and those of mirrors that cannot be made."""
        errors, spec = Errors(facets=Error(0, 21.0)), load_spec(None, ["n=4"])
        assert own_margins(spec, errors, 0.99, 1.0, self.coverage) is None
        (designs := solved_designs())(with_margin(spec, 1.0))
        overlap = Mock(side_effect=SpecError("mirrors overlap"))
        monkeypatch.setattr("tbcad.tolerancing.margin.design", overlap)
        errors = process_errors(load_process("sla"))
        assert own_margins(spec, errors, 0.9, 1.0, self.coverage, designs=designs) is None
        assert overlap.called


def test_spec_with_margins_of_single_mirrors() -> None:
    spec = with_own_margins(load_spec(None, ["n=2"]), np.array([0.7, 0.1 + 0.7]))
    assert spec.mirrors.own_margins_mm == (0.7, 0.8)
    assert with_margin(spec, 1.0).mirrors.own_margins_mm == ()
