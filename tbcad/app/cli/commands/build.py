"""Build, verify and draw: heavy libraries are imported inside the commands."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tbcad.app.cli.app import Full, Json, Quiet, app, command, output_mode, print_json
from tbcad.common.screen import Stages, report_console, stages
from tbcad.core.mirrors.array import design
from tbcad.core.spec.design import Spec
from tbcad.core.spec.load import spec_dict
from tbcad.errors import InputError
from tbcad.options.builds import BuildOptions, ReportOptions, VerificationOptions
from tbcad.options.checks import check_is_calibration
from tbcad.options.shared import Exports, ForceFile, JsonResult
from tbcad.output.overview import Overview, PrintEstimate, PrototypeOverview, overview
from tbcad.output.parts import PARTS, PROTOTYPE, SHELL

if TYPE_CHECKING:
    from tbcad_verify.report.report import Output
MINUTE = 60
# Seconds of a verified build of the paper's design (n = 18) on two cores: whatever the mirrors, and
# in proportion to their number but for a fixed share.
SECONDS = {(SHELL,): (1.0, 25.8), (PROTOTYPE,): (20.7, 12.8), PARTS: (20.7, 18.8)}
N, FIXED_SHARE = 18, 0.2
if TYPE_CHECKING:
    from tbcad_verify.report.report import Output

    from tbcad.app.doctor import Finding
# About as many stages has a build, without and with its verification.
SHELL_STAGES, PROTOTYPE_STAGES, VERIFICATION_STAGES = (5, 14), (9, 27), 19
FINDING_WIDTHS = (2, 22, 53)  # columns of a finding: whether it is good, its name, what was found


def show_overview(
    spec: Spec, parts: Sequence[str], optional: bool, output: "Output", screen: Stages
) -> int:
    """Print what a build would give, as a record when that is the output."""
    screen.stage("mirrors: radii and cells")
    figures = overview(design(spec), parts, screen.stage, optional_prototype=optional)
    there = [part for part in parts if part != PROTOTYPE or figures.prototype]
    fixed, of_mirrors = SECONDS[tuple(there)]
    share = FIXED_SHARE + (1 - FIXED_SHARE) * (spec.optics.n / N) ** 2
    seconds = fixed + share * of_mirrors
    if output == "json":
        typer.echo(json.dumps(overview_record(figures, seconds), indent=1))
    else:
        typer.echo("\n".join(overview_lines(figures, seconds)))
    return 0


def overview_lines(figures: Overview, seconds: float) -> list[str]:
    """Lines of at most 80 columns; seconds: that the build is expected to take."""
    radii = "planar"
    if figures.radius_mm is not None:
        radii = "radius {:.1f} to {:.1f} mm".format(*figures.radius_mm)
    lines = [
        f"mirrors           {figures.mirrors} ({figures.virtual_cameras} virtual cameras), {radii}",
        f"minimum coverage  {figures.minimum_coverage_mm:.2f} mm, of "
        f"{figures.spec.optics.capture_diameter_mm:g} mm",
        f"lens              {figures.view_angle_deg:g} degrees across "
        f"{figures.spec.camera.width_px} pixels",
    ]
    if figures.shell_prints:
        lines.append(f"both shells       {_print_text(figures.shell_prints)}")
    if figures.prototype:
        lines += _prototype_lines(figures.prototype)
    if figures.note:
        lines.append(figures.note)
    minutes = max(seconds / MINUTE, 0.1)
    return [
        *lines,
        f"build             about {minutes:.1f} minutes with verification, on two cores",
    ]


def overview_record(figures: Overview, seconds: float) -> dict[str, Any]:
    """The same for programs: fields of `Overview`, masses in grams, prices by currency."""
    record = asdict(figures) | {"spec": spec_dict(figures.spec)}
    return record | {"build_seconds": round(seconds)}


def _prototype_lines(figures: PrototypeOverview) -> Iterator[str]:
    caps = f" and {figures.caps} caps" if figures.caps else ""
    yield f"prototype         {figures.balls} balls{caps}, {figures.stops} stops, " + (
        f"swing {figures.swing_deg:.0f} degrees"
    )
    yield f"  coverage        {figures.minimum_coverage_mm:.2f} mm, " + (
        f"{figures.kept_share:.0%} of the shell's pixels"
    )
    yield f"  balls           {figures.ball_mass_g:.0f} g, {_price_text(figures.ball_price)}"
    yield f"  turning         {figures.turning_mass_g:.0f} g, driven by {figures.motor}"
    yield f"  printed parts   {_print_text(figures.prints)}"


def _print_text(figures: PrintEstimate) -> str:
    return (
        f"{figures.volume_cm3:.0f} cm3, about {figures.mass_g:.0f} g, {figures.hours:.0f} h, "
        f"{_price_text(figures.price)} by FDM"
    )


def _price_text(prices: Mapping[str, float]) -> str:
    """Sums in all currencies of the list of prices."""
    sums = (f"{amount:.0f} {currency}" for currency, amount in prices.items())
    return f"about {' and '.join(sums)}" if prices else "no price"


@command()
def build(
    options: BuildOptions,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run",
            help="Only show what would be built: mirrors, balls, masses, time and estimates of "
            "printing and cost; seconds, and nothing is written.",
        ),
    ] = False,
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
    from tbcad.app.api import build as build_files
    from tbcad.app.api.builds import planned, spec_for_process
    from tbcad.app.cli.memory import keep_freed_memory
    from tbcad.output.parts import PROTOTYPE

    keep_freed_memory()
    plan = planned(options)
    number = (PROTOTYPE_STAGES if PROTOTYPE in plan.parts else SHELL_STAGES)[options.verify]
    with stages(number, silent=quiet) as screen:
        shown = options.on(screen)
        if dry_run:
            from tbcad.app.cli.commands.build import show_overview

            spec = spec_for_process(plan, shown)
            return show_overview(spec, plan.parts, options.parts is None, output, screen)
        built = build_files(shown)
    if built.report is None:
        note = f"{built.note}\n" if built.note else ""
        out = options.out
        typer.echo(f"{note}{out}: built, not verified: run tbcad verify {out}")
        return 0
    built.report.show(report_console(), output)
    return 0 if built.passed else 1


@command("verify")
def verify_command(
    options: VerificationOptions,
    as_built: Annotated[
        Path | None,
        typer.Option(
            "--as-built",
            metavar="CALIBRATION",
            help="Instead of the files, verify the prototype as tbcad calibrate found it: what it "
            "covers, and what to shim. Writes nothing.",
        ),
    ] = None,
    full: Full = False,
    quiet: Quiet = False,
    json: Json = False,
) -> int:
    """Verify an export on its files, and write verify.json there.

    Exit code 0: verified. 1: the verification fails. 2: not an export, or a broken one.
    """
    output, folder = output_mode(full, quiet, json), Path(options.exports)
    if as_built is not None and (options.printers or options.clients or options.strict):
        raise InputError(
            "--as-built is about no files: leave out --printer, --clients and --strict"
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
    from tbcad.app.api import report_page

    with stages(2) as screen:
        file = report_page(options.on(screen))
    typer.echo(f"{file}: {file.stat().st_size / 1e6:.1f} MB")
    return 0
