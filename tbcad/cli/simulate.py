"""Simulate the photographs of an object through the mirrors of an export."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.cli.app import app
from tbcad.cli.output_mode import print_json
from tbcad.errors import InputError
from tbcad.options.checks import check_is_export, check_is_object
from tbcad.options.shared import (
    Exports,
    Force,
    JsonResult,
    ObjectFile,
    PaintOption,
    UnitOption,
    UpOption,
)
from tbcad.screen import stages

if TYPE_CHECKING:
    from tbcad.simulate.camera_photographs import Geometry

MOST_SAMPLES = 8
CAPTURES, BUILT_IN = Path("captures"), "knot"


@app.command()
def capture(
    folder: Exports[Path],
    object_file: ObjectFile[Path] = None,
    up: UpOption = None,
    unit: UnitOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="Folder for all files; replaced as a whole or not at all. By default captures/ "
            "with the name of the object, such as captures/knot.",
        ),
    ] = None,
    fit: Annotated[
        bool, typer.Option("--fit", help="Move and scale the object into the capture sphere.")
    ] = False,
    paint: PaintOption = "own",
    samples: Annotated[
        int,
        typer.Option(
            min=1, max=MOST_SAMPLES, help="Anti-aliasing: a pixel is the mean of N x N rays."
        ),
    ] = 1,
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
    lights: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Also write a reflectance field, a photograph for each lamp: FILE is a table with "
            "the columns x_mm,y_mm,z_mm; the word mirrors is a lamp in the place of each virtual "
            "camera, projectors what each mirror throws of a projector in its camera's place.",
        ),
    ] = None,
    every: Annotated[
        int,
        typer.Option(min=1, metavar="N", help="One lamp of N, of --lights mirrors or projectors."),
    ] = 1,
    frames: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=10_000,
            help="Also photograph the object N times while it turns about z, as one file.",
            metavar="N",
        ),
    ] = None,
    turn: Annotated[
        float, typer.Option(help="How far the object turns during all frames, degrees.")
    ] = 360.0,
    force: Force = False,
    json: JsonResult = False,
) -> int:
    """Simulate the photographs of an object by both cameras through the mirrors of an export.

    Writes both photographs at the full size of the sensors, and the light field: the ray, colour
    and mirror of every pixel.
    """
    if mesh and prototype:
        raise InputError("--mesh and --prototype exclude each other: leave one out")
    if lights is not None and samples > 1:
        raise InputError("--lights follows one ray a pixel: leave out --samples")
    if every > 1 and lights not in ("mirrors", "projectors"):
        raise InputError(
            "--every chooses among the lamps of --lights mirrors or projectors: leave it out"
        )
    if lights == "projectors" and prototype:
        raise InputError(
            "--lights projectors is light from the mirrors of shells: leave out --prototype"
        )
    if frames is not None and (samples > 1 or prototype):
        raise InputError("--frames follows one ray a pixel: leave out --samples and --prototype")
    check_is_export(folder)
    check_is_object(object_file, up, unit)
    from tbcad.api import WantedFrames, WantedLamps, photograph, write_photographs
    from tbcad.output.folder import check_replaceable
    from tbcad.output.inputs import files_named
    from tbcad.simulate.scene.object_from_file import ObjectOptions

    out = out or CAPTURES / (object_file.stem if object_file else BUILT_IN)
    geometry: Geometry = "mesh" if mesh else "prototype" if prototype else "spheres"
    check_replaceable(out, "capture", force, (folder, object_file, *files_named(lights)))
    options = ObjectOptions(fit, paint, up, unit)
    with stages(3 + (lights is not None) + (frames is not None)) as screen:
        said = screen.stage, screen.detail, screen.note
        photographs = photograph(folder, object_file, geometry, options, samples, *said)
        lamps = None if lights is None else WantedLamps(lights, every)
        moving = None if frames is None else WantedFrames(frames, turn)
        record = write_photographs(
            photographs, out, force, screen.stage, screen.detail, lamps, moving
        )
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
