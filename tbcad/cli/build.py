"""Build, verify and draw: heavy libraries are imported inside the commands."""

from dataclasses import asdict, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from tbcad.cli.app import app
from tbcad.cli.for_process import DEFAULT_YIELD, asked_process, design_for
from tbcad.cli.output_mode import Full, Json, Quiet, output_mode, print_json
from tbcad.errors import InputError
from tbcad.options.checks import check_are_printers, check_is_calibration, check_is_folder
from tbcad.options.shared import (
    Design,
    Exports,
    Force,
    ForceFile,
    JsonResult,
    OutReplaced,
    Settings,
)
from tbcad.screen import report_console, stages

if TYPE_CHECKING:
    from tbcad_verify.report.report import Output

    from tbcad.doctor import Finding

# About as many stages has a build, without and with its verification.
SHELL_STAGES, PROTOTYPE_STAGES, VERIFICATION_STAGES = (5, 14), (9, 27), 19
FINDING_WIDTHS = (2, 22, 53)  # columns of a finding: whether it is good, its name, what was found


@app.command()
def build(
    design: Design[Path] = None,
    n: Annotated[
        str | None,
        typer.Option(
            metavar="N",
            help="Subdivision of the icosahedron, 2 to 60; mirrors grow with n squared.",
        ),
    ] = None,
    out: OutReplaced[Path] = Path("exports"),
    radius_rule: Annotated[
        Literal["traced", "paper", "flat"] | None,
        typer.Option(
            help="traced: by exact rays, every mirror sees the whole object; paper: eqs. 1 "
            "and 2 of the paper; flat: planar mirrors."
        ),
    ] = None,
    settings: Settings = None,
    parts: Annotated[
        str | None,
        typer.Option(
            help="What to build: shell, prototype, or shell,prototype. By default both, but no "
            "prototype of planar mirrors."
        ),
    ] = None,
    for_process: Annotated[
        str | None,
        typer.Option(
            "--for-process",
            "--process",
            metavar="NAME|FILE",
            help="Choose edges and coverage margins for a manufacturing process, and say what they "
            "cost: fdm, sls, sla, cnc, diamond, or a TOML file; see tbcad tolerance. A design that "
            "names its edges keeps them.",
        ),
    ] = None,
    share: Annotated[
        float | None,
        typer.Option(
            "--yield",
            help="With --for-process: share of simulated builds that must reach the target; by "
            f"default {DEFAULT_YIELD:g}.",
        ),
    ] = None,
    verify: Annotated[bool, typer.Option(help="Verify the files after they are written.")] = True,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run",
            help="Only show what would be built: mirrors, balls, masses, time and estimates of "
            "printing and cost; seconds, and nothing is written.",
        ),
    ] = False,
    force: Force = False,
    full: Full = False,
    quiet: Quiet = False,
    json: Json = False,
) -> int:
    """Compute the mirrors, build shells and prototype, write STEP, STL and 3MF, and verify them.

    Exit code 0: built and verified. 1: built, but the verification fails (the files stay). 2: bad
    input, nothing written.
    """
    output = output_mode(full, quiet, json)
    if not verify and not dry_run and output in ("full", "json"):
        raise InputError(f"--{output} shows a verification: leave --no-verify out")
    from tbcad.api import build as build_files
    from tbcad.cli.memory import keep_freed_memory
    from tbcad.output.folder import check_replaceable
    from tbcad.output.inputs import design_files, files_named
    from tbcad.output.parts import PROTOTYPE, check_lists, check_parts, default_parts, parse_parts
    from tbcad.spec.load import load_spec

    started = monotonic()
    keep_freed_memory()
    asked = parse_parts(parts) if parts is not None else None
    options = list(settings or [])
    options += [f"optics.n={n}"] if n is not None else []
    options += [f"mirrors.radius_rule={radius_rule}"] if radius_rule else []
    spec = load_spec(design, options)
    process, wanted_yield = asked_process(for_process, share)
    chosen = asked or default_parts(spec)
    if asked is not None:
        check_parts(spec, asked)
    check_lists(spec, chosen)
    inputs = [*design_files(spec, design), *files_named(for_process)]
    check_replaceable(out, "build", force, inputs)
    number = (PROTOTYPE_STAGES if PROTOTYPE in chosen else SHELL_STAGES)[verify]
    with stages(number, silent=quiet) as screen:
        if process is not None:
            screen.stage(f"edges and margins for {process.name}")
            spec = design_for(spec, process, wanted_yield, screen)
        if dry_run:
            from tbcad.cli.dry_run import show_overview

            return show_overview(spec, asked, output, screen)
        built = build_files(
            spec,
            out,
            parts=asked,
            verify=verify,
            force=force,
            progress=screen.stage,
            detail=screen.detail,
        )
    if built.report is None:
        note = f"{built.note}\n" if built.note else ""
        typer.echo(f"{note}{out}: built, not verified: run tbcad verify {out}")
        return 0
    report = replace(built.report, seconds=monotonic() - started)
    report.show(report_console(), output)
    return 0 if built.passed else 1


