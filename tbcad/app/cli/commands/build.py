"""Build, verify and draw: heavy libraries are imported inside the commands."""

from dataclasses import asdict, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.app.cli.app import Full, Json, Quiet, app, command, on_screen, output_mode, print_json
from tbcad.common.screen import report_console, stages
from tbcad.errors import InputError
from tbcad.options.builds import BuildOptions, ReportOptions, VerificationOptions
from tbcad.options.call import tell_options
from tbcad.options.checks import check_is_calibration
from tbcad.options.shared import Exports, ForceFile, JsonResult

if TYPE_CHECKING:
    from tbcad_verify.report.report import Output

    from tbcad.app.doctor import Finding


# About as many stages has a build, without and with its verification.
SHELL_STAGES, PROTOTYPE_STAGES, VERIFICATION_STAGES = (5, 14), (9, 27), 19
FINDING_WIDTHS = (2, 22, 53)  # columns of a finding: whether it is good, its name, what was found


DryRunOption = Annotated[bool, typer.Option("--dry-run")]
"""Only show what would be built: mirrors, balls, masses, time and estimates of printing and cost;
seconds, and nothing is written."""


@command()
def build(
    options: BuildOptions,
    dry_run: DryRunOption = False,
    full: Full = False,
    quiet: Quiet = False,
    json: Json = False,
) -> int:
    """Compute the mirrors, build shells and prototype, write STEP, STL and 3MF, and verify them.

    Exit code 0: built and verified. 1: built, but the verification fails (the files stay). 2: bad
    input, nothing written.
    """
    output = output_mode(full, quiet, json)
    if not options.verify and not dry_run and output in ("full", "json"):
        raise InputError(f"--{output} shows a verification: leave --no-verify out")
    from tbcad.app.api.builds import build_planned, planned, spec_for_process
    from tbcad.app.cli.memory import keep_freed_memory
    from tbcad.output.parts import PROTOTYPE

    keep_freed_memory()
    plan = planned(options)
    number = (PROTOTYPE_STAGES if PROTOTYPE in plan.parts else SHELL_STAGES)[options.verify]
    with stages(number, silent=quiet) as screen:
        shown = options.on(screen)
        if dry_run:
            from tbcad.app.cli.commands.dry_run import show_overview

            spec = spec_for_process(plan, shown)
            return show_overview(spec, plan.parts, options.parts is None, output, screen)
        built = build_planned(plan, shown)
    if built.report is None:
        note = f"{built.note}\n" if built.note else ""
        out = options.out
        typer.echo(f"{note}{out}: built, not verified: run tbcad verify {out}")
        return 0
    built.report.show(report_console(), output)
    return 0 if built.passed else 1


AsBuiltOption = Annotated[Path | None, typer.Option("--as-built", metavar="CALIBRATION")]
"""Instead of the files, verify the prototype as tbcad calibrate found it: what it covers, and what
to shim. Writes nothing."""


@command("verify")
def verify_command(
    options: VerificationOptions,
    as_built: AsBuiltOption = None,
    full: Full = False,
    quiet: Quiet = False,
    json: Json = False,
) -> int:
    """Verify a build on its files, and write verify.json there.

    Exit code 0: verified. 1: the verification fails. 2: not a build, or a broken one.
    """
    output, folder = output_mode(full, quiet, json), Path(options.exports)
    asked = (options.printers, options.clients, options.strict, options.cutter)
    if as_built is not None and any(asked):
        raise InputError(
            "--as-built is about no files: leave out --printer, --clients, --strict and --cutter"
        )
    options.check()
    if as_built is not None:
        return _verify_as_built(folder, as_built, output)
    from tbcad.app.api import as_made, verify

    started = monotonic()
    with stages(VERIFICATION_STAGES, silent=quiet) as screen:
        # Before the verification, which writes: a command that is stopped has changed nothing.
        simulated = as_made(folder, screen.stage, screen.detail)
        report = verify(options.on(screen))
    report = replace(report, as_made=simulated, seconds=monotonic() - started)
    report.show(report_console(), output)
    return 0 if report.passed else 1


def _verify_as_built(folder: Path, calibration: Path, output: "Output") -> int:
    check_is_calibration(calibration)
    from tbcad.app.api import verify_as_built

    with stages(3, silent=output == "quiet") as screen:
        report = verify_as_built(folder, calibration, progress=screen.stage)
    report.show(report_console(), output)
    return 0 if report.passed else 1


OutOption = Annotated[Path | None, typer.Option("--out", "-o")]
"""PNG file to write; by default named after the subject."""
OfOption = Annotated[str, typer.Option()]
"""Subject: shell (both halves from outside, and the mirrors from a camera); edges or seam (of the
mirrors, close up); rig, sides, base, seat or exploded (the prototype)."""


@app.command()
def picture(
    folder: Exports[Path],
    out: OutOption = None,
    of: OfOption = "shell",
    force: ForceFile = False,
) -> int:
    """Draw the shells or the prototype from the files of a build."""
    from tbcad.report.drawing import picture as draw

    file = out or Path(f"{of}.png")
    draw(folder, file, of, force)
    typer.echo(f"{file}: written")
    return 0


@app.command()
def doctor(json: JsonResult = False) -> int:
    """Check that this Python environment has all that tbcad needs, and say how to repair it."""
    from tbcad.app.doctor import diagnose

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


@command()
def report(options: ReportOptions) -> int:
    """Write report.html: verdict, 3D view, map of the virtual cameras, tables, pictures.

    One file that opens from disk in any browser, without a network. tbcad build writes it too;
    write it again after a new verification, or to add pictures. Exit code 0, or 2 for bad input.
    """
    file: Path = on_screen(2, "report_page", options)
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")
    return 0


tell_options(__name__)
