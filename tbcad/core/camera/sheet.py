"""The requirement sheet of a design's cameras: camera.json, and the lines that a user reads."""

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from tbcad.core.camera.requirements import (
    WIDE_OPEN,
    CameraRequirements,
    aperture_stop,
    camera_requirements,
    exposure_seconds,
    lens_for,
)
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.spec.csv_rows import Row, check_unique, positive_number, read_rows, required_text
from tbcad.core.spec.errors import SpecError

CAMERA_SIZES = ("sensor_width_mm", "sensor_height_mm", "width_px", "height_px")
CAMERA_COLUMNS = ("name", "mount", *CAMERA_SIZES, "control", "source")
LENS_SIZES = (
    *("focal_min_mm", "focal_max_mm", "f_number_min", "f_number_max"),
    *("min_focus_m", "image_circle_mm"),
)
LENS_COLUMNS = ("name", "mounts", *LENS_SIZES, "source")
MAX_VALUE = 1e5  # of any figure
_MIRRORLESS = ("Canon RF", "Nikon Z", "Sony E", "Fujifilm G")
# Mounts on which lenses of another mount sit by a plain ring, which keeps the lens's distance.
ADAPTERS = {
    "Canon EF": _MIRRORLESS,
    "Canon EF-S": ("Canon RF", "Sony E"),
    "Nikon F": (*_MIRRORLESS, "Canon EF"),
    "C": ("CS",),
}
ENOUGH = 0.999  # of an angle or of pixels: figures of makers are rounded
MAX_CLOSE_UP_DPT = 10.0  # the strongest close-up lens on sale
MAX_BLUR = 1.5  # times the least blur that a stop can reach
SCHEMA = "tbcad-camera/1"
CAMERA_FILE = "camera.json"
LUX, ISO = 10_000.0, 400.0  # of the exposure that the sheet states
DIGITS = 9
SHOWN = 6  # candidates that the lines list


@dataclass(frozen=True)
class CameraBody:
    """A camera with square pixels."""

    name: str  # maker and model
    mount: str  # of lenses
    width_mm: float  # of the sensor's picture
    height_mm: float  # of it
    width_px: float  # its columns
    height_px: float  # its rows
    control: str  # by which a computer triggers it
    source: str  # of the figures

    @property
    def pixel_mm(self) -> float:
        """Width of a pixel."""
        return self.width_mm / self.width_px


@dataclass(frozen=True)
class RectilinearLens:
    """A lens that keeps straight lines straight."""

    name: str  # maker and model
    mounts: tuple[str, ...]  # in which it is sold
    focal_min_mm: float  # shortest focal length, for a distant object
    focal_max_mm: float  # longest; the same where it does not zoom
    f_number_min: float  # fully open at the shortest focal length
    f_number_max: float  # fully stopped down
    min_focus_mm: float  # smallest distance from the sensor to what is in focus
    image_circle_mm: float  # diagonal of the sensor that it covers
    source: str  # of the figures

    def fits(self, mount: str) -> bool:
        """Whether it sits on a mount, by itself or by an adapter without optics."""
        return any(mount == own or mount in ADAPTERS.get(own, ()) for own in self.mounts)


def load_cameras(user_list: Path | None = None) -> list[CameraBody]:
    """Cameras of the built-in list, then of a user's; InputError names the line and column."""
    return [_camera(*one) for one in _rows("cameras.csv", user_list, CAMERA_COLUMNS, CAMERA_SIZES)]


def load_lenses(user_list: Path | None = None) -> list[RectilinearLens]:
    """Lenses of the built-in list, then of a user's; errors as of `load_cameras`."""
    return [_lens(*one) for one in _rows("lenses.csv", user_list, LENS_COLUMNS, LENS_SIZES)]


def _camera(where: str, row: Row) -> CameraBody:
    mount, source = (required_text(where, row, column) for column in ("mount", "source"))
    width, height, columns, rows = (
        positive_number(where, row, size, MAX_VALUE) for size in CAMERA_SIZES
    )
    return CameraBody(row["name"], mount, width, height, columns, rows, row["control"], source)


def _lens(where: str, row: Row) -> RectilinearLens:
    short, long, wide_open, stopped, metres, circle = (
        positive_number(where, row, size, MAX_VALUE) for size in LENS_SIZES
    )
    for low, high, name in ((short, long, "focal_max_mm"), (wide_open, stopped, "f_number_max")):
        if high < low:
            raise SpecError(
                f"{where}, column {name}: {high:g}, allowed is {low:g} or more: correct it"
            )
    mounts = tuple(required_text(where, row, "mounts").split("|"))
    source = required_text(where, row, "source")
    return RectilinearLens(
        row["name"], mounts, short, long, wide_open, stopped, 1000 * metres, circle, source
    )


