"""Result of a detection: the highlights to calibrate from, and those left out, with reasons.

`tbcad.rig.calibration.detection.detect.detect(run, prior)` makes it of a run that
tbcad.rig.runs has read, and of the prior of its machine, whose frames are those of the
run's record in the same order.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad.errors import InputError
from tbcad.rig.calibration.detection.matching import Expected
from tbcad.rig.calibration.detection.spots import FULL, BrightSpots, stacked
from tbcad.rig.machine.machine import Highlights
from tbcad.types import Bools, Floats, Ints

Reasons: TypeAlias = NDArray[np.str_]
LONGEST = "U64"  # of a reason
HALF = 0.5
SHORTER = (
    "photograph the LEDs again with a shorter exposure (tbcad run --exposure-leds; tbcad run "
    "--preflight-only says which is right)"
)
LONGER = (
    "see that the LEDs shine, or photograph them with a longer exposure (tbcad run "
    "--preflight-only says which is right)"
)
ELSEWHERE = "is this the run of another build, or is the camera far out of place?"
# Light over what the same sphere shows of the same LED elsewhere, in the middle: an edge that hides
# a tenth of a dome shifts its centroid by 0.16 px where its image has a radius of 2 px.
LEAST, MOST = 0.94, 1.08
FAINT = 0.1
BESIDE = 0.1  # share of a highlight's light from which another spot beside it matters


class Rejection(StrEnum):
    """Why a highlight is not used."""

    NO_PHOTOGRAPH = "no photograph"
    OUTSIDE = "outside of the picture"
    HIDDEN = "hidden, or partly"
    MISSING = "not found where it was expected"
    DOUBLE = "two highlights where one was expected"
    MERGED = "merged with another highlight"
    FAINT = "too faint: a reflection of a reflection, or nearly hidden"
    SATURATED = "saturated"
    MOVED = "the camera moved"


@dataclass(frozen=True)
class Detection:
    """The result of a detection."""

    # that can be used; their pixels are where the LEDs' own positions appear, the centroids'
    # offsets from that taken off
    highlights: Highlights
    # why others that were expected are not used, by frame, sphere and LED, from 0
    rejected: Mapping[tuple[int, int, int], str]
    # of photographs, LEDs and frames, each in one line that names what, and what is done
    faults: tuple[str, ...]
    # of each highlight by the sampling of its spot, as of `sampling_shifts`, (n, 2), or none
    sampling: Floats = field(default_factory=lambda: np.zeros(2))


def no_highlights(
    spots: BrightSpots,
    unmeasured: Counter[str],
    photographs: int,
    reasons: Reasons | None = None,
) -> InputError:
    """The error of a run without highlights, by its spots and what is bright besides.

    So many photographs are by LEDs; reasons are of all expected highlights, none where the spots
    fit no machine.
    """
    saturated = int(np.count_nonzero(spots.full >= FULL))
    if reasons is not None:
        numbers = Counter(reasons[reasons != Rejection.OUTSIDE].tolist())
    else:
        elsewhere = len(spots) - saturated
        numbers = Counter({"saturated": saturated, "where no highlight is expected": elsewhere})
    told = [f"{number} {what}" for what, number in numbers.most_common() if number]
    told += _others(unmeasured, photographs)
    step = _step(len(spots), saturated, unmeasured, photographs)
    return InputError(f"no highlights to calibrate from: {'; '.join(told)}: {step}")


def _others(unmeasured: Counter[str], photographs: int) -> list[str]:
    large, of = unmeasured["large"], f"of {photographs} photographs by LEDs"
    every = (
        (large, f"{large} larger than a highlight, {unmeasured['saturated']} of them saturated"),
        (unmeasured["flooded"], f"{unmeasured['flooded']} {of} are full of light"),
        (unmeasured["black"], f"{unmeasured['black']} {of} are black"),
    )
    return [text for number, text in every if number]


def _step(spots: int, saturated: int, unmeasured: Counter[str], photographs: int) -> str:
    """Next step, by the most frequent reason."""
    bright = spots + unmeasured["large"]
    if unmeasured["flooded"] > HALF * photographs:
        return f"most are full of light: darken the room, or {SHORTER}"
    if saturated + unmeasured["saturated"] > HALF * bright:
        return f"the light is saturated: {SHORTER}"
    if unmeasured["black"] > HALF * photographs:
        return f"most are too dark: {LONGER}"
    return ELSEWHERE


def relative_light(expected: Expected, partner: Ints, spots: BrightSpots) -> Floats:
    """Light of each paired highlight over its sphere's and LED's usual light, (n,); else NaN.

    The spot of each is -1 for none, (n,).
    """
    share = np.full(len(partner), np.nan)
    on = partner >= 0
    share[on] = spots.light[partner[on]] / expected.light[on]
    for group in (expected.led, expected.sphere):
        for number in np.unique(group[on]):
            mine = on & (group == number)
            share[mine] /= np.median(share[mine])
    return share


def verdicts(
    expected: Expected, partner: Ints, spots: BrightSpots, share: Floats, hidden: Bools
) -> Reasons:
    """Why each of n highlights, the spot of each or -1, is not used; empty if it is, (n,)."""
    found = np.full(len(partner), "", dtype=LONGEST)
    on = partner >= 0
    spot = np.where(on, partner, 0)
    tests: tuple[tuple[Bools, Rejection], ...] = (
        (on & (share > MOST), Rejection.MERGED),
        (on & (share < LEAST), Rejection.HIDDEN),
        (on & (share < FAINT), Rejection.FAINT),
        (on & _beside_others(expected, partner, spots), Rejection.MERGED),
        (on & _doubled(spots)[spot], Rejection.DOUBLE),
        (on & (spots.full[spot] >= FULL), Rejection.SATURATED),
        (~on & expected.inside, Rejection.MISSING),
        (~on & expected.inside & hidden, Rejection.HIDDEN),
        (~expected.inside, Rejection.OUTSIDE),
    )
    for wrong, reason in tests:
        found[wrong] = reason
    return found


def _doubled(spots: BrightSpots) -> Bools:
    """Which spots have another of some light within the discs that both are summed over, (m,)."""
    doubled = np.zeros(len(spots), dtype=bool)
    places = stacked(spots.frame, spots.led, spots.pixel)
    one, other = _near(places, 2 * float(spots.radius.max(initial=0)))
    reach = spots.radius[one] + spots.radius[other]
    near = ((places[one] - places[other]) ** 2).sum(axis=1) < reach**2
    for here, there in ((one, other), (other, one)):
        doubled[here[near & (spots.light[there] > BESIDE * spots.light[here])]] = True
    return doubled


def _beside_others(expected: Expected, partner: Ints, spots: BrightSpots) -> Bools:
    """Which paired highlights have that of another sphere within their disc, found or not, (n,)."""
    beside = np.zeros(len(partner), dtype=bool)
    inside = np.flatnonzero(expected.inside)
    pixel = expected.pixel + expected.centroid
    places = stacked(expected.frame[inside], expected.led[inside], pixel[inside])
    radius = np.where(partner >= 0, spots.radius[np.maximum(partner, 0)], 0.0)[inside]
    one, other = _near(places, float(radius.max(initial=0)))
    distance = ((places[one] - places[other]) ** 2).sum(axis=1)
    for here in (one, other):
        beside[inside[here[distance < radius[here] ** 2]]] = True
    return beside


def _near(places: Floats, radius: float) -> Ints:
    """Pairs of places (n, 4) within a radius, (2, p)."""
    if not len(places) or radius <= 0:
        return np.zeros((2, 0), dtype=np.int64)
    return np.asarray(cKDTree(places).query_pairs(radius, output_type="ndarray").T, np.int64)
