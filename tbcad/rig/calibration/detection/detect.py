"""Find all highlights of a run."""

from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.parallel import THREADS
from tbcad.records.run import DARK, Frame, exposure_name, same_exposure
from tbcad.rig.calibration.detection.detection import (
    Detection,
    Reasons,
    Rejection,
    no_highlights,
    relative_light,
    verdicts,
)
from tbcad.rig.calibration.detection.matching import (
    CameraMove,
    Expected,
    NoPairs,
    Room,
    find_move,
    highlights_of,
    match,
    maybe_hidden,
    sampling_shifts,
    shift_of,
)
from tbcad.rig.calibration.detection.spots import (
    ROUNDING,
    BrightSpots,
    centroid_sigmas,
    find_spots,
    gain,
    joined_spots,
    reading_variance,
)
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.runs import Image16, Run, read_photograph
from tbcad.types import Bools, Floats, Progress

DOME_MM = 1.5  # radius of a 3 mm LED
# An LED of which so few of the expected highlights are found does not shine.
DEAD = 0.02
LARGEST_8_BIT = 255.0


@dataclass(frozen=True)
class _Read:
    """Spots in a frame's photographs."""

    spots: BrightSpots
    unmeasured: Counter[str]
    photographed: Bools  # which LEDs' photographs could be read, (l,)
    faults: tuple[str, ...]  # of the others, and of the dark one
    dark: Image16 | None  # the dark photograph, if it could be read


def detect(
    run: Run,
    prior: Prior,
    room: Room | None = None,
    dome: float = DOME_MM,
    progress: Progress = lambda _: None,
) -> Detection:
    """Find all highlights of a run, and say of each that is not used why.

    The prior's frames are those of the run's record. An object may fill a room, None where nothing
    stands between LEDs and spheres; LEDs have domes of a radius in mm. InputError: no highlights
    are found, or the run has no phases of single LEDs.
    """
    frames, machine = run.record.frames, prior.mean
    if not any(phase.startswith("led_") for phase in run.record.phases):
        raise InputError(f"{run.folder} has no photographs of single LEDs: photograph them too")
    read = _read_frames(run, len(machine.leds), progress)
    spots = joined_spots([one.spots for one in read])
    photographed = np.array([one.photographed for one in read])
    faults = [*run.faults.values(), *(fault for one in read for fault in one.faults)]
    nothing = partial(
        no_highlights,
        unmeasured=sum((one.unmeasured for one in read), Counter[str]()),
        photographs=int(photographed.sum()),
    )
    try:
        expected, partner, found = match(prior, spots, dome, progress)
    except NoPairs:
        raise nothing(spots) from None
    counts = np.bincount(spots.frame, minlength=len(frames)).astype(np.float64)
    move = find_move(found, len(frames), counts)
    if move is not None:
        left_out = spots.only(~move.kept[spots.frame])
        spots = spots.only(move.kept[spots.frame])
        expected, partner, found = match(prior, spots, dome, progress)
        faults.append(_move_line(frames, move, shift_of(expected, left_out)))
    hidden = maybe_hidden(found.machine, expected, room)
    share = relative_light(expected, partner, spots)
    reasons = verdicts(expected, partner, spots, share, hidden)
    inside = expected.inside
    reasons[inside & ~photographed[expected.frame, expected.led]] = Rejection.NO_PHOTOGRAPH
    if move is not None:
        reasons[inside & ~move.kept[expected.frame]] = Rejection.MOVED
    faults += _dead_leds(len(machine.leds), expected, reasons)
    used = reasons == ""
    if not used.any():
        raise nothing(spots, reasons=reasons)
    paired = np.where(used, partner, -1)
    sigma = _sigmas(spots.only(np.unique(paired[used])), spots, read)
    highlights = highlights_of(expected, paired, spots, sigma[np.maximum(partner, 0)])
    places = np.column_stack([expected.frame, expected.sphere, expected.led])[~used].tolist()
    rejected = dict(zip(map(tuple, places), reasons[~used].tolist(), strict=True))
    sampling = sampling_shifts(expected, paired, spots)
    return Detection(highlights, rejected, tuple(faults), sampling)


