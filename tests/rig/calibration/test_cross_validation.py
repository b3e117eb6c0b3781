"""Halves of the data agree where the model holds, and not where one half is wrong."""

from dataclasses import fields, replace

import numpy as np
import pytest

from tbcad.rig.calibration.calibrate import Halves, cross_validation
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.estimate.solve import estimate
from tbcad.rig.machine.machine import Highlights
from tests.rig.calibration.machines import drawn, every_highlight, small_machine, small_prior

BUILDS = 3


@pytest.fixture(scope="module")
def prior() -> Prior:
    return small_prior(small_machine(stops=6))


def _halves(prior: Prior, highlights: Highlights) -> tuple[Halves, ...]:
    frame, sphere = np.zeros(len(prior.mean.radius), dtype=np.int64), np.arange(5)
    return cross_validation(estimate(prior, highlights), frame, sphere, lambda _: None)


def test_halves_differ_by_what_their_covariances_say(prior: Prior) -> None:
    """Mean squares over several machines: a handful of shared errors make each one vary."""
    ratios: dict[str, list[float]] = {}
    for seed in range(BUILDS):
        for half in _halves(prior, every_highlight(drawn(prior, seed)[1], 50 + seed)):
            ratios.setdefault(half.by, []).append(half.ratio**2)
    assert set(ratios) == {"angles", "LEDs"}
    assert all(0.2 < np.mean(squares) < 3 for squares in ratios.values())


def test_halves_that_contradict_each_other_are_seen(prior: Prior) -> None:
    highlights = every_highlight(drawn(prior, 1)[1], 2)
    aside = np.where((highlights.frame % 2 == 0)[:, None], [0.0, 0.5], 0.0)
    wrong = replace(highlights, pixel=highlights.pixel + aside * (highlights.sphere[:, None] % 3))
    right, found = (_halves(prior, one)[0] for one in (highlights, wrong))
    assert found.by == "angles"
    assert found.found_mm > 2 * right.found_mm


def test_halves_of_too_few_highlights_are_left_out(prior: Prior) -> None:
    highlights = every_highlight(drawn(prior, 1)[1], 2)
    kept = np.flatnonzero(highlights.led == 0)
    few = Highlights(*(getattr(highlights, one.name)[kept] for one in fields(highlights)))
    assert [half.by for half in _halves(prior, few)] == ["angles"]
