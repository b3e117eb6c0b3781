"""Designs: one to begin with, and the search for a better one."""

from collections.abc import Iterator
from dataclasses import asdict
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.app.cli.app import app, command, on_screen, print_result, result_lines
from tbcad.common.screen import paragraph, stages
from tbcad.errors import InputError
from tbcad.options.builds import OptimizeOptions, ToleranceOptions
from tbcad.options.call import tell_options
from tbcad.options.checks import check_is_calibration, check_is_export
from tbcad.options.shared import ForceFile, JsonResult, Out, PlotFormatOption

if TYPE_CHECKING:
    from tbcad.optimizing.search import SearchResult
PAPER = "turtleback"


DesignOption = Annotated[str, typer.Option("--from", metavar="NAME")]
"""Design that comes with tbcad to begin from: see --list."""


@app.command()
def init(
    file: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="Design file (TOML) to write.")
    ] = None,
    design: DesignOption = PAPER,
    show: Annotated[
        bool, typer.Option("--list", help="Only list the designs that come with tbcad.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="With --list: print it as JSON.")] = False,
    force: ForceFile = False,
) -> int:
    """Write a design to change: every key with its meaning, unit, default and allowed values.

    Keys that are comments have their defaults, so the file as written is the design it begins from.
    """
    from tbcad.core.spec.load import shipped_designs

    if show:
        about = _about_designs()
        lines = (paragraph(f"{name}: {text}") for name, text in about.items())
        print_result({"schema": "tbcad-designs/1", "designs": about}, lines, json)
        return 0
    if json:
        raise InputError("--json is about --list: leave it out, or add --list")
    if file is None:
        raise InputError("FILE is missing: name the design to write, such as tbcad init my.toml")
    if design not in shipped_designs():
        known = ", ".join(shipped_designs())
        raise InputError(f"--from is {design!r}, allowed is one of {known}: change it")
    from tbcad.common.atomic_files import replace_files
    from tbcad.output.single_files import check_file

    check_file(file, force)
    from tbcad.app.reference.keys import design_template

    replace_files(file.parent, {file.name: design_template(design).encode()})
    typer.echo(f"{file}: written; build it by tbcad build {file}")
    return 0


def _about_designs() -> dict[str, str]:
    """The designs that come with tbcad, with the first paragraph that each says of itself."""
    from tbcad.core.spec.csv_rows import read_text
    from tbcad.core.spec.load import shipped_designs

    about = {}
    for name, file in shipped_designs().items():
        lines = read_text(file, name, "design").partition("\n#\n")[0].splitlines()
        about[name] = " ".join(line.strip("# ") for line in lines)
    return about


@command()
def optimize(options: OptimizeOptions, json: JsonResult = False) -> int:
    """Search better places of cameras and mirrors for the same sensor and number of mirrors.

    Camera and ellipsoid are moved, directions stretched and the lens fitted; every candidate's
    mirrors are solved by exact rays, and pixels counted one by one. Object, sensor, number of
    mirrors and all else stay.
    """
    result = on_screen(2, "optimize", options)
    print_result(_record(result, options.files), _told(result, *options.files), json)
    return 0


def _record(result: "SearchResult", files: tuple[Path, ...]) -> dict[str, object]:
    """The designs found, for other programs."""
    return {
        "schema": "tbcad-optimize/1",
        "before": asdict(result.start),
        "after": asdict(result.best),
        "limits": asdict(result.limits),
        "candidates": len(result.candidates),
        "front": [*map(asdict, compress(result.candidates, result.on_front))],
        "files": [str(file) for file in files],
    }


def _told(result: "SearchResult", out: Path, *others: Path) -> Iterator[str]:
    from tbcad.optimizing.search import comparison

    return result_lines(
        "optimize",
        none=result.best.place == result.start.place,
        candidates=len(result.candidates),
        compared=[{"line": line} for line in comparison(result)],
        place=result.best.place,
        out=out,
        beside=", ".join(file.name for file in others),
    )


AsBuiltOption = Annotated[Path | None, typer.Option("--as-built", metavar="CALIBRATION")]
"""Instead of a process: this very prototype, with what its calibration (a folder that tbcad
calibrate wrote) leaves unknown."""


@command()
def tolerance(
    options: ToleranceOptions,
    as_built: AsBuiltOption = None,
    out: Out[Path] = Path("tolerance"),
    plot: PlotFormatOption = "svg",
    json: JsonResult = False,
) -> int:
    """Simulate many builds with random errors: how many reach the target, and what limits them.

    Writes tolerance.json, which --json prints too, tables, notes and plots.
    """
    from tbcad.app.api.verification import checked_process
    from tbcad.app.api.verification import tolerance as analyse
    from tbcad.output.single_files import check_tables

    if as_built is None:
        checked_process(options)  # before heavy libraries are loaded
    check_tables(out)
    if as_built is not None:
        if options.process is not None or options.margins or options.settings:
            raise InputError(
                "--as-built is about no process: leave out --process, --margins and --set"
            )
        return _as_built(options, as_built, out, json)
    from tbcad.common.results import write_study
    from tbcad.tolerancing.report import json_text, summary_text, tolerance_study

    with stages(6 + (options.process is None) + options.margins) as screen:
        analysis = analyse(options.on(screen))
        screen.stage("tables and plots")
        more = {"tolerance.json": json_text(analysis).encode()}
        files = write_study(tolerance_study(analysis), out, more, plot)
    return _show_files(json_text(analysis), summary_text(analysis), out, files, json)


def _show_files(record: str, summary: str, out: Path, files: list[Path], json: bool) -> int:
    if json:
        typer.echo(record, nl=False)
        return 0
    typer.echo(paragraph(summary))
    typer.echo(paragraph(f"{out}: {', '.join(file.name for file in files)}"))
    return 0


def _as_built(options: ToleranceOptions, calibration: Path, out: Path, json: bool) -> int:
    exports, builds, seed = Path(options.exports), options.builds, options.seed
    check_is_export(exports)
    check_is_calibration(calibration)
    from json import dumps

    from tbcad.common.atomic_files import replace_files
    from tbcad.common.results import csv_text
    from tbcad.rig.calibrated_solids import (
        as_built_tolerance,
        summary,
        tolerance_record,
    )

    with stages(1) as screen:
        screen.stage("coverage and rays as calibrated")
        found = as_built_tolerance(calibration, exports, builds, seed)
    out.mkdir(parents=True, exist_ok=True)
    record = dumps(tolerance_record(found, builds, seed), indent=1) + "\n"
    contents = {
        "as-built.json": record.encode(),
        "as-built.csv": csv_text(found.mirrors).encode(),
    }
    files = replace_files(out, contents)
    return _show_files(record, summary(found), out, files, json)


tell_options(__name__)
