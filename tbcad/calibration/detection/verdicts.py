"""Which highlights can be trusted, and why the others cannot."""

import numpy as np
from scipy.spatial import cKDTree

from tbcad.calibration.detection.detection import Reason
from tbcad.calibration.detection.expected import Expected
from tbcad.calibration.detection.spots import FULL, Spots
from tbcad.types import Bools, Floats, Ints

# Light over what the same sphere shows of the same LED elsewhere, in the middle: an edge that hides
# a tenth of a dome shifts its centroid by 0.16 px where its image has a radius of 2 px.
LEAST, MOST = 0.94, 1.08
FAINT = 0.1
BESIDE = 0.1  # share of a highlight's light from which another spot beside it matters
PHOTOGRAPH_PX = 1e5  # apart: photographs in one tree


def relative_light(expected: Expected, partner: Ints, spots: Spots, exposure: Floats) -> Floats:
    """Light of each paired highlight over its sphere's and LED's usual light, (n,); else NaN.

    Args:
        expected: highlights.
        partner: the spot of each, or -1, (n,).
        spots: all.
        exposure: of each spot's photograph, over the usual one, (m,).
    """
    share = np.full(len(partner), np.nan)
    on = partner >= 0
    spot = partner[on]
    share[on] = spots.light[spot] / (exposure[spot] * expected.light[on])
    for group in (expected.led, expected.sphere):
        for number in np.unique(group[on]):
            mine = on & (group == number)
            share[mine] /= np.median(share[mine])
    return share


def verdicts(
    expected: Expected, partner: Ints, spots: Spots, share: Floats, hidden: Bools
) -> list[Reason | None]:
    """Why each highlight is not used; None where it is.

    Args:
        expected: highlights.
        partner: the spot of each, or -1, (n,).
        spots: all.
        share: see `relative_light`.
        hidden: which an object may hide, (n,).
    """
    found: list[Reason | None] = [None] * len(partner)
    on = partner >= 0
    spot = np.where(on, partner, 0)
    tests: tuple[tuple[Bools, Reason], ...] = (
        (on & (share > MOST), Reason.MERGED),
        (on & (share < LEAST), Reason.HIDDEN),
        (on & (share < FAINT), Reason.FAINT),
        (on & _beside_others(expected, partner, spots), Reason.MERGED),
        (on & _doubled(spots)[spot], Reason.DOUBLE),
        (on & (spots.full[spot] >= FULL), Reason.SATURATED),
        (~on & expected.inside, Reason.MISSING),
        (~on & expected.inside & hidden, Reason.HIDDEN),
        (~expected.inside, Reason.OUTSIDE),
    )
    for wrong, reason in tests:
        for number in np.flatnonzero(wrong).tolist():
            found[number] = reason
    return found


def _doubled(spots: Spots) -> Bools:
    """Which spots have another of some light within the discs that both are summed over, (m,)."""
    doubled = np.zeros(len(spots), dtype=bool)
    places = np.column_stack([spots.pixel, PHOTOGRAPH_PX * spots.frame, PHOTOGRAPH_PX * spots.led])
    for one, other in _near(places, 2 * float(spots.radius.max(initial=0))):
        reach = spots.radius[one] + spots.radius[other]
        near = ((places[one] - places[other]) ** 2).sum(axis=1) < reach**2
        for here, there in ((one, other), (other, one)):
            doubled[here[near & (spots.light[there] > BESIDE * spots.light[here])]] = True
    return doubled


def _beside_others(expected: Expected, partner: Ints, spots: Spots) -> Bools:
    """Which paired highlights have that of another sphere within their disc, found or not, (n,)."""
    beside = np.zeros(len(partner), dtype=bool)
    inside = np.flatnonzero(expected.inside)
    places = np.column_stack(
        [
            (expected.pixel + expected.centroid)[inside],
            PHOTOGRAPH_PX * expected.frame[inside],
            PHOTOGRAPH_PX * expected.led[inside],
        ]
    )
    radius = np.where(partner >= 0, spots.radius[np.maximum(partner, 0)], 0.0)[inside]
    for one, other in _near(places, float(radius.max(initial=0))):
        distance = ((places[one] - places[other]) ** 2).sum(axis=1)
        for here in (one, other):
            beside[inside[here[distance < radius[here] ** 2]]] = True
    return beside


def _near(places: Floats, radius: float) -> list[tuple[Ints, Ints]]:
    """Pairs of places (n, 4) within a radius."""
    if not len(places) or radius <= 0:
        return []
    pairs = cKDTree(places).query_pairs(radius, output_type="ndarray").astype(np.int64)
    return [(pairs[:, 0], pairs[:, 1])]
