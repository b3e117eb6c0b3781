"""Calls about builds: what is built, verified and shown, and how exactly it must be made."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from tbcad.errors import InputError
from tbcad.options.call import Call
from tbcad.options.checks import check_are_printers, check_is_folder
from tbcad.options.designs import AnyDesign
from tbcad.options.shared import (
    AnyPath,
    Changes,
    Design,
    Exports,
    Force,
    ObjectFile,
    OutReplaced,
    Scheduler,
    UnitOption,
    UpOption,
)

DEFAULT_YIELD = 0.99
LARGEST_CUTTER_MM = 100.0


@dataclass(frozen=True)
class BuildOptions(Call):
    """A design, what of it is built, and for which process."""

    spec: Design[AnyDesign] = None
    out: OutReplaced[AnyPath] = Path("exports")
    _: KW_ONLY
    n: Annotated[
        int | str | None,
        typer.Option(
            metavar="N",
            help="Subdivision of the icosahedron, 2 to 60; mirrors grow with n squared.",
        ),
    ] = None
    radius_rule: Annotated[
        Literal["traced", "paper", "flat"] | None,
        typer.Option(
            help="traced: by exact rays, every mirror sees the whole object; paper: eqs. 1 "
            "and 2 of the paper; flat: planar mirrors."
        ),
    ] = None
    settings: Annotated[
        Changes,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Change any key of the design; repeatable."
        ),
    ] = ()
    parts: Annotated[
        str | Sequence[str] | None,
        typer.Option(
            help="What to build: shell, prototype, or shell,prototype. By default both, but no "
            "prototype of planar mirrors."
        ),
    ] = None
    for_process: Annotated[
        str | None,
        typer.Option(
            "--for-process",
            "--process",
            metavar="NAME|FILE",
            help="Choose edges and coverage margins for a manufacturing process, and say what they "
            "cost: nickel-diamond, cnc, sla ... or a TOML file; see tbcad tolerance. A design that "
            "names its edges keeps them.",
        ),
    ] = None
    wanted_yield: Annotated[
        float | None,
        typer.Option(
            "--yield",
            help="With --for-process: share of simulated builds that must reach the target; by "
            f"default {DEFAULT_YIELD:g}.",
        ),
    ] = None
    verify: Annotated[bool, typer.Option(help="Verify the files after they are written.")] = True
    force: Force = False


@dataclass(frozen=True)
class VerificationOptions(Call):
    """An export, and what else to verify of it."""

    exports: Exports[AnyPath]
    _: KW_ONLY
    printers: Annotated[
        Sequence[str],
        typer.Option(
            "--printer",
            metavar="NAME|FILE",
            help="Fail unless every part can be made by this printer: fdm, sls, sla, cnc, or "
            "a TOML file; repeatable.",
        ),
    ] = ()
    clients: Annotated[
        bool,
        typer.Option(
            "--clients", help="Also open the files in FreeCAD, gmsh, PrusaSlicer and admesh."
        ),
    ] = False
    time_limit: Annotated[
        float,
        typer.Option(metavar="S", help="Time limit for each stage, file or program, seconds."),
    ] = 600.0
    strict: Annotated[
        bool,
        typer.Option(
            "--strict",
            help="Fail also where a file was changed that only people read, such as a parts list.",
        ),
    ] = False

    cutter: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="Fail unless a ball cutter of this radius reaches all mirrors of a mandrel; of "
            "shells, say what it does not reach.",
        ),
    ] = None

    def check(self) -> None:
        """Refuse what cannot be, before heavy libraries are loaded."""
        if not self.time_limit > 0:
            raise InputError(f"--time-limit must be more than 0 seconds, not {self.time_limit:g}")
        if self.cutter is not None and not 0 < self.cutter <= LARGEST_CUTTER_MM:
            raise InputError(
                f"--cutter {self.cutter:g}: allowed is above 0, at most {LARGEST_CUTTER_MM:g} mm"
            )
        check_is_folder(Path(self.exports))
        check_are_printers(self.printers)


@dataclass(frozen=True)
class ReportOptions(Call):
    """An export, and what its page shows."""

    exports: Exports[AnyPath]
    out: Annotated[
        AnyPath | None,
        typer.Option(
            "--out", "-o", help="HTML file to write; by default report.html in the folder."
        ),
    ] = None
    _: KW_ONLY
    capture: Annotated[
        AnyPath | None,
        typer.Option(
            "--capture",
            metavar="FOLDER",
            help="Folder written by tbcad capture or merge for this export: shows the photograph "
            "in each mirror.",
        ),
    ] = None
    force: Annotated[
        bool,
        typer.Option(
            "--force", help="Replace a file that tbcad did not write, instead of refusing."
        ),
    ] = False


def check_yield(wanted_yield: float) -> None:
    """Refuse a share of good builds that is not between 0 and 1."""
    if not 0 < wanted_yield < 1:
        raise InputError(f"--yield {wanted_yield:g}: allowed is above 0, below 1, like 0.99")


@dataclass(frozen=True)
class OrderOptions(Call):
    """The shells of an export, the chain that makes them, and how many must be good."""

    exports: Exports[AnyPath]
    _: KW_ONLY
    chain: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="How they are made: nickel-diamond, cnc, sla ... or a TOML file; see tbcad "
            "tolerance.",
        ),
    ] = "nickel-diamond"
    wanted: Annotated[
        float,
        typer.Option(
            "--yield", help="Share of the shells that must be good with the standard deviations."
        ),
    ] = 0.99
    out: OutReplaced[AnyPath] = Path("order")
    force: Force = False


@dataclass(frozen=True)
class ToleranceOptions(Call):
    """An export, a process that makes it, and how its yield is simulated."""

    exports: Exports[AnyPath]
    process: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="How it is made: nickel-diamond, cnc, sla ... or a TOML file. By default sla, and "
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
