"""Is this good? The verdict on a calibration in words and millimetres, and what to do if not."""

import textwrap
from collections import Counter
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tbcad.common.screen import WIDTH
from tbcad.records.calibration import (
    HighlightFigures,
    OutlierRecord,
    PulledParameter,
    RayFigures,
)
from tbcad.records.run import exposure_name
from tbcad.rig.calibration.calibrate import MachineCalibration
from tbcad.rig.calibration.detection.detection import Detection, Rejection
from tbcad.rig.calibration.estimate.parameters import Block, Prior

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
    """Verdict on a calibration."""

    answer: Answer
    rays: RayFigures
    highlights: HighlightFigures
    doubts: tuple[str, ...]  # why it may not be trusted, one line each
    pulled: tuple[PulledParameter, ...]  # that the process does not explain
    steps: tuple[str, ...]


def verdict(result: MachineCalibration) -> CalibrationVerdict:
    """Judge a calibration."""
    rays, doubts, pulled = _rays(result), _doubts(result), _pulled(result)
    enough = rays.share_short_of_need <= 1 - SHARE / 100
    trusted = Answer.DOUBTFUL if doubts else Answer.GOOD
    return CalibrationVerdict(
        answer=trusted if enough else Answer.NOT_GOOD,
        rays=rays,
        highlights=_highlights(result),
        doubts=doubts,
        pulled=pulled,
        steps=_steps(result, enough, bool(doubts), bool(pulled)),
    )


def _rays(result: MachineCalibration) -> RayFigures:
    """Accuracy of rays after alignment of all, of those of one run, and without alignment."""
    known = result.rays.known
    place, turn = known.relative.place_mm, known.relative.turn_mrad
    needed = NEEDED_PIXELS * known.pixel_mm
    return RayFigures(
        mirrors=len(result.rays.ids),
        mirrors_without_frame=result.rays.absent,
        place_mm_median=np.median(place),
        place_mm_95=np.percentile(place, SHARE),
        turn_mrad_median=np.median(turn),
        turn_mrad_95=np.percentile(turn, SHARE),
        in_run_mm_median=np.median(known.in_run.place_mm),
        in_run_mrad_median=np.median(known.in_run.turn_mrad),
        in_design_mm_median=np.median(known.whole.place_mm),
        in_design_mrad_median=np.median(known.whole.turn_mrad),
        needed_mm_median=np.median(needed),
        share_short_of_need=(place > needed).mean(),
    )


def _highlights(result: MachineCalibration) -> HighlightFigures:
    found = result.found
    return HighlightFigures(
        given=len(found.highlights),
        used=int(found.used.sum()),
        rejected_by_detection=dict(sorted(Counter(result.detection.rejected.values()).items())),
        noise_factor=found.noise_factor,
        residual_px=np.sqrt((found.residual[found.used] ** 2).mean()),
        degrees_of_freedom=round(found.freedom),
    )


def verdict_text(result: MachineCalibration, judged: CalibrationVerdict) -> str:
    """The verdict as it is printed: first the answer, at most 80 columns."""
    rays, seen = judged.rays, judged.highlights
    counts = _not_used(result.detection)
    told = "; ".join(f"{number} {reason}" for reason, number in counts.most_common())
    left_out = [
        f"{one.photograph} ball {one.ball} {one.sigmas:.0f} sigma" for one in outliers(result)
    ]
    lines = [
        f"{judged.answer}: rays at the object are known to {rays.place_mm_median:.3f} mm (median; "
        f"{rays.place_mm_95:.3f} mm for {SHARE} %), {rays.needed_mm_median:.2f} mm is needed (half "
        "a pixel)",
        f"their directions to {rays.turn_mrad_median:.2f} mrad (median; {rays.turn_mrad_95:.2f} "
        f"mrad for {SHARE} %); tbcad tolerance assumes {ASSUMED_MRAD} mrad",
        f"among the rays of one run {rays.in_run_mm_median:.3f} mm, {rays.in_run_mrad_median:.2f} "
        "mrad (median); the rest is the axis of the object's half turn, which no highlight shows",
        f"where the whole machine is in its design's frame: {rays.in_design_mm_median:.3f} mm, "
        f"{rays.in_design_mrad_median:.2f} mrad (median of the rays); what all rays share only "
        "moves the picture",
        f"from {seen.used} highlights of {len(result.setup.frames)} frames, "
        f"{len(result.setup.designed.radius)} spheres and {len(result.setup.designed.leds)} LEDs",
        f"residuals {seen.residual_px:.3f} px (root mean square each way), "
        f"{seen.noise_factor:.2f} times what detection expects",
        *(
            f"halves with {half.apart} apart differ by {half.found_mm:.3f} mm, expected "
            f"{half.expected_mm:.3f} mm"
            for half in result.halves
        ),
        *([f"not used ({counts.total()}): {told}"] if told else []),
        *_listed("left out", left_out),
        *(f"doubt: {one}" for one in judged.doubts),
        *_listed("fault", result.detection.faults),
        *_listed(
            "unlike the process",
            [f"{one.parameter} {one.sigmas:+.1f} sigma" for one in judged.pulled],
        ),
        *(f"next: {step}" for step in judged.steps),
    ]
    return "\n".join(textwrap.fill(line, WIDTH, subsequent_indent="  ") for line in lines)


def outliers(result: MachineCalibration) -> list[OutlierRecord]:
    """Highlights left out, the worst first."""
    found, h = result.found, result.found.highlights
    every = (
        OutlierRecord(
            photograph=exposure_name(result.setup.frames[h.frame[i]], f"led_{h.led[i] + 1}"),
            ball=h.sphere[i] + 1,
            led=h.led[i] + 1,
            sigmas=found.sigmas_off[i],
        )
        for i in np.flatnonzero(~found.used)
    )
    return sorted(every, key=lambda one: -one.sigmas)


def parameter_names(prior: Prior) -> list[str]:
    """Names of all parameters, fixed ones too, numbers from 1."""
    return [
        " ".join([block, *(str(i + 1) for i in index)])
        for block in Block
        for index in np.ndindex(prior.sigma[block].shape)
    ]


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
        f"halves with {half.apart} apart differ {half.ratio:.1f} times as much as they should"
        for half in result.halves
        if half.ratio > MAX_RATIO
    )
    return tuple(doubts)


def _pulled(result: MachineCalibration) -> tuple[PulledParameter, ...]:
    """Parameters that are farther from their prior means than the process explains."""
    values, free = result.found.values, result.found.prior.free
    names = parameter_names(result.found.prior)
    return tuple(
        PulledParameter(parameter=names[free[i]], sigmas=values[i])
        for i in np.argsort(-np.abs(values))
        if abs(values[i]) > PULLED
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


def _not_used(detection: Detection) -> Counter[str]:
    """Numbers of highlights that detection does not use, but those outside of the picture."""
    return Counter(why for why in detection.rejected.values() if why != Rejection.OUTSIDE)


def _listed(heading: str, texts: "list[str] | tuple[str, ...]") -> list[str]:
    if not texts:
        return []
    more = f" and {len(texts) - MANY} more" if len(texts) > MANY else ""
    return [f"{heading} ({len(texts)}): {'; '.join(texts[:MANY])}{more}"]
