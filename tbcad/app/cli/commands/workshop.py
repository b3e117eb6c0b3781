"""Parts, drawings, assembly: heavy libraries are imported inside the commands."""

from pathlib import Path
from typing import Annotated

import typer

from tbcad.app.cli.app import app, command, on_screen, print_json, print_result, result_lines
from tbcad.common.screen import stages
from tbcad.options.builds import OrderOptions
from tbcad.options.call import tell_options
from tbcad.options.checks import check_is_export, check_is_folder
from tbcad.options.shared import Design, Exports, ForceFile, JsonResult, Out, Settings

CamerasOption = Annotated[Path | None, typer.Option("--cameras", metavar="FILE")]
"""CSV list of further cameras, with the columns of docs/camera.md."""
LensesOption = Annotated[Path | None, typer.Option("--lenses", metavar="FILE")]
"""CSV list of further lenses, with the columns of docs/camera.md."""


@app.command()
def camera(
    design: Design[Path] = None,
    n: Annotated[
        int | None,
        typer.Option(
            "--n", "-n", help="Subdivision of the icosahedron, 2 to 60; the paper has 18."
        ),
    ] = None,
    settings: Settings = None,
    cameras: CamerasOption = None,
    lenses: LensesOption = None,
    use: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Camera of the lists that the prototype is made for."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the sheet as JSON.")] = False,
) -> int:
    """Say which sensor, lens, stop and focus a design needs, and which cameras on sale have them.

    With --use NAME: what that camera sets in the prototype, tried with all of its bodies; what does
    not fit is refused, with one that does. Exit code 0: some camera of the lists does. 1: none
    does. 2: bad input, or NAME does not fit.
    """
    from tbcad.core.spec.load import load_spec

    given = {"camera": use, "cameras": cameras, "lenses": lenses}
    options = list(settings or []) + ([f"optics.n={n}"] if n is not None else [])
    options += [
        f"prototype.frame.{key}={value}" for key, value in given.items() if value is not None
    ]
    spec = load_spec(design, options)

    from tbcad.app.api import design as mirror_design
    from tbcad.core.camera.lists import load_cameras, load_lenses
    from tbcad.core.camera.requirements import camera_requirements
    from tbcad.core.camera.sheet import best_lenses, sheet_lines, sheet_record
    from tbcad.prototype.camera_fit import fit_camera

    listed = load_cameras(cameras), load_lenses(lenses)
    mirrors = mirror_design(spec)
    needed = camera_requirements(mirrors.arrays[0], spec.optics.capture_diameter_mm / 2)
    best = best_lenses(needed, *listed)
    fitted = fit_camera(mirrors)
    record = sheet_record(needed, best, fitted.light)
    lines = fitted.lines if use else sheet_lines(needed, best, fitted.light)
    print_result(record | {"sets": fitted.sets}, lines, json)
    return 0 if any(not one.faults for one in best) else 1


@command()
def order(options: OrderOptions, json: JsonResult = False) -> int:
    """Write what a workshop needs for the shells: limits, what a chain holds of them, a page.

    order.pdf answers a workshop's questions; inspection_a.csv and inspection_b.csv have each
    mirror's sphere, its limits and what the chain holds of them; *_tolerances.step (AP242) the same
    with datums A, B, C, also of the mandrel where the chain has one. Exit code 0: the chain holds
    the design. 1: it does not. 2: bad input.
    """
    out, record = Path(options.out), on_screen(0, "order", options)
    figures = [
        {"of": "any" if one["limit"] is None else f"{one['limit']:.3g} {one['unit']}", **one}
        for one in record["chain"]["figures"]
    ]
    files = ", ".join(sorted(file.name for file in out.iterdir()))
    told = result_lines("order", figures=figures, out=out, written=files, record=record)
    print_result(record, told, json)
    return 0 if record["chain"]["holds"] else 1


PricesOption = Annotated[Path | None, typer.Option("--prices", metavar="FILE")]
"""CSV list of prices to use in place of the build's, with the columns of docs/prototype.md; bom.csv
stays as it is."""


