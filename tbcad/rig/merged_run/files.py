"""The folder of a merge: pictures and light field as of a capture, and what they are based on."""

from pathlib import Path
from typing import Any

from tbcad.light.simulate.capture.files import capture_record, write_cameras, write_record
from tbcad.light.simulate.capture.light_field import RAY_SIGMAS
from tbcad.records.exposure import LIT, exposure_name
from tbcad.rig.merged_run.merge import HalfMerge, Merge
from tbcad.types import Progress


def write_merge(folder: Path, merge: Merge, progress: Progress) -> dict[str, Any]:
    """Merge and write all files into a folder, and return its record.

    Args:
        folder: exists, and is the caller's to replace.
        merge: what to merge.
        progress: called with each step.
    """
    record = capture_record(merge.facts)
    stored = {**record, RAY_SIGMAS: merge.ray_sigma_mm}  # which would fill capture.json
    write_cameras(folder, merge.cameras(progress), merge.capture_mm, stored)
    record["based_on"] = {half.camera_id: based_on(half) for half in merge.halves}
    write_record(folder, record)
    return record


def based_on(half: HalfMerge) -> dict[str, Any]:
    """What a camera's picture is based on, after its merge, for capture.json."""
    missing = half.missing_mirrors()
    run, known = half.photographs.run, [f for f in half.photographs.frames if f is not None]
    phases = LIT, half.photographs.dark_phase
    names = {exposure_name(frame, phase) for frame in known for phase in phases}
    unread = {
        exposure_name(frame, LIT): half.photographs.missing[stop]
        for stop, frame in enumerate(half.photographs.frames)
        if frame is not None and stop in half.photographs.missing
    }
    return {
        "mirrors": len(half.pixels),
        "mirrors_with_rays": int((half.pixels > 0).sum()),
        "stops": len(half.photographs.frames),
        "stops_used": len(known) - len(unread),
        "mirrors_missing": {
            reason: [f"{half.camera_id}{number:04d}" for number in numbers]
            for reason, numbers in missing.items()
        },
        "photographs_not_used": {name: fault for name, fault in run.faults.items() if name in names}
        | unread,
        "without_dark": sorted(half.photographs.without_dark),
        "dark_scaled": sorted(half.photographs.dark_scaled),
    }
