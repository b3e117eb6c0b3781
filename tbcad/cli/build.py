"""Build, prove and draw: heavy libraries are imported inside the commands."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.cli.app import app
from tbcad.errors import InputError
from tbcad.screen import Stages, stages

if TYPE_CHECKING:
    from tbcad_verify.report.report import Report
    from tbcad_verify.run.verify import Options

    from tbcad.spec.design import Spec

# With mirrors and manifest; both together take a stage for the shells, which are built beside.
BUILD_STAGES = {("shell",): 7, ("prototype",): 9, ("shell", "prototype"): 10}
PROOF_STAGES, PIPED_WIDTH = 9, 160


class RadiusRule(StrEnum):
    """How the mirrors get their radii."""

    TRACED = "traced"
    PAPER = "paper"
    FLAT = "flat"


@app.command()
def build(
    design: Annotated[
        Path | None,
        typer.Argument(help="Design file (TOML); without one, the design of the paper."),
    ] = None,
    n: Annotated[
        str | None,
        typer.Option(
            metavar="N",
            help="Subdivision of the icosahedron, 1 to 60: mirrors grow with its square.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(help="Folder for all files; it is replaced as a whole or not at all.")
    ] = Path("exports"),
    radius_rule: Annotated[
        RadiusRule | None,
        typer.Option(
            help="traced: every mirror sees the whole object, by exact rays; "
            "paper: eqs. 1 and 2; flat: planar mirrors."
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Change any key of the design; repeatable."
        ),
    ] = None,
    parts: Annotated[
        str | None,
        typer.Option(
            help="What to build: shell, prototype, or both with a comma between them; without, "
            "both, but no prototype of planar mirrors."
        ),
    ] = None,
    for_process: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="Give the design the margin that this process needs: fdm, sls, sla, cnc, diamond, "
            "or a TOML file; see tbcad tolerance.",
        ),
    ] = None,
    wanted: Annotated[
        float, typer.Option("--yield", help="Share of machines that --for-process makes good.")
    ] = 0.99,
    verify: Annotated[bool, typer.Option(help="Prove the optics on the files written.")] = True,
    force: Annotated[
        bool, typer.Option("--force", help="Keep files in the folder that tbcad did not write.")
    ] = False,
) -> int:
    """Compute the mirrors, build shells and prototype, write STEP, STL and 3MF, and prove them.

    Exit code 0: built and proved. 1: built, but the proof fails (the files stay). 2: bad input,
    nothing written.
    """
    from tbcad.output.folder import check_target
    from tbcad.output.parts import default_parts, parse_parts
    from tbcad.spec.design import load_spec

    asked = parse_parts(parts) if parts is not None else None
    options = list(settings or [])
    options += [f"optics.n={n}"] if n is not None else []
    options += [f"mirrors.radius_rule={radius_rule}"] if radius_rule else []
    spec = load_spec(design, options)
    made = asked or default_parts(spec)
    check_target(out, force)
    with stages(BUILD_STAGES[made] + PROOF_STAGES * verify + bool(for_process)) as told:
        if for_process is not None:
            spec = _margined(spec, for_process, wanted, told)
        report = _built(spec, out, made, force, verify, told)
    if for_process is not None:
        typer.echo(f"margin {spec.mirrors.margin_mm:g} mm, for {wanted:.1%} by {for_process}")
    if report is None:
        typer.echo(f"{out}: built, not proved: run tbcad verify {out}")
        return 0
    typer.echo(f"{out}: {' and '.join(made)} as STEP, STL and 3MF; mirrors.csv, design.json")
    _show(report)
    return 0 if report.passed else 1


def _margined(spec: "Spec", name: str, wanted: float, told: Stages) -> "Spec":
    from tbcad.tolerance.process.process import load_process
    from tbcad.tolerance.process_design import for_process

    told.stage(f"margin for {name}")
    return for_process(spec, load_process(name), wanted, told.detail)


def _built(
    spec: "Spec", out: Path, parts: tuple[str, ...], force: bool, verify: bool, told: Stages
) -> "Report | None":
    """The stages of a build; the proof reads the files back before they replace the old ones."""
    from tbcad.mirrors.array import design
    from tbcad.output.build import export
    from tbcad.output.folder import replacing

    told.stage("mirrors: radii and cells")
    made = design(spec, told.detail)
    with replacing(out, force) as folder:
        export(made, folder, parts, told.stage)
        return _prove(folder, told) if verify else None


@app.command("verify")
def verify_command(
    folder: Annotated[Path, typer.Argument(help="Folder written by tbcad build.")],
    printers: Annotated[
        list[str] | None,
        typer.Option(
            "--printer",
            metavar="NAME|FILE",
            help="Fail unless every part suits this machine: fdm, sla, sls, machined, or a TOML "
            "file; repeatable.",
        ),
    ] = None,
    clients: Annotated[
        bool,
        typer.Option(
            "--clients", help="Ask FreeCAD, gmsh, PrusaSlicer and admesh too, where installed."
        ),
    ] = False,
    time_limit: Annotated[
        float, typer.Option(metavar="S", help="Seconds that each stage, file or program may take.")
    ] = 600.0,
) -> int:
    """Prove an export on its files, and write verify.json there.

    Exit code 0: proved. 1: the proof fails. 2: not an export, or a broken one.
    """
    from tbcad_verify.run.verify import Options

    if not time_limit > 0:
        raise InputError(f"--time-limit must be more than 0 seconds, not {time_limit:g}")
    with stages(PROOF_STAGES) as told:
        wishes = Options(seconds=time_limit, printers=tuple(printers or ()), clients=clients)
        report = _prove(folder, told, wishes)
    _show(report)
    return 0 if report.passed else 1


def _prove(folder: Path, told: Stages, wishes: "Options | None" = None) -> "Report":
    """The proof knows nothing of tbcad; its own refusals become ours."""
    from tbcad_verify.errors import BadExport
    from tbcad_verify.run.verify import Options, verify

    try:
        return verify(folder, lambda text: told.stage(f"proof: {text}"), wishes or Options())
    except BadExport as error:
        raise InputError(str(error)) from None


def _show(report: "Report") -> None:
    from rich.console import Console

    # Piped, a table needs no terminal's width.
    report.show(Console() if sys.stdout.isatty() else Console(width=PIPED_WIDTH))


@app.command()
def picture(
    folder: Annotated[Path, typer.Argument(help="Folder written by tbcad build.")],
    out: Annotated[
        Path | None, typer.Option(help="PNG file to write; without, named after its subject.")
    ] = None,
    of: Annotated[
        str,
        typer.Option(
            help="shell: both halves, from outside and as a camera looks up into the mirrors; "
            "rig, base, seat or exploded: the prototype."
        ),
    ] = "shell",
) -> int:
    """Draw the shells or the prototype from the files of an export."""
    from tbcad.report.drawing import picture as draw

    file = out or Path(f"{of}.png")
    draw(folder, file, of)
    typer.echo(f"{file}: drawn")
    return 0


@app.command()
def doctor() -> int:
    """Check that this Python environment has all that tbcad needs, and say how to mend it."""
    from rich.console import Console
    from rich.table import Table

    from tbcad.doctor import diagnose

    findings = diagnose()
    table = Table("", "what", "found", "what to do", box=None)
    for finding in findings:
        table.add_row("ok" if finding.ok else "NO", finding.name, finding.detail, finding.remedy)
    Console().print(table)
    return 0 if all(finding.ok for finding in findings) else 1