def _read_frames(run: Run, leds: int, progress: Progress) -> list[_Read]:
    times = [
        one.exposure_s
        for one in run.exposures.values()
        if one.phase.startswith("led_") and one.exposure_s
    ]
    usual = float(np.median(times)) if times else None
    frames = run.record.frames
    darks = (_photograph(run, frame, DARK, usual)[0] for frame in frames)
    spare = next((image for image in darks if image is not None), None)  # hot pixels stay
    found: list[_Read] = []
    with ThreadPoolExecutor(THREADS) as pool:
        read = partial(_read_frame, run, leds, usual, spare)
        for one in pool.map(read, range(len(frames))):
            found.append(one)
            progress(f"frame {len(found)} of {len(frames)}")
    return found


def _read_frame(
    run: Run, leds: int, usual: float | None, spare: Image16 | None, number: int
) -> _Read:
    frame = run.record.frames[number]
    own, fault = _photograph(run, frame, DARK, usual)
    faults = [] if fault is None else [fault]
    if own is None:
        what = "without one" if spare is None else "with that of another frame"
        faults.append(f"{exposure_name(frame, DARK)} is not there: its frame goes on {what}")
    found, there = [], np.zeros(leds, dtype=bool)
    for led in range(leds):
        image, fault = _photograph(run, frame, f"led_{led + 1}", usual)
        if fault is not None:
            faults.append(fault)
        if image is not None:
            there[led] = True
            found.append(find_spots(image, spare if own is None else own, number, led))
    spots, unmeasured = joined_spots([one for one, _ in found]), (other for _, other in found)
    whole = sum(unmeasured, Counter[str]())
    return _Read(spots, whole, there, tuple(faults), own if number < 2 else None)


def _photograph(
    run: Run, frame: Frame, phase: str, usual: float | None
) -> tuple[Image16 | None, str | None]:
    """A photograph, or why it cannot be read; neither where the run's faults say so.

    Of another exposure time than that of most photographs by LEDs, s, it is not used.
    """
    exposure = run.exposure(frame, phase)
    if exposure is None:
        return None, None
    if not same_exposure(exposure.exposure_s, usual):
        return None, (
            f"{exposure_name(frame, phase)} was exposed for {exposure.exposure_s:g} s and not for "
            f"{usual:g} s as most photographs by LEDs: it is not used"
        )
    try:
        return read_photograph(run, exposure), None
    except InputError as error:
        return None, str(error)


def _move_line(frames: tuple[Frame, ...], move: CameraMove, shift: Floats) -> str:
    before, after = (exposure_name(frames[move.first - k], "")[:-1] for k in (1, 0))
    far = np.hypot(*shift)
    how = f"by {far:.2f} px" if np.isfinite(far) else "so far that its highlights are not found"
    kept = int(move.kept.sum())
    return (
        f"the camera moved between {before} and {after}, {how}: the {kept} frames "
        f"{'after' if move.kept[-1] else 'before'} that are used, the others are not"
    )


def _dead_leds(leds: int, expected: Expected, reasons: Reasons) -> list[str]:
    """Lines on LEDs that do not shine, of those that are photographed."""
    counted = ~np.isin(reasons, [Rejection.OUTSIDE, Rejection.NO_PHOTOGRAPH, Rejection.MOVED])
    absent = np.isin(reasons, [Rejection.MISSING, Rejection.HIDDEN])
    of = partial(np.bincount, minlength=leds)
    every, dark = of(expected.led[counted]), of(expected.led[counted & absent])
    return [
        f"LED {led + 1} shines in no photograph: the others are used; see to its wires"
        for led in np.flatnonzero(dark > (1 - DEAD) * every).tolist()
    ]


def _sigmas(good: BrightSpots, spots: BrightSpots, read: list[_Read]) -> Floats:
    """Standard deviation of all spots' centroids, pixels, (m,)."""
    darks = [one.dark for one in read if one.dark is not None]
    reading = reading_variance(*darks[:2]) if len(darks) > 1 else ROUNDING
    largest = float(np.iinfo(darks[0].dtype).max) if darks else LARGEST_8_BIT
    return centroid_sigmas(spots, reading, gain(good, reading, largest))
