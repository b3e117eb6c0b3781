"""Is this good? The verdict on a calibration in words and millimetres, and what to do if not."""

import textwrap
from collections import Counter
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tbcad.common.screen import WIDTH
from tbcad.records.run import exposure_name
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.detection.detection import Detection, Rejection
from tbcad.rig.calibration.estimate.parameters import Block, Prior
from tbcad.types import Floats

NEEDED_PIXELS = 0.5
"""Of a photograph's pixel at the object: beyond, calibration blurs more than the pixels do."""
SHARE = 95  # percent of the rays that must be as good as that
ASSUMED_MRAD = 0.5  # that tbcad tolerance takes without --calibrated-mrad
MAX_NOISE, MAX_OUTLIERS = 3.0, 0.05  # noise over what is said, share left out: above, be suspicious
MAX_RATIO = 2.0  # of what halves differ by to what they should
PULLED = 5.0  # prior standard deviations: the process does not explain an error as large
MANY = 5  # names in a line
MOST_SATURATED = 0.1  # share of the highlights in the picture: more is too long an exposure


class Answer(StrEnum):
    """The verdict in a word."""

    GOOD = "good"
    DOUBTFUL = "doubtful"
    NOT_GOOD = "not good"


@dataclass(frozen=True)
class CalibrationVerdict:
    """What to think of a calibration."""

    answer: Answer
    # root mean square error of the rays at the object's centre, median and 95 %, mm, besides a
    # motion of all of them
    place_mm: tuple[float, float]
    turn_mrad: tuple[float, float]  # of their directions, mrad
    in_run: tuple[float, float]  # the same of both among the rays of one run, medians, mm and mrad
    whole_mm: tuple[float, float]  # the same in the frame of the design, mm
    whole_mrad: tuple[float, float]  # likewise, mrad
    needed_mm: float  # half a pixel at the object, median of the mirrors, mm
    short: float  # share of the rays that are less well known than half of their pixel
    doubts: tuple[str, ...]  # why it may not be trusted, one line each
    # parameters that the process does not explain, by name and prior deviations
    pulled: tuple[tuple[str, float], ...]
    steps: tuple[str, ...]


def verdict(result: MachineCalibration) -> CalibrationVerdict:
    """Judge a calibration."""
    known = result.rays.known
    short = float((known.relative.place_mm > NEEDED_PIXELS * known.pixel_mm).mean())
    doubts = _doubts(result)
    pulled = _pulled(result)
    enough = short <= 1 - SHARE / 100
    trusted = Answer.DOUBTFUL if doubts else Answer.GOOD
    return CalibrationVerdict(
        answer=trusted if enough else Answer.NOT_GOOD,
        place_mm=_median_and_most(known.relative.place_mm),
        turn_mrad=_median_and_most(known.relative.turn_mrad),
        in_run=(float(np.median(known.in_run.place_mm)), float(np.median(known.in_run.turn_mrad))),
        whole_mm=_median_and_most(known.whole.place_mm),
        whole_mrad=_median_and_most(known.whole.turn_mrad),
        needed_mm=NEEDED_PIXELS * float(np.median(known.pixel_mm)),
        short=short,
        doubts=doubts,
        pulled=pulled,
        steps=_steps(result, enough, bool(doubts), bool(pulled)),
    )


def verdict_text(result: MachineCalibration, judged: CalibrationVerdict) -> str:
    """The verdict as it is printed: first the answer, at most 80 columns."""
    found = result.found
    place, turn = judged.place_mm, judged.turn_mrad
    residual = float(np.sqrt((found.residual[found.used] ** 2).mean()))
    counts = _not_used(result.detection)
    told = "; ".join(f"{number} {reason}" for reason, number in counts.most_common())
    left_out = [
        f"{name} ball {ball} {sigma:.0f} sigma" for name, ball, _, sigma in outliers(result)
    ]
    lines = [
        f"{judged.answer}: rays at the object are known to {place[0]:.3f} mm (median; "
        f"{place[1]:.3f} mm for {SHARE} %), {judged.needed_mm:.2f} mm is needed (half a pixel)",
        f"their directions to {turn[0]:.2f} mrad (median; {turn[1]:.2f} mrad for {SHARE} %); tbcad "
        f"tolerance assumes {ASSUMED_MRAD} mrad",
        f"among the rays of one run {judged.in_run[0]:.3f} mm, {judged.in_run[1]:.2f} mrad "
        "(median); the rest is the axis of the object's half turn, which no highlight shows",
        f"where the whole machine is in its design's frame: {judged.whole_mm[0]:.3f} mm, "
        f"{judged.whole_mrad[0]:.2f} mrad (median of the rays); what all rays share only moves the "
        "picture",
        f"from {int(found.used.sum())} highlights of {len(result.setup.frames)} frames, "
        f"{len(result.setup.designed.radius)} spheres and {len(result.setup.designed.leds)} LEDs",
        f"residuals {residual:.3f} px (root mean square each way), "
        f"{found.noise_factor:.2f} times what detection expects",
        *(
            f"halves with {half.by} apart differ by {half.found_mm:.3f} mm, expected "
            f"{half.expected_mm:.3f} mm"
            for half in result.halves
        ),
        *([f"not used ({counts.total()}): {told}"] if told else []),
        *_listed("left out", left_out),
        *(f"doubt: {one}" for one in judged.doubts),
        *_listed("fault", result.detection.faults),
        *_listed("unlike the process", [f"{n} {s:+.1f} sigma" for n, s in judged.pulled]),
        *(f"next: {step}" for step in judged.steps),
    ]
    return "\n".join(textwrap.fill(line, WIDTH, subsequent_indent="  ") for line in lines)


