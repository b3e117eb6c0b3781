"""The command that drives the machine and photographs it."""

import re
import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.cli.output_mode import print_json
from tbcad.errors import InputError
from tbcad.options.lists import ExposureLeds, ExposureLit, seconds
from tbcad.options.shared import Exports

_SIZE = re.compile(r"(\d{2,5})x(\d{2,5})$")
LEAST_PX = 16


@app.command()
def run(
    folder: Exports[Path],
    port: Annotated[
        str | None,
        typer.Option(
            metavar="PORT",
            help="Serial port of the controller, such as /dev/ttyUSB0; Klipper: "
            "moonraker:http://HOST:7125.",
        ),
    ] = None,
    camera: Annotated[
        str,
        typer.Option(
            metavar="CAMERA",
            help="gphoto2: the camera on USB; command:PROGRAM ARGUMENTS, with {output} for the "
            "image's path without suffix and {exposure_s}, {exposure_ms} or {exposure_us} for the "
            "exposure; folder:PATH, where another program puts photographs.",
        ),
    ] = "gphoto2",
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder of the run, which must be new.")
    ] = Path("runs/first"),
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run in the folder of --out.")
    ] = False,
    phases: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Photographs at each stop: dark, led_1, led_2 ..., lit, with commas between; leds "
            "for all LEDs. By default all.",
        ),
    ] = None,
    stops: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Stops to photograph, such as 1-10,40. By default all."),
    ] = None,
    runs: Annotated[
        str | None,
        typer.Option(
            metavar="a|b|ab",
            help="a: object straight; b: turned by 180 degrees; ab: both, the default.",
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            metavar="WxH",
            help="Pixels of a photograph, such as 4160x3104. By default those of the design.",
        ),
    ] = None,
    timeout: Annotated[
        float,
        typer.Option(
            "--time-limit",
            "--timeout",
            metavar="S",
            min=1,
            max=3600,
            help="Seconds that command: and folder: may take for one photograph.",
        ),
    ] = 30.0,
    exposure_leds: ExposureLeds[str] = None,
    exposure_lit: ExposureLit[str] = None,
    no_preflight: Annotated[
        bool,
        typer.Option(
            "--no-preflight",
            help="Begin at once, without a look at one stop under each light for saturated and "
            "dark photographs.",
        ),
    ] = False,
    preflight_only: Annotated[
        bool, typer.Option("--preflight-only", help="That look alone; nothing is kept.")
    ] = False,
    send_settings: Annotated[
        bool,
        typer.Option(
            "--send-settings",
            help="Send the controller the settings of grbl_settings.txt that differ.",
        ),
    ] = False,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes", "-y", help="Ask nothing: pin out and object turned are taken for granted."
        ),
    ] = False,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Print what would be done, without controller and camera."),
    ] = False,
    json: Annotated[
        bool, typer.Option("--json", help="With --dry-run: print it as JSON, all positions.")
    ] = False,
) -> int:
    """Drive the prototype through its stops, switch its lights, and photograph it.

    At each stop: one photograph in the dark, one by each LED, one of the lit object. Exit code 0:
    all photographs are there. 1: some are missing, or the run stopped; --resume goes on. 2: bad
    input, or the preflight finds an exposure that will not do.
    """
    size_px = _size(size)
    leds_s = seconds("--exposure-leds", exposure_leds)
    lit_s = seconds("--exposure-lit", exposure_lit)
    if preflight_only and (no_preflight or resume):
        other = "--resume" if resume else "--no-preflight"
        raise InputError(f"--preflight-only goes without {other}: leave one of both out")
    if dry_run:
        from tbcad.control.outcome import dry_run_lines, dry_run_record
        from tbcad.control.run import RunRequest
        from tbcad.control.run import dry_run as planned
        from tbcad.records.exposure import PhaseTimes

        times = PhaseTimes(leds_s, lit_s)
        request = RunRequest(folder, out, phases, stops, runs, size_px, resume, times)
        found = planned(request)
        if json:
            print_json(dry_run_record(found))
        for line in dry_run_lines(found) if not json else ():
            typer.echo(line)
        return 0
    if json:
        raise InputError("--json is about --dry-run: leave it out, or add --dry-run")
    if port is None:
        raise InputError(
            "--port is missing: name the controller's serial port, such as /dev/ttyUSB0, or "
            "moonraker:http://HOST for Klipper, or look at what would be done with --dry-run"
        )
    if not yes and not sys.stdin.isatty():
        raise InputError(
            "nobody can be asked to turn the object, for the input is no terminal: say --yes if "
            "the machine is ready"
        )
    from tbcad.api import run as photograph
    from tbcad.control.outcome import outcome_lines, preflight_lines
    from tbcad.screen import stages

    outcome = photograph(
        folder,
        out,
        port=port,
        ask=_yes if yes else _asked,
        camera=camera,
        phases=phases,
        stops=stops,
        runs=runs,
        size_px=size_px,
        exposure_leds_s=leds_s,
        exposure_lit_s=lit_s,
        preflight="only" if preflight_only else "off" if no_preflight else "first",
        resume=resume,
        send_settings=send_settings,
        timeout_s=timeout,
        show=stages,
        progress=_note,
    )
    resuming = _resuming(folder, port, camera, out)
    lines = preflight_lines(outcome) if preflight_only else outcome_lines(outcome, resuming)
    for line in lines:
        typer.echo(line)
    return 0 if outcome.complete else 1


def _resuming(folder: Path, port: str, camera: str, out: Path) -> str:
    """The command that goes on with a run."""
    words = ["tbcad", "run", str(folder), "--port", port, "--camera", camera, "--out", str(out)]
    return shlex.join([*words, "--resume"])


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    match = _SIZE.match(text)
    width, height = (int(match[1]), int(match[2])) if match else (0, 0)
    if min(width, height) < LEAST_PX:
        raise InputError(
            f"--size is {text!r:.40}, allowed is WIDTHxHEIGHT of {LEAST_PX} pixels or more, such "
            "as 4160x3104"
        )
    return width, height


def _asked(question: str) -> bool:
    """Ask the operator; end of input is a no."""
    try:
        return typer.confirm(f"{question}: done?", default=True, err=True)
    except typer.Abort:
        return False


def _yes(question: str) -> bool:
    _note(f"{question}: taken for granted")
    return True


def _note(text: str) -> None:
    typer.echo(text, err=True)
