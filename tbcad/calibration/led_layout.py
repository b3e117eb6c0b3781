"""Where a number of LEDs tells most: found among places in the stage's room.

LEDs come in pairs half a turn about z apart, so that the object's half turn between both runs
leaves their shadows as they were. Pairs are added one by one, each where it helps most; then each
is moved once more, until none gets better.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tbcad.types import Floats, Progress

RINGS, AZIMUTHS, HEIGHTS = 2, 18, 5  # of the places that are tried; azimuths over half a turn
HALF_TURN = np.array([-1.0, -1.0, 1.0])
MAX_ROUNDS = 6
DIGITS = 2  # of places in mm


@dataclass(frozen=True)
class LedRoom:
    """The room for LEDs on a stage.

    Attributes:
        inner: least distance from the axis, mm.
        outer: radius about the origin within which an LED and its pillar stay, mm.
        lowest: least height z, mm.
        apart: least distance of two pillars' axes, mm.
        pillar: radius of a pillar, mm.
    """

    inner: float
    outer: float
    lowest: float
    apart: float
    pillar: float

    def places(self) -> Floats:
        """Places that are tried: one of each pair, mm, (p, 3)."""
        azimuth = np.pi * np.arange(AZIMUTHS) / AZIMUTHS
        highest = np.sqrt(self.outer**2 - (self.inner + self.pillar) ** 2)
        rows = []
        for z in np.linspace(self.lowest, highest, HEIGHTS):
            farthest = np.sqrt(self.outer**2 - z**2) - self.pillar
            for radius in np.unique(np.linspace(self.inner, max(farthest, self.inner), RINGS)):
                rows.append(
                    np.column_stack(
                        [
                            radius * np.cos(azimuth),
                            radius * np.sin(azimuth),
                            np.full(AZIMUTHS, z),
                        ]
                    )
                )
        return np.round(np.concatenate(rows), DIGITS) + 0.0

    def fits(self, places: Floats, chosen: list[int], new: int) -> bool:
        """Whether a pair's pillars are clear of each other and of the chosen ones."""
        pair = _pair(places[new])[:, :2]
        others = [_pair(places[one])[:, :2] for one in chosen]
        for other in [pair[1:], *others]:
            gaps = np.linalg.norm(pair[:1, None] - other[None], axis=2)
            if gaps.min() < self.apart:
                return False
        return True


def with_partners(places: Floats) -> Floats:
    """Places and, after all of them, those half a turn apart, (2 p, 3)."""
    return np.concatenate([places, places * HALF_TURN])


def best_layout(
    room: LedRoom,
    places: Floats,
    number: int,
    cost: Callable[[list[int]], float],
    progress: Progress = lambda _: None,
) -> list[int]:
    """Numbers of so many LEDs among `with_partners(places)` that cost least."""
    p = len(places)

    def of_pairs(pairs: list[int]) -> float:
        return cost([*pairs, *(one + p for one in pairs)])

    def best(others: list[int]) -> int:
        fitting = [one for one in range(p) if room.fits(places, others, one)]
        return min(fitting, key=lambda one: of_pairs([*others, one]))

    pairs: list[int] = []
    for _ in range(number // 2):
        pairs.append(best(pairs))
        progress(f"{2 * len(pairs)} LEDs placed")
    for _ in range(MAX_ROUNDS):
        before = list(pairs)
        for k in range(len(pairs)):
            pairs[k] = best(pairs[:k] + pairs[k + 1 :])
        if pairs == before:
            break
    return [*pairs, *(one + p for one in pairs)]


def _pair(place: Floats) -> Floats:
    return np.stack([place, place * HALF_TURN])
