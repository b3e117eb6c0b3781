"""Simulate the photographs of a run by a random build of the prototype."""

from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.cli.exposure_options import ExposureLeds, ExposureLit, seconds
from tbcad.errors import InputError
from tbcad.options.checks import check_is_export, check_is_object
from tbcad.options.shared import Exports, ObjectFile, UnitOption, UpOption
from tbcad.screen import stages

MOST_NOISE = 100.0
MOST_STOPS = 1_000_000  # as a run's record may have
MOST_BRIGHTNESS = 10_000.0


@app.command(name="simulate-run")
def simulate_run(
    folder: Exports[Path],
    process: Annotated[
        str,
        typer.Option(
            help="fdm, sls, sla, cnc, diamond, or a TOML file: how the prototype is built."
        ),
    ] = "fdm",
    seed: Annotated[int, typer.Option(min=0, help="Of the build and of all noise.")] = 0,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="Folder for the run; it must not hold anything.")
    ] = Path("run"),
    object_file: ObjectFile[Path] = None,
    up: UpOption = None,
    unit: UnitOption = None,
    stops: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Only these stops, as 1,5,20-30; by default all."),
    ] = None,
    phases: Annotated[
        str | None,
        typer.Option(
            metavar="LIST", help="Only these phases, as dark,led_1,led_2; by default all."
        ),
    ] = None,
    noise: Annotated[
        float, typer.Option(min=0, max=MOST_NOISE, help="Factor of all noise; 0 for none.")
    ] = 1.0,
    bits: Annotated[
        int, typer.Option(help="Of each pixel's number: 8 in colour, or 16 without.")
    ] = 8,
    shell: Annotated[
        bool,
        typer.Option(
            "--shell", help="Both cameras of the shell, one photograph each, not the prototype."
        ),
    ] = False,
    led_brightness: Annotated[
        float,
        typer.Option(
            metavar="FACTOR",
            min=0.001,
            max=MOST_BRIGHTNESS,
            help="Brightness of the LEDs. 1: at 1 s they fill 0.9 of a pixel, as the lit object's "
            "white does; of a real LED some 100.",
        ),
    ] = 1.0,
    exposure_leds: ExposureLeds = None,
    exposure_lit: ExposureLit = None,
    perfect: Annotated[
        bool,
        typer.Option(
            "--perfect",
            help="A build without errors that gravity does not turn, before an ideal lens.",
        ),
    ] = False,
) -> int:
    """Simulate all photographs of a run by a random build of the prototype, or of the shell.

    Writes the folder that tbcad run writes, with truth.json: the build, which a calibration of
    these photographs should find.
    """
    check_is_export(folder)
    check_is_object(object_file, up, unit)
    if bits not in (8, 16):
        raise InputError(f"--bits {bits} is not written: allowed is 8 or 16")
    chosen = None if stops is None else numbers(stops)
    named = None if phases is None else tuple(part.strip() for part in phases.split(","))
    from tbcad.api import simulate_run as simulate
    from tbcad.machine.record import truth_file
    from tbcad.runs.exposure import PhaseTimes
    from tbcad.simulated_run.options import RunOptions

    times = PhaseTimes(
        seconds("--exposure-leds", exposure_leds), seconds("--exposure-lit", exposure_lit)
    )
    options = RunOptions(seed, chosen, named, perfect, noise, bits, shell, led_brightness, times)
    with stages(2) as screen:
        run = simulate(
            folder,
            out,
            process,
            object_file,
            up=up,
            unit=unit,
            options=options,
            progress=screen.stage,
            detail=screen.detail,
            answer=screen.note,
        )
    record = run.record
    count = len(record.frames) * len(record.phases)
    typer.echo(
        f"{out}: {count} photographs of {len(record.frames)} frames, and the build as "
        f"{' and '.join(truth_file(name) for name in record.machines)}"
    )
    return 0


def numbers(text: str) -> tuple[int, ...]:
    """Whole numbers of a list as 1,5,20-30.

    Raises:
        InputError: it is none.
    """
    found: set[int] = set()
    for part in text.split(","):
        first, _, last = part.partition("-")
        try:
            chosen = range(int(first), int(last or first) + 1)
            if not 1 <= len(chosen) <= MOST_STOPS:
                raise ValueError
            found.update(chosen)
        except ValueError:
            raise InputError(
                f"--stops {text!r:.60}: {part.strip()!r:.20} is no stop or range of stops: write "
                "for instance 1,5,20-30"
            ) from None
    return tuple(sorted(found))
