"""The requirement sheet of a design's cameras: camera.json, and the lines that a user reads."""

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from tbcad.core.camera.lists import (
    FLANGE_MM,
    CameraBody,
    RectilinearLens,
    load_cameras,
    load_lenses,
)
from tbcad.core.camera.requirements import (
    WIDE_OPEN,
    CameraRequirements,
    aperture_stop,
    camera_requirements,
    exposure_seconds,
    lens_for,
)
from tbcad.core.mirrors.array import MirrorArray
from tbcad.records.camera_sheet import NAME as CAMERA_FILE
from tbcad.records.camera_sheet import SCHEMA

ENOUGH = 0.999  # of an angle or of pixels: figures of makers are rounded
MAX_CLOSE_UP_DPT = 10.0  # the strongest close-up lens on sale
# Of a lens's length from its front to its entrance pupil: an estimate, for no list has it. The
# mount moves the camera along its axis.
PUPIL_OF_LENGTH = 0.3
MAX_BLUR = 1.5  # times the least blur that a stop can reach
ISO = 400.0  # of the exposure that the sheet states
LUX = 1000.0  # of its light where there are no lamps: about that of the default prototype's
DIGITS = 9
SHOWN = 6  # candidates that the lines list


@dataclass(frozen=True)
class Candidate:
    """A camera with a lens set as the design asks, and what it lacks."""

    camera: CameraBody  # the body
    lens: RectilinearLens  # on it
    focal_mm: float  # focal length to set
    magnification: float  # of what is in focus
    view: float  # share of the required angle's tangent that the sensor shows, at most 1
    pixels_across: float  # pixels over the required angle of view
    f_number: float  # to set
    total_px: float  # blur with diffraction at both ends of the depth, in pixels of the design
    close_up_dpt: float  # power of the close-up lens without which it does not focus; 0: none
    faults: tuple[str, ...]  # why it does not do; empty: it does


@dataclass(frozen=True)
class RigLight:
    """What a prototype has for its camera: light, and a mount."""

    lux: float | None = None  # on upright surfaces of the object; None: there are no lamps
    mounted: str | None = None  # camera with its lens that mount and fence are made for

    def exposure(self, one: Candidate) -> float:
        """Seconds of a mid-grey object in this light, or in LUX."""
        lux = LUX if self.lux is None else self.lux
        return exposure_seconds(one.f_number, one.magnification, lux, ISO)


def candidates(
    needed: CameraRequirements, cameras: Iterable[CameraBody], lenses: Iterable[RectilinearLens]
) -> list[Candidate]:
    """All cameras with the lenses that sit on them, the best first.

    Those that fulfil all come first, without a close-up lens before those with one, then those
    with more pixels; the others by the number of their faults.
    """
    lenses = list(lenses)
    pairs = ((camera, lens) for camera in cameras for lens in lenses if lens.fits(camera.mount))
    every = [_candidate(needed, camera, lens) for camera, lens in pairs]
    return sorted(
        every, key=lambda one: (len(one.faults), one.close_up_dpt > 0, -one.pixels_across)
    )


def _candidate(needed: CameraRequirements, camera: CameraBody, lens: RectilinearLens) -> Candidate:
    """The longest focal length that shows the whole array, as a thin lens (1/f = 1/s + 1/s')."""
    across, down = needed.half_sizes
    longest = min(camera.width_mm / (2 * across), camera.height_mm / (2 * down))
    focal = 1 / (1 / longest + 1 / needed.focus_mm)
    focal = min(max(focal, lens.focal_min_mm), lens.focal_max_mm)
    within = focal < needed.focus_mm
    image = 1 / (1 / focal - 1 / needed.focus_mm) if within else float("inf")
    f_number = min(max(focal / needed.pupil_mm, lens.f_number_min), lens.f_number_max)
    design = lens_for(math.radians(needed.hfov_deg), needed.width_px, 1.0, WIDE_OPEN)
    one = Candidate(
        camera=camera,
        lens=lens,
        focal_mm=focal,
        magnification=image / focal - 1,
        view=min(longest / image, 1.0),
        pixels_across=2 * across * image / camera.pixel_mm,
        f_number=f_number,
        total_px=aperture_stop(design, needed.depths, focal / f_number)["total_px"],
        close_up_dpt=_close_up(needed.focus_mm, focal, lens, _to_sensor(camera, lens, image)),
        faults=(),
    )
    return replace(one, faults=tuple(_faults(needed, one, image)))


def _close_up(focus: float, focal: float, lens: RectilinearLens, to_sensor: float) -> float:
    """Power that brings the lens's nearest focus to the one needed, dioptres; 0 where it is nearer.

    Makers count the nearest focus from the sensor.
    """
    min_focus = lens.min_focus_mm
    if min_focus <= focus + to_sensor:
        return 0.0
    # Object and image distance of a thin lens add up to the distance that the maker states.
    nearest = (min_focus + math.sqrt(max(min_focus**2 - 4 * focal * min_focus, 0.0))) / 2
    return max(1000 / focus - 1000 / nearest, 0.0)


def behind_pupil(camera: CameraBody, lens: RectilinearLens) -> float | None:
    """From the entrance pupil to the body's mount, mm; None of a lens whose length is not known."""
    if lens.length_mm is None:
        return None
    return (1 - PUPIL_OF_LENGTH) * lens.length_mm + lens.ring_mm(camera.mount)


