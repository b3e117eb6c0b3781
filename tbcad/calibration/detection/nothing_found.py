"""Why a run shows no highlights to calibrate from: numbers by reason, and the next step."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from tbcad.calibration.detection.detection import Reason
from tbcad.calibration.detection.spots import FULL, Spots, Unmeasured
from tbcad.errors import InputError

HALF = 0.5
SHORTER = (
    "photograph the LEDs again with a shorter exposure (tbcad run --exposure-leds; tbcad run "
    "--preflight-only says which is right)"
)
LONGER = (
    "see that the LEDs shine, or photograph them with a longer exposure (tbcad run "
    "--preflight-only says which is right)"
)
ELSEWHERE = "is this the run of another export, or is the camera far out of place?"


def no_highlights(
    spots: Spots, unmeasured: Unmeasured, photographs: int, reasons: Sequence[Reason | None] = ()
) -> InputError:
    """The error of a run without highlights.

    Args:
        spots: of all photographs.
        unmeasured: what is bright besides.
        photographs: number of those by LEDs.
        reasons: of all expected highlights; none where the spots fit no machine.
    """
    saturated = int(np.count_nonzero(spots.full >= FULL))
    if reasons:
        numbers = Counter(str(reason) for reason in reasons if reason is not None)
        del numbers[Reason.OUTSIDE]
    else:
        elsewhere = len(spots) - saturated
        numbers = Counter({"saturated": saturated, "where no highlight is expected": elsewhere})
    told = [f"{number} {what}" for what, number in numbers.most_common() if number]
    told += _others(unmeasured, photographs)
    step = _step(len(spots), saturated, unmeasured, photographs)
    return InputError(f"no highlights to calibrate from: {'; '.join(told)}: {step}")


def _others(unmeasured: Unmeasured, photographs: int) -> list[str]:
    large, of = unmeasured.large, f"of {photographs} photographs by LEDs"
    every = (
        (large, f"{large} larger than a highlight, {unmeasured.saturated} of them saturated"),
        (unmeasured.flooded, f"{unmeasured.flooded} {of} are full of light"),
        (unmeasured.black, f"{unmeasured.black} {of} are black"),
    )
    return [text for number, text in every if number]


def _step(spots: int, saturated: int, unmeasured: Unmeasured, photographs: int) -> str:
    """What to do, by what there is most of."""
    bright = spots + unmeasured.large
    if unmeasured.flooded > HALF * photographs:
        return f"most are full of light: darken the room, or {SHORTER}"
    if saturated + unmeasured.saturated > HALF * bright:
        return f"the light is saturated: {SHORTER}"
    if unmeasured.black > HALF * photographs:
        return f"most are too dark: {LONGER}"
    return ELSEWHERE