def _rows(
    name: str, user_list: Path | None, columns: tuple[str, ...], sizes: tuple[str, ...]
) -> list[tuple[str, Row]]:
    lists: list[tuple[Path | Traversable, str]] = [(files("tbcad.core.camera") / name, name)]
    if user_list is not None:
        lists.append((user_list, str(user_list)))
    names: set[str] = set()
    rows = [row for file, shown in lists for row in read_rows(file, shown, columns, sizes)]
    for where, row in rows:
        required_text(where, row, "name")
        check_unique(where, row, "name", names)
    return rows


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
        close_up_dpt=_close_up(needed.focus_mm, focal, lens.min_focus_mm, image),
        faults=(),
    )
    return replace(one, faults=tuple(_faults(needed, one, image)))


def _close_up(focus: float, focal: float, min_focus: float, image: float) -> float:
    """Power that brings the lens's nearest focus to the one needed, dioptres; 0 where it is nearer.

    Makers count the nearest focus from the sensor. The entrance pupil of a wide-angle lens is
    farther from it than a thin lens would be, so the power is an upper bound.
    """
    if min_focus <= focus + image:
        return 0.0
    # Object and image distance of a thin lens add up to the distance that the maker states.
    nearest = (min_focus + math.sqrt(max(min_focus**2 - 4 * focal * min_focus, 0.0))) / 2
    return max(1000 / focus - 1000 / nearest, 0.0)


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


def write_camera_sheet(folder: Path, array: MirrorArray, radius: float) -> None:
    """Write camera.json: camera a's requirements, cameras with lenses of the built-in lists."""
    needed = camera_requirements(array, radius)
    best = best_lenses(needed, load_cameras(), load_lenses())
    text = json.dumps(sheet_record(needed, best), indent=1) + "\n"
    (folder / CAMERA_FILE).write_text(text, encoding="utf-8")


def best_lenses(
    needed: CameraRequirements, cameras: Sequence[CameraBody], lenses: Sequence[RectilinearLens]
) -> list[Candidate]:
    """The best lens of each camera, the best camera first; see `candidates`."""
    best: dict[str, Candidate] = {}
    for one in candidates(needed, cameras, lenses):
        best.setdefault(one.camera.name, one)
    return list(best.values())


def sheet_record(needed: CameraRequirements, found: Iterable[Candidate]) -> dict[str, Any]:
    """What camera.json holds."""
    return {
        "schema": SCHEMA,
        "requirements": _rounded(asdict(needed)),
        "exposure": {"illuminance_lux": LUX, "iso": ISO},
        "candidates": [_candidate_record(one) for one in found],
    }


def _candidate_record(one: Candidate) -> dict[str, Any]:
    figures = {
        "focal_mm": one.focal_mm,
        "pixels_across": one.pixels_across,
        "f_number": one.f_number,
        "blur_px": one.total_px,
        "close_up_dpt": one.close_up_dpt,
        "exposure_s": _exposure(one),
    }
    named = {"camera": one.camera.name, "lens": one.lens.name}
    return {**named, **_rounded(figures), "faults": list(one.faults)}


def sheet_lines(needed: CameraRequirements, found: Sequence[Candidate]) -> list[str]:
    """The verdict, what to buy by, and the first candidates; lines of at most 80 columns."""
    good = [one for one in found if not one.faults]
    verdict = f"{len(good)} of {len(found)} cameras do with a lens of the list"
    if not good:
        verdict = f"no camera of the list does: {found[0].faults[0]}" if found else "no camera"
    return [
        verdict,
        f"sensor    {needed.width_px} x {needed.height_px} pixels or more over "
        f"{needed.hfov_deg:.1f} x {needed.vfov_deg:.1f} degrees, rectilinear lens",
        f"focus     {needed.focus_mm:.0f} mm from the entrance pupil along the optical axis;",
        f"          virtual images lie from {needed.near_mm:.0f} to {needed.far_mm:.0f} mm",
        f"stop      entrance pupil {needed.pupil_mm:.2f} mm, F = focal length / "
        f"{needed.pupil_mm:.2f} mm:",
        f"          blur with diffraction {needed.total_px:.1f} pixels at both ends",
        f"light     exposures below at {LUX:g} lx on the object, ISO {ISO:g}",
        *(line for one in found[:SHOWN] for line in _candidate_lines(one)),
    ]


def _candidate_lines(one: Candidate) -> list[str]:
    figures = (
        f"  {one.focal_mm:.1f} mm, F/{one.f_number:.0f}, {one.pixels_across:.0f} pixels across, "
        f"{_exposure(one):.2g} s"
    )
    if one.close_up_dpt:
        figures += f", close-up lens +{one.close_up_dpt:.1f} dpt"
    lines = [f"{one.camera.name} with {one.lens.name}"[:80], figures]
    return lines + [f"  does not do: {'; '.join(one.faults)}"[:80]] * bool(one.faults)


def _exposure(one: Candidate) -> float:
    return exposure_seconds(one.f_number, one.magnification, LUX, ISO)


def _rounded(record: dict[str, float]) -> dict[str, float]:
    return {key: round(value, DIGITS) for key, value in record.items()}