def _to_sensor(camera: CameraBody, lens: RectilinearLens, image: float) -> float:
    """From the entrance pupil to the sensor, mm; of a thin lens where the sizes are not known.

    The entrance pupil of a wide-angle lens is farther from the sensor than a thin lens would be.
    """
    behind, flange = behind_pupil(camera, lens), FLANGE_MM.get(camera.mount)
    return image if behind is None or flange is None else max(image, behind + flange)


def _faults(needed: CameraRequirements, one: Candidate, image: float) -> Iterator[str]:
    if one.view < ENOUGH:
        shown = math.degrees(2 * math.atan(one.view * needed.half_sizes[0]))
        yield f"shows {shown:.1f} of {needed.hfov_deg:.1f} degrees at {one.focal_mm:g} mm"
    circle = 2 * image * one.view * math.hypot(*needed.half_sizes)
    if one.lens.image_circle_mm < ENOUGH * circle:
        yield f"image circle {one.lens.image_circle_mm:g} of {circle:.1f} mm"
    if one.pixels_across < ENOUGH * needed.width_px:
        yield f"{one.pixels_across:.0f} of {needed.width_px} pixels across the mirrors"
    if one.close_up_dpt > MAX_CLOSE_UP_DPT:
        yield f"focuses from {one.lens.min_focus_mm:g} mm"
    if one.total_px > MAX_BLUR * needed.total_px:
        yield f"F/{one.f_number:g} blurs by {one.total_px:.1f} pixels"


def write_camera_sheet(
    folder: Path, array: MirrorArray, radius: float, light: RigLight | None = None
) -> None:
    """Write camera.json: camera a's requirements, cameras with lenses of the built-in lists."""
    needed = camera_requirements(array, radius)
    best = best_lenses(needed, load_cameras(), load_lenses())
    text = json.dumps(sheet_record(needed, best, light or RigLight()), indent=1) + "\n"
    (folder / CAMERA_FILE).write_text(text, encoding="utf-8")


def best_lenses(
    needed: CameraRequirements, cameras: Sequence[CameraBody], lenses: Sequence[RectilinearLens]
) -> list[Candidate]:
    """The best lens of each camera, the best camera first; see `candidates`."""
    best: dict[str, Candidate] = {}
    for one in candidates(needed, cameras, lenses):
        best.setdefault(one.camera.name, one)
    return list(best.values())


def sheet_record(
    needed: CameraRequirements, found: Iterable[Candidate], light: RigLight
) -> dict[str, Any]:
    """What camera.json holds."""
    lux = LUX if light.lux is None else round(light.lux, 1)
    return {
        "schema": SCHEMA,
        "requirements": _rounded(asdict(needed)),
        "exposure": {"illuminance_lux": lux, "iso": ISO},
        "mounted": light.mounted,
        "candidates": [_candidate_record(one, light) for one in found],
    }


def _candidate_record(one: Candidate, light: RigLight) -> dict[str, Any]:
    figures = {
        "focal_mm": one.focal_mm,
        "pixels_across": one.pixels_across,
        "f_number": one.f_number,
        "blur_px": one.total_px,
        "close_up_dpt": one.close_up_dpt,
        "exposure_s": light.exposure(one),
    }
    named = {"camera": one.camera.name, "lens": one.lens.name}
    return {**named, **_rounded(figures), "faults": list(one.faults)}


def sheet_lines(
    needed: CameraRequirements, found: Sequence[Candidate], light: RigLight
) -> list[str]:
    """The verdict, what to buy by, and the first candidates; lines of at most 80 columns."""
    good = [one for one in found if not one.faults]
    verdict = f"{len(good)} of {len(found)} listed cameras meet the requirements"
    if found and not good:
        verdict = f"no listed camera meets the requirements: {found[0].faults[0]}"
    return [
        verdict,
        f"sensor    {needed.width_px} x {needed.height_px} pixels or more over "
        f"{needed.hfov_deg:.1f} x {needed.vfov_deg:.1f} degrees, rectilinear lens",
        f"focus     {needed.focus_mm:.0f} mm from the entrance pupil along the optical axis;",
        f"          virtual images lie from {needed.near_mm:.0f} to {needed.far_mm:.0f} mm",
        f"stop      entrance pupil {needed.pupil_mm:.2f} mm, F = focal length / "
        f"{needed.pupil_mm:.2f} mm:",
        f"          blur with diffraction {needed.total_px:.1f} pixels at both ends",
        f"light     exposures below at {light.lux or LUX:.0f} lx on the object, ISO {ISO:g}"
        + ("" if light.lux else " (no lamps)"),
        f"mount     for {light.mounted or 'none of the list: a cylinder stands in for it'}",
        *(line for one in found[:SHOWN] for line in _candidate_lines(one, light)),
    ]


def _candidate_lines(one: Candidate, light: RigLight) -> list[str]:
    figures = (
        f"  {one.focal_mm:.1f} mm, F/{one.f_number:.0f}, {one.pixels_across:.0f} pixels across, "
        f"{light.exposure(one):.2g} s"
    )
    if one.close_up_dpt:
        figures += f", close-up lens +{one.close_up_dpt:.1f} dpt"
    lines = [f"{one.camera.name} with {one.lens.name}"[:80], figures]
    return lines + [f"  does not do: {'; '.join(one.faults)}"[:80]] * bool(one.faults)


def _rounded(record: dict[str, float]) -> dict[str, float]:
    return {key: round(value, DIGITS) for key, value in record.items()}
