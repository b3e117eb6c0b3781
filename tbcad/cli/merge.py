"""Merge the photographs of a run into a light field."""

from dataclasses import replace
from typing import Any

from tbcad.cli.app import command
from tbcad.cli.output_mode import print_result
from tbcad.options.machines import MergeOptions
from tbcad.options.shared import JsonResult
from tbcad.screen import stages

FEW_NAMES = 6  # of missing mirrors in a line


@command()
def merge(options: MergeOptions, json: JsonResult = False) -> int:
    """Merge the photographs of a run into the light field that the shell would have given.

    Writes what tbcad capture writes: both pictures at the size of the shell's, and the light field
    with the rays of the calibrated machine, for view, refocus and the studies. Mirrors without a
    usable photograph are left out and named.
    """
    from tbcad.api import merge as merged

    with stages(2) as screen:
        record = merged(replace(options, progress=screen.stage, detail=screen.detail))
    out = options.folder
    files = f"{out}: the light field as lightfield.h5, pictures, capture.json with all of this"
    print_result(record, [*_lines(record), files], json)
    return 0


def _lines(record: dict[str, Any]) -> list[str]:
    """The verdict first, then each camera, then what is missing and not used."""
    halves = record["based_on"]
    absent = sum(half["mirrors"] - half["mirrors_with_rays"] for half in halves.values())
    mirrors = sum(half["mirrors"] for half in halves.values())
    verdict = "complete" if not absent and len(halves) == 2 else "incomplete"
    lines = [f"{verdict}: {mirrors - absent} of {mirrors} mirrors have rays"]
    if len(halves) == 1:
        lines.append(f"only camera {next(iter(halves))}: the other run was not photographed")
    for camera, half in halves.items():
        counts = record["cameras"][camera]
        lines.append(
            f"camera {camera}: {counts['pixels_on_mirrors']} pixels on "
            f"{half['mirrors_with_rays']} mirrors, "
            f"{counts['pixels_that_see_the_capture_sphere']} see the capture sphere"
        )
        for reason, names in half["mirrors_missing"].items():
            lines.append(f"  {len(names)} missing ({_few(names)}): {reason}")
        unused = half["photographs_not_used"]
        if unused:
            lines.append(f"  {len(unused)} photographs not used: {_few(list(unused))}")
        if half["without_dark"]:
            names = half["without_dark"]
            lines.append(
                f"  {len(names)} without a dark photograph of their exposure: {_few(names)}"
            )
        if half["dark_scaled"]:
            names = half["dark_scaled"]
            lines.append(
                f"  {len(names)} whose dark photograph was exposed otherwise, and is scaled: "
                f"{_few(names)}"
            )
    return lines


def _few(names: list[str]) -> str:
    more = len(names) - FEW_NAMES
    return ", ".join(names[:FEW_NAMES]) + (f" and {more} more" if more > 0 else "")
