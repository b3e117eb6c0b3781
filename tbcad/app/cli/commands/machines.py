"""The built machine: simulated, calibrated, merged, drawn."""

import shlex
import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tbcad.app.cli.app import command, on_screen, print_result, result_lines
from tbcad.common.screen import paragraph, stages
from tbcad.errors import InputError
from tbcad.options.call import tell_options
from tbcad.options.machines import (
    AsBuiltOptions,
    CalibrateOptions,
    IntrinsicsOptions,
    MergeOptions,
    Preflight,
    RunOptions,
    SimulateRunOptions,
)
from tbcad.options.shared import JsonResult, exposures

if TYPE_CHECKING:
    from tbcad.rig.calibration.intrinsics.checkerboard import SolvedLens
    from tbcad.rig.calibration.run import WrittenCalibration
FAILED = 1  # exit code of a calibration that is not good enough
FEW_NAMES = 6  # of missing mirrors in a line
NOT_WHOLE = {
    "photographs_not_used": "photographs not used",
    "without_dark": "without a dark photograph of their exposure",
}


@command("simulate-run")
def simulate_run(options: SimulateRunOptions) -> int:
    """Simulate all photographs of a run by a random build of the prototype, or of the shell.

    Writes the folder that tbcad run writes, with truth.json: the build, which a calibration of
    these photographs should find.
    """
    from tbcad.rig.machine.machine import truth_file

    record = on_screen(2, "simulate_run", options).record
    count = len(record.frames) * len(record.phases)
    typer.echo(
        f"{options.out}: {count} photographs of {len(record.frames)} frames, and the build as "
        f"{' and '.join(truth_file(name) for name in record.machines)}"
    )
    return 0


@command()
def calibrate(options: CalibrateOptions, json: JsonResult = False) -> int:
    """Find the machine that took the photographs of a run, and how well its rays are known.

    Writes machine.json, calibration.json, tables of spheres, angles, rays and residuals, the
    covariance and plots. Exits with 1 where the calibration is not good enough.
    """
    written: WrittenCalibration = on_screen(4, "calibrate", options)
    found = [{"folder": str(one.folder), **one.record} for one in written.every]
    process = options.process or "fdm (the default)"
    told = (f"{one.text}\nprocess: {process}; files: {one.folder}" for one in written.every)
    print_result({"schema": "tbcad-calibrations/1", "calibrations": found}, told, json)
    return FAILED if any(one.verdict.answer == "not good" for one in written.every) else 0


@command()
def intrinsics(options: IntrinsicsOptions, json: JsonResult = False) -> int:
    """Solve the lens of a camera from photographs of a checkerboard or ChArUco board.

    Boards may be partly out of the picture. Writes focal lengths, principal point and distortion
    with their standard deviations, for tbcad calibrate --intrinsics.
    """
    out, solved = Path(options.out), on_screen(1, "intrinsics", options)
    print_result(_lens_record(solved, out), _lens_lines(solved, out), json)
    return 0


def _lens_lines(solved: "SolvedLens", file: Path) -> Iterator[str]:
    from tbcad.rig.calibration.intrinsics.checkerboard import EDGE_SHARE

    unused = paragraph(f"no board found in: {', '.join(solved.unused)}") if solved.unused else ""
    short = paragraph(
        f"corners reach {solved.reach:.0%} of the way to the picture's corners: photograph boards "
        "there too, the distortion is not known beyond"
    )
    return result_lines(
        "intrinsics",
        solved=solved,
        lens=solved.lens,
        sigma=solved.sigma,
        unused=unused,
        short=short if solved.reach < EDGE_SHARE else "",
        file=file,
    )


def _lens_record(solved: "SolvedLens", file: Path) -> dict[str, object]:
    """A solved lens for other programs, lengths in pixels."""
    lens = solved.lens
    figures = {
        name: [float(value) for value in getattr(lens, name)]
        for name in ("focal", "principal", "distortion")
    }
    unused = {"unused": list(solved.unused), "reach": solved.reach, "file": str(file)}
    return {"schema": "tbcad-intrinsics/1", **figures, **solved.facts(), **unused}


