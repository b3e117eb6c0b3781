"""The requirement sheet of a design's cameras: camera.json, and the lines that a user reads."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tbcad.camera.candidates import Candidate, candidates
from tbcad.camera.catalogue import CameraBody, RectilinearLens, load_cameras, load_lenses
from tbcad.camera.requirements import CameraRequirements, camera_requirements, exposure_seconds
from tbcad.mirrors.array import MirrorArray

SCHEMA = "tbcad-camera/1"
CAMERA_FILE = "camera.json"
LUX, ISO = 10_000.0, 400.0  # of the exposure that the sheet states
DIGITS = 9
SHOWN = 6  # candidates that the lines list


def write_camera_sheet(folder: Path, array: MirrorArray, radius: float) -> None:
    """Write camera.json: the requirements, and cameras with lenses of the built-in lists.

    Args:
        folder: of the export.
        array: camera a and its mirrors.
        radius: of the capture sphere, mm.
    """
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
        "candidates": [
            {
                "camera": one.camera.name,
                "lens": one.lens.name,
                **_rounded(
                    {
                        "focal_mm": one.focal_mm,
                        "pixels_across": one.pixels_across,
                        "f_number": one.f_number,
                        "blur_px": one.total_px,
                        "close_up_dpt": one.close_up_dpt,
                        "exposure_s": _exposure(one),
                    }
                ),
                "faults": list(one.faults),
            }
            for one in found
        ],
    }


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
