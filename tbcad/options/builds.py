"""Calls about designs and builds: what is searched, built, verified and shown, and how exactly."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from tbcad.errors import InputError
from tbcad.options.call import Call
from tbcad.options.captures import Optics
from tbcad.options.checks import check_are_printers, check_is_folder
from tbcad.options.shared import (
    AnyPath,
    Changes,
    Design,
    Exports,
    Force,
    ForceFile,
    ObjectFile,
    OutReplaced,
    PlotFormatOption,
    Scheduler,
    UnitOption,
    UpOption,
)

if TYPE_CHECKING:
    from tbcad.core.spec.design import Spec

    AnyDesign = Spec | Path | str
else:
    AnyDesign = Path | str | Any  # a spec is checked where its model is loaded

Objective = Literal["minimum", "pixels", "evenness", "ssim", "size"]
OBJECTIVES: tuple[Objective, ...] = get_args(Objective)


@dataclass(frozen=True)
class OptimizeOptions(Call):
    """The design to begin from, its objectives and its limits."""

    design: Annotated[AnyDesign | None, typer.Argument(metavar="DESIGN")] = None
    """TOML file or name of the design to begin from; by default that of the paper."""
    _: KW_ONLY
    settings: Annotated[Sequence[str], typer.Option("--set", metavar="KEY=VALUE")] = ()
    """Change any key of the design; repeatable."""
    objectives: Annotated[Sequence[str], typer.Option("--for", metavar="AIM")] = ()
    """Objective; repeatable, with equal weights. minimum: pixels of the virtual camera with fewest;
    pixels: mean of the logarithms of the pixels; evenness: their coefficient of variation; ssim: of
    views of a knot, by --method and --optics, which takes several times as long; size: of the
    machine. By default the first three."""
    out: Annotated[AnyPath, typer.Option("--out", "-o")] = Path("better.toml")
    """TOML file to write; table and plot beside it."""
    max_size_mm: float | None = None
    """Longest side of the box round mirrors and pinholes, mm; by default that of the design."""
    max_view_angle_deg: float | None = None
    """Angle of view of the lens, degrees; by default that of the design."""
    method: Literal["nearest", "field"] | None = None
    """Of the views that ssim compares. nearest, the default: by nearest rays; field: by a coarse
    field that is fitted to all rays, some seconds a candidate."""
    optics: Optics | None = None
    """Of the photographs that ssim compares views of. real, the default: the lens that each
    candidate requires, shadows of the object on itself, scatter and noise, by a quarter of the
    pixels and 12 views; ideal: pinholes, 24 views."""
    front: bool = False
    """With several aims: search also where each of them counts most, so that more candidates are
    found that no other betters (the Pareto front)."""
    candidates: Annotated[int, typer.Option(min=80, max=100_000)] = 480
    """Number of candidates, about."""
    resume: bool = False
    """Go on with a search that was stopped."""
    force: ForceFile = False
    plot: PlotFormatOption = "svg"
    scheduler: Scheduler = None

    @property
    def aims(self) -> tuple[Objective, ...]:
        """What is made better, each once; all count alike, as ratios to the first design."""
        return tuple(one for one in OBJECTIVES if one in (self.objectives or OBJECTIVES[:3]))

    @property
    def files(self) -> tuple[Path, Path, Path]:
        """The design, the table of candidates and the plot.

        InputError: out is no name of a file.
        """
        out = Path(self.out)
        if not out.name:
            raise InputError(
                f"--out is {str(self.out)!r}, allowed is the name of a TOML file: change it"
            )
        table = out.with_name(f"{out.stem}-candidates.csv")
        return out, table, out.with_suffix(f".{self.plot}")

    def check(self) -> None:
        """Refuse options that exclude each other."""
        for name in self.objectives:
            if name not in OBJECTIVES:
                known = ", ".join(OBJECTIVES)
                raise InputError(f"--for is {name!r}, allowed is one of {known}: change it")
        if self.method is not None and "ssim" not in self.aims:
            raise InputError(
                f"--method {self.method} is of the views that ssim compares: add --for ssim"
            )
        if self.optics is not None and "ssim" not in self.aims:
            raise InputError(
                f"--optics {self.optics} is of the photographs that ssim compares views of: add "
                "--for ssim"
            )
        for name in ("max_size_mm", "max_view_angle_deg"):
            number = getattr(self, name)
            if number is not None and not number > 0:
                option = f"--{name.replace('_', '-')}"
                raise InputError(f"{option} is {number:g}, allowed is more than 0: change it")


DEFAULT_YIELD = 0.99
LARGEST_CUTTER_MM = 100.0


@dataclass(frozen=True)
class BuildOptions(Call):
    """A design, what of it is built, and for which process."""

    spec: Design[AnyDesign] = None
    out: OutReplaced[AnyPath] = Path("exports")
    _: KW_ONLY
    n: Annotated[int | str | None, typer.Option("--n", "-n", metavar="N")] = None
    """Subdivision of the icosahedron, 2 to 60; mirrors grow with n squared."""
    radius_rule: Literal["traced", "paper", "flat"] | None = None
    """traced: by exact rays, every mirror sees the whole object; paper: eqs. 1 and 2 of the paper;
    flat: planar mirrors."""
    settings: Annotated[Changes, typer.Option("--set", metavar="KEY=VALUE")] = ()
    """Change any key of the design; repeatable."""
    parts: str | Sequence[str] | None = None
    """What to build: shell, prototype, or shell,prototype. By default both, but no prototype of
    planar mirrors."""
    process: Annotated[str | None, typer.Option(metavar="NAME|FILE")] = None
    """Choose edges and coverage margins for a manufacturing process, and say what they cost:
    nickel-diamond, cnc, sla ... or a TOML file; see tbcad tolerance. A design that names its edges
    keeps them."""
    wanted_yield: Annotated[float | None, typer.Option("--yield")] = None
    """With --process: share of simulated builds that must reach the target; by default 0.99."""
    verify: bool = True
    """Verify the files after they are written."""
    fresh: bool = False
    """Work everything out, and use nothing that earlier builds have kept."""
    force: Force = False


@dataclass(frozen=True)
class VerificationOptions(Call):
    """A build, and what else to verify of it."""

    exports: Exports[AnyPath]
    _: KW_ONLY
    printers: Annotated[Sequence[str], typer.Option("--printer", metavar="NAME|FILE")] = ()
    """Fail unless every part can be made by this printer: fdm, sls, sla, cnc, or a TOML file;
    repeatable."""
    clients: bool = False
    """Also open the files in FreeCAD, gmsh and PrusaSlicer."""
    time_limit: Annotated[float, typer.Option(metavar="S")] = 600.0
    """Time limit for each stage, file or program, seconds."""
    strict: bool = False
    """Fail also where a file was changed that only people read, such as a parts list."""

    cutter: Annotated[float | None, typer.Option(metavar="MM")] = None
    """Fail unless a ball cutter of this radius reaches all mirrors of a mandrel; of shells, say
    what it does not reach."""

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
    """A build, and what its page shows."""

    exports: Exports[AnyPath]
    out: Annotated[AnyPath | None, typer.Option("--out", "-o")] = None
    """HTML file to write; by default report.html in the folder."""
    _: KW_ONLY
    capture: Annotated[AnyPath | None, typer.Option(metavar="FOLDER")] = None
    """Folder written by tbcad capture or merge for this build: shows the photograph in each
    mirror."""
    force: bool = False
    """Replace a file that tbcad did not write, instead of refusing."""


def check_yield(wanted_yield: float) -> None:
    """Refuse a yield that is not between 0 and 1."""
    if not 0 < wanted_yield < 1:
        raise InputError(f"--yield {wanted_yield:g}: allowed is above 0, below 1, like 0.99")


@dataclass(frozen=True)
class OrderOptions(Call):
    """The shells of a build, the process that makes them, and the yield wanted."""

    exports: Exports[AnyPath]
    _: KW_ONLY
    process: Annotated[str, typer.Option(metavar="NAME|FILE")] = "nickel-diamond"
    """How they are made: nickel-diamond, cnc, sla ... or a TOML file; see tbcad tolerance."""
    wanted: Annotated[float, typer.Option("--yield")] = 0.99
    """Share of the simulated shells whose every virtual camera sees the whole object, with the
    standard deviations of the process."""
    out: OutReplaced[AnyPath] = Path("order")
    force: Force = False


@dataclass(frozen=True)
class ToleranceOptions(Call):
    """A build, a process that makes it, and how its yield is simulated."""

    exports: Exports[AnyPath]
    process: Annotated[str | None, typer.Option(metavar="NAME|FILE")] = None
    """How it is made: nickel-diamond, cnc, sla ... or a TOML file. By default sla, and the yields
    of all of them are compared."""
    object_file: ObjectFile[AnyPath] = None
    _: KW_ONLY
    up: UpOption = None
    unit: UnitOption = None
    margins: bool = False
    """Also search for the minimum margin on the coverage with which each process reaches the yield,
    as tbcad build --process does; some 10 s a process."""
    settings: Annotated[Changes, typer.Option("--set", metavar="KIND=VALUE")] = ()
    """Change any error of the process; repeatable."""
    builds: Annotated[int, typer.Option(min=1, max=1_000_000)] = 1000
    """Number of simulated builds."""
    wanted_yield: Annotated[float, typer.Option("--yield")] = 0.99
    """Share of the simulated builds that must reach the target."""
    seed: Annotated[int, typer.Option(min=0)] = 1
    """Seed of all random errors."""
    calibrated_mrad: Annotated[float, typer.Option(min=0, max=100)] = 0.5
    """Error of each mirror's direction after calibration, mrad."""
    optics: Optics = "ideal"
    """Of the pictures. ideal: pinholes; real: the lens of camera.json, shadows, noise, as tbcad
    capture --optics real."""
    scheduler: Scheduler = None