def outliers(result: MachineCalibration) -> list[tuple[str, int, int, float]]:
    """Photograph, ball and LED from 1, and deviations, of highlights left out, the worst first."""
    found, h = result.found, result.found.highlights
    wrong = np.flatnonzero(~found.used)
    names = [
        (
            exposure_name(result.setup.frames[h.frame[i]], f"led_{h.led[i] + 1}"),
            int(h.sphere[i]) + 1,
            int(h.led[i]) + 1,
            float(found.sigmas_off[i]),
        )
        for i in wrong
    ]
    return sorted(names, key=lambda one: -one[3])


def parameter_names(prior: Prior) -> list[str]:
    """Names of all parameters, fixed ones too, numbers from 1."""
    names = []
    for block in Block:
        shape = prior.sigma[block].shape
        for index in np.ndindex(shape):
            names.append(" ".join([block, *(str(i + 1) for i in index)]))
    return names


def _median_and_most(values: Floats) -> tuple[float, float]:
    median, most = np.percentile(values, [50, SHARE])
    return float(median), float(most)


def _doubts(result: MachineCalibration) -> tuple[str, ...]:
    found = result.found
    share = float((~found.used).mean())
    doubts = []
    if found.noise_factor > MAX_NOISE:
        doubts.append(
            f"residuals are {found.noise_factor:.1f} times what detection expects: the model of "
            "the machine or of the lens does not fit"
        )
    if share > MAX_OUTLIERS:
        doubts.append(f"{share:.0%} of the highlights are outliers")
    doubts.extend(
        f"halves with {half.by} apart differ {half.ratio:.1f} times as much as they should"
        for half in result.halves
        if half.ratio > MAX_RATIO
    )
    return tuple(doubts)


def _pulled(result: MachineCalibration) -> tuple[tuple[str, float], ...]:
    """Parameters that are farther from their prior means than the process explains."""
    found = result.found
    names = parameter_names(found.prior)
    worst = np.argsort(-np.abs(found.values))
    return tuple(
        (names[found.prior.free[i]], float(found.values[i]))
        for i in worst
        if abs(found.values[i]) > PULLED
    )


def _steps(
    result: MachineCalibration, enough: bool, doubted: bool, pulled: bool
) -> tuple[str, ...]:
    steps = []
    if result.detection.faults:
        steps.append("photograph what is missing again: tbcad run --resume")
    counts, used = _not_used(result.detection), len(result.detection.highlights)
    if counts[Rejection.SATURATED] > MOST_SATURATED * (used + counts.total()):
        steps.append(
            f"{counts[Rejection.SATURATED]} highlights are saturated: photograph the LEDs again "
            "with a shorter exposure (tbcad run --exposure-leds; --preflight-only says which is "
            "right)"
        )
    elif not enough:
        steps.append(
            "measure the caps' radii and give them as --measured, give the lens as --intrinsics "
            "(tbcad intrinsics), or use more LEDs (docs/calibration.md says what each brings)"
        )
    if doubted:
        steps.append(
            "look at the plot of residuals: a pattern over the picture is the lens (--intrinsics), "
            "one ball's arrows are that ball, one photograph's are a shock"
        )
    if pulled:
        steps.append("re-seat these parts, or name the process that made them with --process")
    return tuple(steps or ["tbcad merge"])


def _not_used(detection: Detection) -> Counter[Rejection]:
    """Numbers of highlights that detection does not use, but those outside of the picture."""
    reasons = (rejected.reason for rejected in detection.rejected)
    return Counter(reason for reason in reasons if reason is not Rejection.OUTSIDE)


def _listed(heading: str, texts: "list[str] | tuple[str, ...]") -> list[str]:
    if not texts:
        return []
    more = f" and {len(texts) - MANY} more" if len(texts) > MANY else ""
    return [f"{heading} ({len(texts)}): {'; '.join(texts[:MANY])}{more}"]
