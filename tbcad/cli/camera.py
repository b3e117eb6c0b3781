"""The command that says which camera and lens a design needs."""

import json as json_text
from pathlib import Path
from typing import Annotated

import typer

from tbcad.cli.app import app
from tbcad.options.shared import Design, Settings

CameraList = Annotated[
    Path | None,
    typer.Option(
        "--cameras",
        metavar="FILE",
        help="CSV list of further cameras, with the columns of docs/camera.md.",
    ),
]
LensList = Annotated[
    Path | None,
    typer.Option(
        "--lenses",
        metavar="FILE",
        help="CSV list of further lenses, with the columns of docs/camera.md.",
    ),
]


@app.command()
def camera(
    design: Design[Path] = None,
    n: Annotated[
        int | None, typer.Option(help="Subdivision of the icosahedron, 2 to 60; the paper has 18.")
    ] = None,
    settings: Settings = None,
    cameras: CameraList = None,
    lenses: LensList = None,
    json: Annotated[bool, typer.Option("--json", help="Print the sheet as JSON.")] = False,
) -> int:
    """Say which sensor, lens, stop and focus a design needs, and which cameras on sale have them.

    Exit code 0: some camera of the lists does. 1: none does. 2: bad input.
    """
    from tbcad.camera.catalogue import load_cameras, load_lenses
    from tbcad.spec.load import load_spec

    options = list(settings or []) + ([f"optics.n={n}"] if n is not None else [])
    spec = load_spec(design, options)
    listed = load_cameras(cameras), load_lenses(lenses)

    from tbcad.api import design as mirror_design
    from tbcad.camera.requirements import camera_requirements
    from tbcad.camera.sheet import best_lenses, sheet_lines, sheet_record

    array = mirror_design(spec).arrays[0]
    needed = camera_requirements(array, spec.optics.capture_diameter_mm / 2)
    best = best_lenses(needed, *listed)
    record = sheet_record(needed, best)
    typer.echo(json_text.dumps(record, indent=1) if json else "\n".join(sheet_lines(needed, best)))
    return 0 if any(not one.faults for one in best) else 1
