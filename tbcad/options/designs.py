"""Calls about designs: what is asked of a better one."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import typer

from tbcad.errors import InputError
from tbcad.options.call import Call
from tbcad.options.shared import AnyPath, ForceFile, PlotFormatOption, Scheduler

if TYPE_CHECKING:
    from tbcad.core.spec.design import Spec

    AnyDesign = Spec | Path | str
else:
    AnyDesign = Path | str | Any  # a spec is checked where its model is loaded

Objective = Literal["minimum", "pixels", "evenness", "ssim", "size"]
OBJECTIVES: tuple[Objective, ...] = get_args(Objective)


@dataclass(frozen=True)
class OptimizeOptions(Call):
    """The design to begin from, what is to be better, and what a better one must keep."""

    design: Annotated[AnyDesign | None, typer.Argument(metavar="DESIGN")] = None
    """TOML file or name of the design to begin from; by default that of the paper."""
    _: KW_ONLY
    settings: Annotated[Sequence[str], typer.Option("--set", metavar="KEY=VALUE")] = ()
    """Change any key of the design; repeatable."""
    objectives: Annotated[Sequence[str], typer.Option("--for", metavar="AIM")] = ()
    """What to make better; repeatable, and then all count alike. minimum: pixels of the virtual
    camera with fewest; pixels: mean of the logarithms of the pixels; evenness: their coefficient of
    variation; ssim: of 24 views of a knot, by --method, which takes several times as long; size: of
    the machine. By default the first three."""
    out: Annotated[AnyPath, typer.Option("--out", "-o")] = Path("better.toml")
    """TOML file to write; table and plot beside it."""
    max_size_mm: float | None = None
    """Longest side of the box round mirrors and pinholes, mm; by default that of the design."""
    max_view_angle_deg: float | None = None
    """Angle of view of the lens, degrees; by default that of the design."""
    method: Literal["nearest", "field"] | None = None
    """Of the views that ssim compares. nearest, the default: by nearest rays; field: by a coarse
    field that is fitted to all rays, some seconds a candidate."""
    front: bool = False
    """With several aims: search also where each of them counts most, so that more candidates are
    found that no other betters (the Pareto front)."""
    candidates: Annotated[int, typer.Option(min=80, max=100_000)] = 480
    """Number of candidates, about."""
    resume: bool = False
    """Go on with a search that was stopped."""
    force: ForceFile = False
    plot: PlotFormatOption = "png"
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
        """Refuse what does not go together."""
        for name in self.objectives:
            if name not in OBJECTIVES:
                known = ", ".join(OBJECTIVES)
                raise InputError(f"--for is {name!r}, allowed is one of {known}: change it")
        if self.method is not None and "ssim" not in self.aims:
            raise InputError(
                f"--method {self.method} is of the views that ssim compares: add --for ssim"
            )
        for name in ("max_size_mm", "max_view_angle_deg"):
            number = getattr(self, name)
            if number is not None and not number > 0:
                option = f"--{name.replace('_', '-')}"
                raise InputError(f"{option} is {number:g}, allowed is more than 0: change it")
