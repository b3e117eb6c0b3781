"""The margin a process needs: with made-up losses, by brute force, and with real designs."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import numpy as np
import pytest

from tbcad.core.mirrors.array import design
from tbcad.core.spec.design import MAX_MARGIN, Spec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.load import load_spec
from tbcad.light.simulate.scene.reflector import reflectors
from tbcad.tolerancing.margin import (
    STEP_MM,
    Margin,
    margin,
    with_margin,
)
from tbcad.tolerancing.montecarlo.builds import MonteCarloCase, simulate
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.process.process import load_process, process_errors

TARGET = 60.0
Loss = Callable[[float], np.ndarray]


@pytest.fixture(scope="module")
def spec() -> Spec:
    return load_spec(None, ["n=4"])


@dataclass(frozen=True)
class OnlySpec:
    """What a made-up loss needs of a design."""

    margin_mm: float


@pytest.fixture
def without_mirrors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "tbcad.tolerancing.margin.design", lambda spec: OnlySpec(spec.mirrors.margin_mm)
    )
    as_model(monkeypatch)


def as_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take a made-up design for its fast model."""
    for name in ("reflectors", "edge_models"):
        monkeypatch.setattr(f"tbcad.tolerancing.margin.{name}", lambda made: made)


def losing(loss: Loss) -> Callable[[Errors, EdgeModels], np.ndarray]:
    """Coverage of builds that see the target and the margin but for what they lose."""
    return lambda _, made: TARGET + made.margin_mm - loss(made.margin_mm)  # type: ignore[attr-defined]


def steady(loss: float | np.ndarray) -> Loss:
    return lambda _: np.broadcast_to(loss, np.shape(loss) or (10,))


def brute(lost: np.ndarray, wanted: float) -> float:
    """The least step with which the share is good, all of them tried."""
    steps = np.arange(round(MAX_MARGIN / STEP_MM) + 1) * STEP_MM
    good = (TARGET + steps[:, None] - lost >= TARGET).mean(axis=1) >= wanted
    return float(steps[np.argmax(good)])


@pytest.mark.usefixtures("without_mirrors")
class TestMadeUpLosses:
    @pytest.mark.parametrize("loss", [0.004, 0.123, 0.597, 0.603, 1.234, 7.7777, 19.985])
    def test_least_margin_in_steps(self, spec: Spec, loss: float) -> None:
        found = margin(spec, Errors(), 0.99, losing(steady(loss)))
        assert found.mm == pytest.approx(ceil(loss / STEP_MM) * STEP_MM, abs=1e-9)
        assert (found.share, found.reason) == (1, "")

    @pytest.mark.parametrize("start", [0.0, 0.6, 3.0, 20.0])
    def test_wherever_the_design_starts(self, start: float) -> None:
        spec = load_spec(None, ["n=4", f"mirrors.margin_mm={start}"])
        found = margin(spec, Errors(), 0.99, losing(steady(1.234)))
        assert found.mm == pytest.approx(1.24, abs=1e-9)

    def test_gain_needs_none(self, spec: Spec) -> None:
        assert margin(spec, Errors(), 0.99, losing(steady(-1.0))) == Margin(0.0, 1.0)

    def test_smaller_mirrors_may_lose_more(self, spec: Spec) -> None:
        """Of a loss of 1 + m / 10 the margin m that makes up for it is 10 / 9."""
        found = margin(spec, Errors(), 0.99, losing(lambda m: np.full(10, 1 + 0.1 * m)))
        assert found.mm == pytest.approx(1.12, abs=1e-9)

    @pytest.mark.parametrize("wanted", [0.5, 0.9, 0.95, 0.975, 0.985, 0.99, 0.995, 0.999])
    @pytest.mark.parametrize("seed", range(4))
    def test_random_losses_against_brute_force(self, spec: Spec, seed: int, wanted: float) -> None:
        """Also with shares between those that 100 builds can have."""
        lost = np.random.default_rng(seed).normal(1.5, 0.4, 100).clip(0.05)
        found = margin(spec, Errors(), wanted, losing(steady(lost)))
        assert found.mm == pytest.approx(brute(lost, wanted), abs=1e-9)
        assert found.share == (found.mm >= lost).mean() >= wanted

    @pytest.mark.parametrize("seed", range(10))
    def test_never_a_margin_with_too_small_a_share(self, spec: Spec, seed: int) -> None:
        """Losses that change with the margin without any rule."""
        generator = np.random.default_rng(seed)
        wanted = float(generator.uniform(0.2, 0.999))
        told: list[float] = []

        def worst(_: Errors, __: EdgeModels) -> np.ndarray:
            seen = TARGET + generator.normal(0.3, 0.5, 50)
            told.append(float((seen >= TARGET).mean()))
            return seen

        found = margin(spec, Errors(), wanted, worst)
        assert found.share == told[-1]
        assert (found.mm is not None) == (found.reason == "")
        if found.mm is not None:
            assert found.share >= wanted

    def test_too_much(self, spec: Spec) -> None:
        found = margin(spec, Errors(), 0.99, losing(steady(MAX_MARGIN + 0.001)))
        assert (found.mm, found.share) == (None, 0)
        assert "more than 20 mm" in found.reason

    def test_loss_that_runs_away(self, spec: Spec) -> None:
        """Whatever the margin, a millimetre is lacking."""
        found = margin(spec, Errors(), 0.99, losing(lambda m: np.full(10, m + 1)))
        assert (found.mm, found.share) == (None, 0)
        assert found.reason

    def test_some_good_but_too_few(self, spec: Spec) -> None:
        found = margin(spec, Errors(), 0.99, losing(steady(np.array([0.1, 30.0]))))
        assert (found.mm, found.share) == (None, 0.5)


