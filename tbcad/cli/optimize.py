"""The command that searches a better design."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from tbcad.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.cli.app import app
from tbcad.cli.output_mode import print_json
from tbcad.errors import InputError
from tbcad.options.shared import ForceFile, JsonResult, PlotFormatOption, Scheduler, Settings
from tbcad.screen import stages

if TYPE_CHECKING:
    from tbcad.optimizing.search import SearchResult

OUT = Path("better.toml")
DEFAULTS = ("minimum", "pixels", "evenness")
LEAST, MOST = 80, 100_000  # candidates: two generations, and what nobody waits for


@app.command()
def optimize(
    design: Annotated[
        str | None,
        typer.Argument(
            metavar="DESIGN",
            help="TOML file or name of the design to begin from; by default that of the paper.",
        ),
    ] = None,
    settings: Settings = None,
    objectives: Annotated[
        list[str] | None,
        typer.Option(
            "--for",
            metavar="AIM",
            help="What to make better; repeatable, and then all count alike. minimum: pixels of "
            "the virtual camera with fewest; pixels: mean of the logarithms of the pixels; "
            "evenness: their coefficient of variation; ssim: of 24 views of a knot, by --method, "
            "which takes several times as long; size: of the machine. By default the first "
            "three.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", "-o", help="TOML file to write; table and plot beside it.")
    ] = OUT,
    max_size_mm: Annotated[
        float | None,
        typer.Option(
            help="Longest side of the box round mirrors and pinholes, mm; by default that of the "
            "design."
        ),
    ] = None,
    max_view_angle_deg: Annotated[
        float | None,
        typer.Option(help="Angle of view of the lens, degrees; by default that of the design."),
    ] = None,
    method: Annotated[
        Literal["nearest", "field"] | None,
        typer.Option(
            help="Of the views that ssim compares. nearest, the default: by nearest rays; field: "
            "by a coarse field that is fitted to all rays, some seconds a candidate."
        ),
    ] = None,
    front: Annotated[
        bool,
        typer.Option(
            "--front",
            help="With several aims: search also where each of them counts most, so that more "
            "candidates are found that no other betters (the Pareto front).",
        ),
    ] = False,
    candidates: Annotated[int, typer.Option(help="Number of candidates, about.")] = 480,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with a search that was stopped.")
    ] = False,
    force: ForceFile = False,
    json: JsonResult = False,
    plot: PlotFormatOption = "png",
    scheduler: Scheduler = None,
) -> int:
    """Search better places of cameras and mirrors for the same sensor and number of mirrors.

    Camera and ellipsoid are moved, directions stretched and the lens fitted; every candidate's
    mirrors are solved by exact rays, and pixels counted one by one. Object, sensor, number of
    mirrors and all else stay.
    """
    from tbcad.optimizing.files import search_files
    from tbcad.optimizing.search import Search, parse_objectives, search
    from tbcad.spec.load import load_spec

    store = _store(out)
    wanted = parse_objectives(objectives or DEFAULTS)
    if method is not None and "ssim" not in wanted:
        raise InputError(f"--method {method} is of the views that ssim compares: add --for ssim")
    _check_numbers(candidates, max_size_mm, max_view_angle_deg)
    spec = load_spec(Path(design) if design else None, settings or ())
    _check_files(out, store, design, plot, resume, force)
    with stages(2) as screen:
        screen.stage("optimize: candidates")
        limits = max_size_mm, max_view_angle_deg
        asked = Search(spec, wanted, candidates, *limits, front, method or "nearest")
        result = search(asked, store, scheduler, screen.detail)
        screen.stage("optimize: files")
        files = replace_files(out.parent, search_files(result, spec, out, plot))
    if json:
        print_json(_record(result, files))
        return 0
    _show(result, out, files)
    return 0


def _store(out: Path) -> Path:
    """Where candidates are kept for `--resume`."""
    if not out.name:
        raise InputError(f"--out is {str(out)!r}, allowed is the name of a TOML file: change it")
    return out.with_name(f"{out.stem}-candidates.jsonl")


def _check_numbers(candidates: int, size_mm: float | None, angle_deg: float | None) -> None:
    if not LEAST <= candidates <= MOST:
        raise InputError(f"--candidates is {candidates}, allowed is {LEAST} to {MOST}: change it")
    for option, number in (("--max-size-mm", size_mm), ("--max-view-angle-deg", angle_deg)):
        if number is not None and not number > 0:
            raise InputError(f"{option} is {number:g}, allowed is more than 0: change it")


def _check_files(
    out: Path, store: Path, design: str | None, plot: str, resume: bool, force: bool
) -> None:
    """Refuse, before any work, what would be lost."""
    from tbcad.output.single_files import check_file

    inputs = (Path(design) if design else None,)
    with write_errors_as_input_errors(out):
        if out.is_dir():
            raise InputError(f"{out} is a folder: name a TOML file with --out")
        for file in (out, out.with_name(f"{out.stem}-candidates.csv"), out.with_suffix(f".{plot}")):
            check_file(file, force or resume, inputs)
        if store.exists() and not (resume or force):
            raise InputError(f"{store} exists: go on with --resume, or begin anew with --force")
        out.parent.mkdir(parents=True, exist_ok=True)
        if not resume:
            store.unlink(missing_ok=True)


def _record(result: "SearchResult", files: list[Path]) -> dict[str, object]:
    """What was found, for other programs."""
    from dataclasses import asdict

    return {
        "schema": "tbcad-optimize/1",
        "before": asdict(result.start),
        "after": asdict(result.best),
        "limits": asdict(result.limits),
        "candidates": len(result.candidates),
        "front": [
            asdict(one)
            for one, kept in zip(result.candidates, result.on_front, strict=True)
            if kept
        ],
        "files": [str(file) for file in files],
    }


def _show(result: "SearchResult", out: Path, files: list[Path]) -> None:
    from tbcad.optimizing.files import comparison

    if result.best.place == result.start.place:
        typer.echo(f"No better one among {len(result.candidates)} candidates within the limits.")
    for line in comparison(result):
        typer.echo(line)
    x, z, semi_minor, *stretch = result.best.place
    typer.echo(
        f"camera at x = {x:g}, z = {z:g} mm; semi-minor axis {semi_minor:g} mm; "
        f"directions stretched by {stretch[0]:g} and {stretch[1]:g}"
    )
    others = ", ".join(file.name for file in files if file != out)
    typer.echo(f"{out}: written, with {others}; build and verify it by tbcad build {out}")
