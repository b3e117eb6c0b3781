"""Plots of an analysis: the yield, what each error costs, and which virtual cameras suffer."""

import numpy as np

from tbcad.simulate.study.plots import Panel, Series
from tbcad.tolerance.analysis import Analysis
from tbcad.tolerance.montecarlo.coverage import virtual
from tbcad.types import Floats


def panels(found: Analysis) -> tuple[Panel, ...]:
    """All plots."""
    return (_curve(found), _bars(found), _map(found))


def _curve(found: Analysis) -> Panel:
    worst = np.sort(found.result.worst)
    share = 1 - np.arange(len(worst)) / len(worst)
    at = np.array([found.target, found.target])
    series = (
        Series(found.process.name, worst, 100 * share, "C0-"),
        Series(f"{found.target:g} mm", at, np.array([0.0, 100.0]), "k--"),
    )
    return Panel("Machines whose worst camera sees ...", "... mm or more", "% of machines", series)


def _bars(found: Analysis) -> Panel:
    loss = np.array([one.loss for one in found.single_errors])
    names = tuple(in_words(one.kind) for one in found.single_errors)
    bars = Series("", loss, np.arange(len(loss), dtype=np.float64), "bars")
    return Panel("What each kind of error costs alone", "mm of coverage", "", (bars,), names=names)


def _map(found: Analysis) -> Panel:
    u = directions(found)
    low = found.result.quantiles((0.05,))[0]
    away = np.degrees(np.arccos(np.clip(u[:, 2], -1, 1)))
    flat = np.maximum(np.hypot(u[:, 0], u[:, 1]), 1e-12)
    x, y = away * u[:, 0] / flat, away * u[:, 1] / flat
    dots = Series("", x, y, ".", low, "coverage that 5 % do not reach, mm")
    return Panel("Virtual cameras, the zenith in the middle", "degrees", "degrees", (dots,))


def directions(found: Analysis) -> Floats:
    """Directions of the virtual cameras, (v, 3)."""
    which = virtual(found.halves)
    every = np.concatenate([at.u for at in found.cameras])
    result = np.zeros((int(which.max()) + 1, 3))
    result[which[::-1]] = every[::-1]  # the first that is of a camera counts
    return result


def in_words(kind: str) -> str:
    """A kind of error in words."""
    return kind.replace("_", " ")
