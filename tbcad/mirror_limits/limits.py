"""Limits of each mirror that leave every virtual camera its coverage."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm as normal

from tbcad.errors import InputError
from tbcad.mirror_limits.sensitivity import KINDS, Sensitivities
from tbcad.types import Floats, Ints

SMALLEST_LIMIT = 1e-3  # um, mrad or mm, where nothing is left after rounding down
PLACES = np.array([3, 4, 5, 3])  # decimals of limits: a nanometre, or what turns or bends by less


@dataclass(frozen=True)
class MirrorLimits:
    """Limits of all mirrors, a first: offset (um), tilt (mrad), radius (mm), walls (um) if any."""

    each: Floats  # a mirror may be off by this, whatever others do within theirs, (2 m, kinds)
    sigma: Floats  # standard deviations with which the wanted share is good, (2 m, kinds)
    seat_um: float  # by which each half may sit wrong, also with all mirrors at their limits

    def within(self, steps: Floats, found: Sensitivities) -> "MirrorLimits":
        """The same, no limit more than its part of the deviation whose loss is known."""
        largest = _floor(steps / kinds_and_seat(found), PLACES[: steps.shape[1]])
        return replace(self, each=np.minimum(self.each, largest))


def mirror_limits(found: Sensitivities, target_mm: float, wanted: float) -> MirrorLimits:
    """Share each virtual camera's margin out to the mirrors that it depends on.

    Each kind of deviation, and the seat of the halves, gets an equal part of the margin, and each
    mirror of a virtual camera the same limit; a mirror keeps the smallest limit that its virtual
    cameras ask for. Sums are linear for `each`, and of squares for `sigma`, with which the wanted
    share of the pairs of shells is good. InputError if a virtual camera sees too little as
    designed.
    """
    margin = found.coverage - target_mm
    if margin.min() <= 0:
        raise InputError(
            f"a virtual camera sees {found.coverage.min():.2f} mm as designed, of {target_mm:g} mm "
            "that are asked for: no deviation is allowed; enlarge mirrors.margin_mm"
        )
    parts = kinds_and_seat(found)
    deviations = normal.ppf(wanted ** (1 / len(margin)))
    each = margin[:, None] / parts / _positive(found.total())
    variance = (margin / deviations)[:, None] ** 2 / parts
    sigma = np.sqrt(variance / _positive(found.total(power=2)))
    seat = margin / parts / _positive(found.seat)
    each, sigma = (_smallest(found.mirror, of[found.camera]) for of in (each, sigma))
    places = PLACES[: found.loss.shape[1]]
    return MirrorLimits(_floor(each, places), _floor(sigma, places), float(_floor(seat.min(), 1)))


def whole_margin_steps(found: Sensitivities, limits: MirrorLimits, radius: Floats) -> Floats:
    """Deviations (2 m, kinds) that would linearly take a whole margin; radii (2 m,), mm."""
    steps = kinds_and_seat(found) * np.maximum(limits.each, SMALLEST_LIMIT)
    column = KINDS.index("radius")
    steps[:, column] = np.minimum(steps[:, column], radius / 2)
    return np.asarray(steps)


def kinds_and_seat(found: Sensitivities) -> int:
    """Number of parts that a margin is shared out in."""
    return int(found.loss.shape[1]) + 1


def _positive(loss: Floats) -> Floats:
    return np.where(loss > 0, loss, np.finfo(float).tiny)


def _floor(limits: Floats, places: Ints | int) -> Floats:
    """Round down to decimal places, as the files have them."""
    scale = 10.0 ** np.asarray(places)
    return np.asarray(np.floor(limits * scale) / scale)


def _smallest(mirror: Ints, allowed: Floats) -> Floats:
    result = np.full((int(mirror.max()) + 1, allowed.shape[1]), np.inf)
    np.minimum.at(result, mirror, allowed)
    return result