@command()
def merge(options: MergeOptions, json: JsonResult = False) -> int:
    """Merge the photographs of a run into the light field that the shell would have given.

    Writes what tbcad capture writes: both pictures at the size of the shell's, and the light field
    with the rays of the calibrated machine, for view, refocus and the studies. Mirrors without a
    usable photograph are left out and named.
    """
    record, out = on_screen(2, "merge", options), options.folder
    files = f"{out}: the light field as lightfield.h5, pictures, capture.json with all of this"
    print_result(record, [*_merge_lines(record), files], json)
    return 0


def _merge_lines(record: dict[str, Any]) -> list[str]:
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
        lines += [
            f"  {len(names)} {what}: {_few(list(names))}"
            for key, what in NOT_WHOLE.items()
            if (names := half[key])
        ]
    return lines


def _few(names: list[str]) -> str:
    more = len(names) - FEW_NAMES
    return ", ".join(names[:FEW_NAMES]) + (f" and {more} more" if more > 0 else "")


@command("as-built")
def as_built(options: AsBuiltOptions, json: JsonResult = False) -> int:
    """Write the measured spheres of a calibrated prototype as exact, coloured solids (STEP).

    The colour is the position error of a ball's centre, in micrometres; legend.png and
    deviations.csv give the scale and all figures.
    """
    record = on_screen(1, "as_built", options)
    print_result(record, result_lines("as-built", out=options.out, **record), json)
    return 0


NoPreflightOption = Annotated[bool, typer.Option("--no-preflight")]
"""Begin at once, without a look at one stop under each light for saturated and dark photographs."""
YesOption = Annotated[bool, typer.Option("--yes", "-y")]
"""Ask nothing: pin out and object turned are taken for granted."""
DryRunOption = Annotated[bool, typer.Option("--dry-run")]
"""Print what would be done, without controller and camera."""


@command()
def run(
    options: RunOptions,
    no_preflight: NoPreflightOption = False,
    preflight_only: Annotated[
        bool, typer.Option("--preflight-only", help="That look alone; nothing is kept.")
    ] = False,
    yes: YesOption = False,
    dry_run: DryRunOption = False,
    json: Annotated[
        bool, typer.Option("--json", help="With --dry-run: print it as JSON, all positions.")
    ] = False,
) -> int:
    """Drive the prototype through its stops, switch its lights, and photograph it.

    At each stop: one photograph in the dark, one by each LED, one of the lit object. Exit code 0:
    all photographs are there. 1: some are missing, or the run stopped; --resume goes on. 2: bad
    input, or the preflight finds an exposure that will not do.
    """
    options.size(), exposures(options.exposure_leds_s, options.exposure_lit_s)  # refused first
    if preflight_only and (no_preflight or options.resume):
        other = "--resume" if options.resume else "--no-preflight"
        raise InputError(f"--preflight-only goes without {other}: leave one of both out")
    if dry_run:
        from tbcad.rig.control.run import dry_run as planned
        from tbcad.rig.control.selection import dry_run_lines, dry_run_record

        found = planned(options)
        print_result(dry_run_record(found), dry_run_lines(found), json)
        return 0
    if json:
        raise InputError("--json is about --dry-run: leave it out, or add --dry-run")
    if options.port and not yes and not sys.stdin.isatty():
        raise InputError(
            "no interactive terminal to confirm the turn of the object: use --yes if the machine "
            "is ready"
        )
    from tbcad.app.api import run as photograph
    from tbcad.rig.control.selection import outcome_lines, preflight_lines

    look: Preflight = "only" if preflight_only else "off" if no_preflight else "first"
    outcome = photograph(
        replace(options, preflight=look, ask=partial(_asked, yes), show=stages, progress=_note)
    )
    words = ["tbcad", "run", options.exports, "--port", options.port, "--camera", options.camera]
    resuming = shlex.join(map(str, [*words, "--out", options.out, "--resume"]))
    lines = preflight_lines(outcome) if preflight_only else outcome_lines(outcome, resuming)
    for line in lines:
        typer.echo(line)
    return 0 if outcome.complete else 1


def _asked(yes: bool, question: str) -> bool:
    """Ask the operator, unless all is taken for granted; end of input is a no."""
    if yes:
        _note(f"{question}: taken for granted")
        return True
    try:
        return typer.confirm(f"{question}: done?", default=True, err=True)
    except typer.Abort:
        return False


def _note(text: str) -> None:
    typer.echo(text, err=True)


tell_options(__name__)
