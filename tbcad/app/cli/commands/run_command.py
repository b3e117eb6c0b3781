"""The command that drives the machine and photographs it."""

import shlex
import sys
from dataclasses import replace
from typing import Annotated

import typer

from tbcad.app.cli.app import command
from tbcad.app.cli.output_mode import print_json
from tbcad.errors import InputError
from tbcad.options.runs import Preflight, RunOptions
from tbcad.options.shared import exposures


@command()
def run(
    options: RunOptions,
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
    options.size(), exposures(options.exposure_leds_s, options.exposure_lit_s)  # refused first
    if preflight_only and (no_preflight or options.resume):
        other = "--resume" if options.resume else "--no-preflight"
        raise InputError(f"--preflight-only goes without {other}: leave one of both out")
    if dry_run:
        from tbcad.rig.control.run import dry_run as planned
        from tbcad.rig.control.selection import dry_run_lines, dry_run_record

        found = planned(options)
        if json:
            print_json(dry_run_record(found))
        for line in dry_run_lines(found) if not json else ():
            typer.echo(line)
        return 0
    if json:
        raise InputError("--json is about --dry-run: leave it out, or add --dry-run")
    if options.port and not yes and not sys.stdin.isatty():
        raise InputError(
            "nobody can be asked to turn the object, for the input is no terminal: say --yes if "
            "the machine is ready"
        )
    from tbcad.app.api import run as photograph
    from tbcad.common.screen import stages
    from tbcad.rig.control.selection import outcome_lines, preflight_lines

    look: Preflight = "only" if preflight_only else "off" if no_preflight else "first"
    ask = _yes if yes else _asked
    outcome = photograph(replace(options, preflight=look, ask=ask, show=stages, progress=_note))
    resuming = _resuming(options)
    lines = preflight_lines(outcome) if preflight_only else outcome_lines(outcome, resuming)
    for line in lines:
        typer.echo(line)
    return 0 if outcome.complete else 1


def _resuming(options: RunOptions) -> str:
    """The command that goes on with a run."""
    words = ["tbcad", "run", options.exports, "--port", options.port, "--camera", options.camera]
    return shlex.join(map(str, [*words, "--out", options.out, "--resume"]))


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
