"""Calls about how exactly a design must be made."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated

import typer

from tbcad.errors import InputError
from tbcad.options.call import Call
from tbcad.options.shared import (
    AnyPath,
    Changes,
    Exports,
    Force,
    ObjectFile,
    OutReplaced,
    Scheduler,
    UnitOption,
    UpOption,
)


def check_yield(wanted_yield: float) -> None:
    """Refuse a share of good builds that is not between 0 and 1."""
    if not 0 < wanted_yield < 1:
        raise InputError(f"--yield {wanted_yield:g}: allowed is above 0, below 1, like 0.99")


@dataclass(frozen=True)
class InspectionOptions(Call):
    """The shells of an export, and how many of them must be good."""

    exports: Exports[AnyPath]
    _: KW_ONLY
    wanted: Annotated[
        float,
        typer.Option(
            "--yield", help="Share of the shells that must be good with the standard deviations."
        ),
    ] = 0.99
    out: OutReplaced[AnyPath] = Path("inspection")
    force: Force = False


@dataclass(frozen=True)
class ToleranceOptions(Call):
    """An export, a process that makes it, and how its yield is simulated."""

    exports: Exports[AnyPath]
    process: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="How it is made: fdm, sls, sla, cnc, diamond, or a TOML file. By default sla, and "
            "the yields of all of them are compared.",
        ),
    ] = None
    object_file: ObjectFile[AnyPath] = None
    _: KW_ONLY
    up: UpOption = None
    unit: UnitOption = None
    margins: Annotated[
        bool,
        typer.Option(
            "--margins",
            help="Also search for the minimum margin on the coverage with which each process "
            "reaches the yield, as tbcad build --for-process does; some 10 s a process.",
        ),
    ] = False
    settings: Annotated[
        Changes,
        typer.Option(
            "--set", metavar="KIND=VALUE", help="Change any error of the process; repeatable."
        ),
    ] = ()
    builds: Annotated[
        int, typer.Option(min=1, max=1_000_000, help="Number of simulated builds.")
    ] = 1000
    wanted_yield: Annotated[
        float,
        typer.Option("--yield", help="Share of the simulated builds that must reach the target."),
    ] = 0.99
    seed: Annotated[int, typer.Option(min=0, help="Seed of all random errors.")] = 1
    calibrated_mrad: Annotated[
        float,
        typer.Option(
            min=0, max=100, help="Error of each mirror's direction after calibration, mrad."
        ),
    ] = 0.5
    scheduler: Scheduler = None
