"""What the photographs themselves choose of a fit: by mirrors that it does not see."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tbcad.light.reconstruction.fit import fit, squared_error
from tbcad.light.reconstruction.rays import CapturedRays
from tbcad.light.reconstruction.start import Level, Settings, first_state
from tbcad.types import Bools, Progress

EVERY = 20  # one mirror of so many is held out
LEVELS = (Level(48, 1), Level(72, 2))  # of a trial
FACTOR = 4.0  # between weights that are tried
MOST_STEPS = 3  # of a walk
LEAST_GAIN = 0.01  # of the loss, that a step must bring
ORDER_GAIN = 0.05  # likewise, and view dependence, which also costs twice the time


@dataclass(frozen=True)
class Trial:
    """A fit that was tried."""

    settings: Settings  # its settings
    loss: float  # mean squared error of held-out rays, summed over the colours


def held_out(rays: CapturedRays) -> Bools:
    """Rays (n,) of every 20th mirror."""
    return np.asarray(rays.mirror % EVERY == EVERY // 2)


def chosen(
    rays: CapturedRays,
    inside: Bools,
    settings: Settings,
    orders: tuple[int, ...],
    progress: Progress,
) -> tuple[Settings, list[Trial]]:
    """Choose the weights of smoothness and sparsity, and the order of view dependence.

    All weights are changed by one factor, as long as held-out rays are predicted better by a
    coarse fit; then orders are compared.

    Args:
        rays: what was captured.
        inside: their hull.
        settings: to begin with.
        orders: that may be chosen, the first is begun with.
        progress: called with each trial.

    Returns:
        The settings, and the trials in their order.
    """
    trials: list[Trial] = []

    def tried(wanted: Settings) -> Trial:
        progress(f"trial {len(trials) + 1}: weights and view dependence by held-out mirrors")
        trials.append(Trial(wanted, held_out_loss(rays, inside, replace(wanted, levels=LEVELS))))
        return trials[-1]

    best = _best_weight(tried, replace(settings, order=orders[0]))
    for order in orders[1:]:
        other = tried(replace(best.settings, order=order))
        best = other if other.loss < (1 - ORDER_GAIN) * best.loss else best
    return replace(best.settings, levels=settings.levels), trials


def _best_weight(tried: Callable[[Settings], Trial], settings: Settings) -> Trial:
    """Walk to smaller weights while that helps; if it never does, to larger ones likewise."""
    begun = tried(settings)
    best = _walk(tried, begun, 1 / FACTOR)
    return best if best is not begun else _walk(tried, begun, FACTOR)


def _walk(tried: Callable[[Settings], Trial], best: Trial, factor: float) -> Trial:
    for _ in range(MOST_STEPS):
        other = tried(weighted(best.settings, factor))
        if other.loss > (1 - LEAST_GAIN) * best.loss:
            break
        best = other
    return best


def weighted(settings: Settings, factor: float) -> Settings:
    """The same with all weights times a factor."""
    return replace(
        settings,
        smooth_density=settings.smooth_density * factor,
        smooth_colour=settings.smooth_colour * factor,
        sparse=settings.sparse * factor,
    )


def held_out_loss(rays: CapturedRays, inside: Bools, settings: Settings) -> float:
    """Mean squared error, summed over the colours, of held-out rays by a fit to all others."""
    held = held_out(rays)
    *_, last = fit(rays, settings, ~held, first_state(inside, rays.capture_mm, settings))
    return squared_error(rays, held, last.field(), settings)
