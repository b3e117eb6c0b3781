"""Write a light field as data that other programs read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from tbcad.cli.app import app
from tbcad.cli.early_checks import check_is_capture
from tbcad.cli.options import Capture, Force, JsonResult, OutReplaced
from tbcad.cli.output_mode import print_result
from tbcad.errors import InputError
from tbcad.screen import stages

STAGES = 4
WRITTEN = {
    "nerfstudio": "transforms.json, images, masks and points.ply",
    "colmap": "images, masks and the model in sparse/0, binary and text",
    "ngp-rays": "transforms.json, and images with rays_*.dat and dynamic_mask_*.png",
    "rays": "rays.npz and rays.h5 with origin, direction, colour and camera of every ray",
    "mitsuba": "camera_a.xml, camera_b.xml and blender.py with their meshes",
}

NOTES = {
    "rms_distance_from_common_point_mm": " RMS",
    "central_error_at_capture_radius_mm": " at the ends of the capture sphere",
}


@app.command()
def export(
    capture: Capture,
    to: Annotated[
        Literal["nerfstudio", "colmap", "ngp-rays", "rays", "mitsuba"] | None,
        typer.Option(
            help="nerfstudio, colmap: virtual cameras as pinholes, with masks; ngp-rays: crops "
            "with the ray of every pixel for instant-ngp; rays: all rays as numpy arrays and HDF5; "
            "mitsuba: the machine itself as scenes for Mitsuba and Blender."
        ),
    ] = None,
    out: OutReplaced = Path("data"),
    every: Annotated[
        int,
        typer.Option(min=1, metavar="N", help="One virtual camera of N, spread evenly."),
    ] = 1,
    size: Annotated[
        int | None,
        typer.Option(
            metavar="PIXELS",
            help="Width and height of the pictures; by default as fine as the finest tenth of the "
            "virtual cameras.",
        ),
    ] = None,
    cameras: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="a, b, or mirrors by name, as a0001,b0007; by default all.",
        ),
    ] = None,
    exports: Annotated[
        Path | None,
        typer.Option(
            "--exports",
            metavar="FOLDER",
            help="Folder written by tbcad build, with the shells; for --to mitsuba.",
        ),
    ] = None,
    force: Force = False,
    json: JsonResult = False,
) -> int:
    """Write virtual cameras of a capture for nerfstudio, COLMAP or instant-ngp, rays, or a scene.

    Each mirror's crop is resampled to the picture of a pinhole at the point that its rays come
    nearest to, right way round, with a mask. Prints how far rays and pinholes are apart.
    """
    if to is None:
        raise InputError(f"--to is missing, allowed is one of {', '.join(WRITTEN)}: add it")
    check_is_capture(capture)
    from tbcad.api import export as exported

    with stages(STAGES) as screen:
        record = exported(
            capture,
            to,
            out=out,
            every=every,
            size=size,
            cameras=cameras,
            exports=exports,
            force=force,
            progress=screen.stage,
            detail=screen.detail,
        )
    figures = "dataset.json" if to == "mitsuba" else "dataset.json, cameras.csv"
    files = f"{out}: {WRITTEN[to]}; {figures} with these figures"
    lines = _scene_lines(record) if to == "mitsuba" else _lines(record)
    print_result(record, [*lines, files], json)
    return 0


def _scene_lines(record: dict[str, Any]) -> Iterator[str]:
    for part, count in record["facets"].items():
        yield f"{part}: {count} facets"


def _lines(record: dict[str, Any]) -> Iterator[str]:
    """What is written first, then how well pinholes fit."""
    fit, left_out = record["fit"], len(record["left_out"])
    size = record.get("size_px")
    content = f"{record['rays']} rays" if size is None else f"{size} x {size} pixels each"
    missing = f"; {left_out} mirrors give none" if left_out else ""
    yield f"{record['virtual_cameras']} virtual cameras, {content}{missing}"
    for text, name in (
        ("captured rays miss the pinhole by", "rms_distance_from_common_point_mm"),
        ("rays of the pinhole are off by", "central_error_at_capture_radius_mm"),
        ("captured pixels are apart by", "pixel_pitch_mm"),
    ):
        note = NOTES.get(name, "")
        yield f"{text} {fit[name]['median']:.2f} mm (median), {fit[name]['max']:.2f} (worst){note}"
    errors = record.get("reprojection_error_px")
    if errors:
        yield (
            f"points of the object appear {errors['median']:.3f} pixels off (median), "
            f"{errors['percentile_95']:.3f} (95 %)"
        )
