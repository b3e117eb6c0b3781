"""Simulate the photographs of an object through the mirrors of an export."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from tbcad.app.cli.app import command
from tbcad.app.cli.output_mode import print_json
from tbcad.common.screen import stages
from tbcad.errors import InputError
from tbcad.options.captures import CaptureOptions, Geometry
from tbcad.options.shared import JsonResult

CAPTURES, BUILT_IN = Path("captures"), "knot"


@command()
def capture(
    options: CaptureOptions,
    mesh: Annotated[
        bool,
        typer.Option("--mesh", help="Trace the exported meshes instead of the recorded spheres."),
    ] = False,
    prototype: Annotated[
        bool,
        typer.Option(
            "--prototype",
            help="Trace the balls of the prototype, stop by stop, and merge the photographs into "
            "those of the shell.",
        ),
    ] = False,
    json: JsonResult = False,
) -> int:
    """Simulate the photographs of an object by both cameras through the mirrors of an export.

    Writes both photographs at the full size of the sensors, and the light field: the ray, colour
    and mirror of every pixel.
    """
    if mesh and prototype:
        raise InputError("--mesh and --prototype exclude each other: leave one out")
    from tbcad.app.api import photograph, write_photographs

    name = Path(options.object_file).stem if options.object_file else BUILT_IN
    lights, frames, out = options.lights, options.frames, Path(options.out or CAPTURES / name)
    geometry: Geometry = "mesh" if mesh else "prototype" if prototype else "spheres"
    with stages(3 + (lights is not None) + (frames is not None)) as screen:
        asked = replace(options, out=out, geometry=geometry).on(screen)
        photographs = photograph(asked)
        record = write_photographs(photographs, asked)
    if json:
        print_json(record)
        return 0
    for camera, counts in record["cameras"].items():
        seen, on = counts["pixels_that_see_the_capture_sphere"], counts["pixels_on_mirrors"]
        typer.echo(f"camera {camera}: {on} pixels on mirrors, {seen} see the capture sphere")
    if reflectance := record.get("reflectance"):
        size = (out / "reflectance.h5").stat().st_size / 1e6
        lamps_and_rays = f"{reflectance['lamps']} lamps, {reflectance['rays']} rays"
        typer.echo(f"{out / 'reflectance.h5'}: {lamps_and_rays}, {size:.0f} MB")
    if frames is not None:
        size = (out / "sequence.h5").stat().st_size / 1e6
        typer.echo(f"{out / 'sequence.h5'}: {frames} frames, {size:.0f} MB")
    typer.echo(f"{out}: {photographs.subject.name} as camera_a.png, camera_b.png and lightfield.h5")
    return 0