def test_mirrors_that_cannot_be_made(spec: Spec, monkeypatch: pytest.MonkeyPatch) -> None:
    def refusing(spec: Spec) -> OnlySpec:
        if spec.mirrors.margin_mm > 1:
            raise SpecError("mirrors overlap")
        return OnlySpec(spec.mirrors.margin_mm)

    monkeypatch.setattr("tbcad.tolerancing.margin.design", refusing)
    as_model(monkeypatch)
    found = margin(spec, Errors(), 0.99, losing(steady(np.array([0.5, 2.0, 2.0, 2.0]))))
    assert (found.mm, found.share) == (None, 0.25)
    assert found.reason == "mirrors of margin 2.00 mm: mirrors overlap"


def test_spec_with_another_margin() -> None:
    flat = load_spec(None, ["n=4", "radius_rule=paper"])
    other = with_margin(flat, 0.1 + 0.2)
    assert (other.mirrors.margin_mm, other.mirrors.radius_rule) == (0.3, "traced")
    assert flat.mirrors.radius_rule == "paper"
    assert other.optics == flat.optics
    assert with_margin(other, flat.mirrors.margin_mm).mirrors == flat.mirrors.model_copy(
        update={"radius_rule": "traced"}
    )


class TestRealDesigns:
    """Made anew with the margin that was found, and with builds of the same numbers."""

    @staticmethod
    def worst(errors: Errors, models: EdgeModels) -> np.ndarray:
        return simulate(MonteCarloCase(models, errors, 1), 40).worst

    def test_margin_gives_the_yield(self, spec: Spec) -> None:
        made, wanted = process_errors(load_process("sla")), 0.9
        found = margin(spec, made, wanted, self.worst)
        assert found.mm is not None

        def share(mm: float) -> float:
            options = ["n=4", f"mirrors.margin_mm={mm:.2f}"]
            models = edge_models(reflectors(design(load_spec(None, options))))
            return float((self.worst(made, models) >= TARGET).mean())

        assert share(found.mm) == found.share >= wanted
        assert share(found.mm - 2 * STEP_MM) < wanted

    def test_loss_that_is_known(self, spec: Spec) -> None:
        """Facets are taken off the coverage; radii are solved for, so a step may be needed more."""
        found = margin(spec, Errors(facets=Error(0, 0.36)), 0.99, self.worst)
        assert found.mm is not None
        assert 0.36 <= found.mm <= 0.37 + 1e-9