@app.command()
def parts(
    folder: Exports[Path],
    prices: PricesOption = None,
    full: Annotated[bool, typer.Option("--full", help="Show every row.")] = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print totals and all rows as JSON.")
    ] = False,
) -> int:
    """Show what a build's prototype needs: totals of price, mass, filament and hours, then rows.

    Without --full the rows are those that cost most. Exit code 0, or 2 for bad input.
    """
    from tbcad.prototype.files.bom import read_parts_list
    from tbcad.prototype.purchased.parts import load_prices

    check_is_folder(folder)
    listed = read_parts_list(folder, load_prices([str(prices)]) if prices else None)
    print_result(listed.record(), listed.lines(full=full), json)
    return 0


@app.command()
def sag(
    folder: Exports[Path],
    json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> int:
    """Show how far weight moves the balls of a build's prototype as its base turns.

    Carrier, bearing head, shaft and uprights bend; modulus and infill are those of [printer]. What
    is left is after a calibration that moves each stop's balls as one. Exit code 0, or 2 for bad
    input.
    """
    check_is_export(folder)
    from tbcad.output.manifest import read_manifest, written_file
    from tbcad.prototype.gravity.sag import read_sag
    from tbcad.records.tables import BallRow, SagRow, StopRow

    for row in (BallRow, StopRow, SagRow):
        written_file(folder, read_manifest(folder), row.FILE, row.MISSING)
    found = read_sag(folder)
    assert found is not None  # there is a file
    print_result(found.record(), found.lines(), json)
    return 0


OnlyOption = Annotated[list[str] | None, typer.Option("--only", metavar="PART")]
"""Draw this only, such as bearing_head or optical_layout; repeatable. By default everything."""


@app.command()
def drawings(
    folder: Exports[Path],
    out: Out[Path] = Path("drawings"),
    only: OnlyOption = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print what was written as JSON, without progress.")
    ] = False,
    force: ForceFile = False,
) -> int:
    """Draw a build for the workshop: sheets as PDF to scale and as DXF at full size.

    A sheet for each printed part with views, sizes and a table of its holes; the assembly with
    call-outs by number of the parts list; sections of the shells; the optical layout. Exit code 0,
    or 2 for bad input.
    """
    check_is_export(folder)
    from tbcad.common.schedule import cores
    from tbcad.drawings.write import write_drawings

    with stages(0, silent=json) as screen:
        written = write_drawings(
            folder,
            out,
            only or (),
            force=force,
            progress=lambda name: screen.stage(f"drew {name}"),
            workers=cores(),
        )
    line = f"{out}: {len(written)} sheets, each as PDF and DXF"
    print_result({"folder": str(out), "sheets": written}, [line], json)
    return 0


@app.command()
def assembly(
    folder: Exports[Path],
    out: Out[Path] = Path("assembly"),
    pictures: Annotated[
        bool, typer.Option("--pictures/--no-pictures", help="Draw a picture for each step.")
    ] = True,
    json: Annotated[
        bool, typer.Option("--json", help="Print the steps as JSON and write nothing.")
    ] = False,
    force: ForceFile = False,
) -> int:
    """Write assembly.html: how a build's prototype is assembled, step by step, with pictures.

    Each step names its parts by their numbers in the list, torque or fit, and what to check. Exit
    code 0, or 2 for bad input.
    """
    from tbcad.errors import InputError
    from tbcad.prototype.assembly_steps.instructions import instructions
    from tbcad.prototype.assembly_steps.machine import read_machine
    from tbcad.prototype.assembly_steps.steps import record
    from tbcad.records.design import NAME as DESIGN
    from tbcad.records.design import DesignRecord
    from tbcad.report.assembly_page import NAME as PAGE
    from tbcad.report.assembly_page import write_page

    check_is_folder(folder)
    if out.suffix.lower() in (".html", ".htm"):
        raise InputError(f"{out}: allowed is a folder, which gets {PAGE}: name one with --out")
    machine = read_machine(folder)
    told = instructions(machine, DesignRecord.read(folder / DESIGN).spec.printer)
    steps = told.steps
    if json:
        print_json({"steps": record(steps)})
        return 0
    file = write_page(folder, out, told, pictures=pictures, force=force)
    typer.echo(f"{file}: {len(steps)} steps, {sum(machine.bill.quantities.values())} parts")
    return 0


tell_options(__name__)