@app.command("verify")
def verify_command(
    folder: Exports[Path],
    printers: Annotated[
        list[str] | None,
        typer.Option(
            "--printer",
            metavar="NAME|FILE",
            help="Fail unless every part can be made by this printer: fdm, sls, sla, cnc, or "
            "a TOML file; repeatable.",
        ),
    ] = None,
    clients: Annotated[
        bool,
        typer.Option(
            "--clients", help="Also open the files in FreeCAD, gmsh, PrusaSlicer and admesh."
        ),
    ] = False,
    as_built: Annotated[
        Path | None,
        typer.Option(
            "--as-built",
            metavar="CALIBRATION",
            help="Instead of the files, verify the prototype as tbcad calibrate found it: what it "
            "covers, and what to shim. Writes nothing.",
        ),
    ] = None,
    time_limit: Annotated[
        float,
        typer.Option(metavar="S", help="Time limit for each stage, file or program, seconds."),
    ] = 600.0,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict",
            help="Fail also where a file was changed that only people read, such as a parts list.",
        ),
    ] = False,
    full: Full = False,
    quiet: Quiet = False,
    json: Json = False,
) -> int:
    """Verify an export on its files, and write verify.json there.

    Exit code 0: verified. 1: the verification fails. 2: not an export, or a broken one.
    """
    output = output_mode(full, quiet, json)
    if not time_limit > 0:
        raise InputError(f"--time-limit must be more than 0 seconds, not {time_limit:g}")
    check_is_folder(folder)
    if as_built is not None:
        if printers or clients or strict:
            raise InputError(
                "--as-built is about no files: leave out --printer, --clients and --strict"
            )
        return _verify_as_built(folder, as_built, output)
    check_are_printers(printers or ())
    from tbcad_verify.run.verify import VerifyOptions

    from tbcad.api import as_made, verify

    options = VerifyOptions(
        seconds=time_limit, printers=tuple(printers or ()), clients=clients, strict=strict
    )
    started = monotonic()
    with stages(VERIFICATION_STAGES, silent=quiet) as screen:
        # Before the verification, which writes: a command that is stopped has changed nothing.
        simulated = as_made(folder, screen.stage, screen.detail)
        report = verify(folder, options, progress=screen.stage)
    report = replace(report, as_made=simulated, seconds=monotonic() - started)
    report.show(report_console(), output)
    return 0 if report.passed else 1


def _verify_as_built(folder: Path, calibration: Path, output: "Output") -> int:
    check_is_calibration(calibration)
    from tbcad.api import verify_as_built

    with stages(3, silent=output == "quiet") as screen:
        report = verify_as_built(folder, calibration, progress=screen.stage)
    report.show(report_console(), output)
    return 0 if report.passed else 1


@app.command()
def picture(
    folder: Exports[Path],
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="PNG file to write; by default named after the subject."),
    ] = None,
    of: Annotated[
        str,
        typer.Option(
            help="Subject: shell (both halves from outside, and the mirrors from a camera); edges "
            "or seam (of the mirrors, close up); rig, sides, base, seat or exploded (the "
            "prototype)."
        ),
    ] = "shell",
    force: ForceFile = False,
) -> int:
    """Draw the shells or the prototype from the files of an export."""
    from tbcad.report.drawing import picture as draw

    file = out or Path(f"{of}.png")
    draw(folder, file, of, force)
    typer.echo(f"{file}: written")
    return 0


@app.command()
def doctor(json: JsonResult = False) -> int:
    """Check that this Python environment has all that tbcad needs, and say how to repair it."""
    from tbcad.doctor import diagnose

    findings = diagnose()
    if json:
        print_json({"schema": "tbcad-doctor/1", "findings": [asdict(one) for one in findings]})
    for finding in findings if not json else ():
        _show_finding(finding)
    return 0 if all(finding.ok for finding in findings) else 1


def _show_finding(finding: "Finding") -> None:
    """Show what was found, and below it, after an arrow, what to do."""
    from rich.markup import escape
    from rich.table import Table

    row = Table.grid(padding=(0, 1))
    for width in FINDING_WIDTHS:
        row.add_column(width=width, overflow="fold")
    row.add_row("ok" if finding.ok else "NO", escape(finding.name), escape(finding.detail))
    if finding.remedy:
        row.add_row("", "->", escape(finding.remedy))
    report_console().print(row, highlight=False)
