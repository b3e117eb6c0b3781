"""Simulate photographs, and write captures for other programs."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tbcad.app.cli.app import command, on_screen, print_result, result_lines
from tbcad.app.cli.endings import Stopped
from tbcad.common.screen import stages
from tbcad.errors import InputError
from tbcad.options.call import tell_options
from tbcad.options.captures import CaptureOptions, DatasetOptions, Geometry, ReconstructOptions
from tbcad.options.shared import JsonResult

CAPTURES, BUILT_IN = Path("captures"), "knot"
if TYPE_CHECKING:
    from tbcad.app.api.reconstructions import Reconstructed


MeshOption = Annotated[bool, typer.Option("--mesh")]
"""Trace the build's meshes instead of the recorded spheres."""
PrototypeOption = Annotated[bool, typer.Option("--prototype")]
"""Trace the balls of the prototype, stop by stop, and merge the photographs into those of the
shell."""


@command()
def capture(
    options: CaptureOptions,
    mesh: MeshOption = False,
    prototype: PrototypeOption = False,
    json: JsonResult = False,
) -> int:
    """Simulate the photographs of an object by both cameras through the mirrors of a build.

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
    written = f"{photographs.scene.subject.name} as camera_a.png, camera_b.png and lightfield.h5"
    print_result(record, [*_capture_lines(record, out, frames), f"{out}: {written}"], json)
    return 0


def _capture_lines(record: dict[str, Any], out: Path, frames: int | None) -> Iterator[str]:
    for camera, counts in record["cameras"].items():
        seen, on = counts["pixels_that_see_the_capture_sphere"], counts["pixels_on_mirrors"]
        yield f"camera {camera}: {on} pixels on mirrors, {seen} see the capture sphere"
    told = {"sequence.h5": f"{frames} frames"} if frames is not None else {}
    if reflectance := record.get("reflectance"):
        lamps = f"{reflectance['lamps']} lamps, {reflectance['rays']} rays"
        told = {"reflectance.h5": lamps, **told}
    for name, text in told.items():
        yield f"{out / name}: {text}, {(out / name).stat().st_size / 1e6:.0f} MB"


WRITTEN = {
    "nerfstudio": "transforms.json, images, masks and points.ply",
    "colmap": "images, masks and the model in sparse/0, binary and text",
    "ngp-rays": "transforms.json, and images with rays_*.dat and dynamic_mask_*.png",
    "rays": "rays.npz and rays.h5 with origin, direction, colour and camera of every ray",
    "mitsuba": "camera_a.xml, camera_b.xml and blender.py with their meshes",
}


@command()
def dataset(options: DatasetOptions, json: JsonResult = False) -> int:
    """Write virtual cameras of a capture for nerfstudio, COLMAP or instant-ngp, rays, or a scene.

    Each mirror's crop is resampled to the picture of a pinhole at the point that its rays come
    nearest to, right way round, with a mask. Prints how far rays and pinholes are apart.
    """
    to = options.check()
    record = on_screen(4, "dataset", options)
    figures = "dataset.json" if to == "mitsuba" else "dataset.json, cameras.csv"
    files = f"{options.out}: {WRITTEN[to]}; {figures} with these figures"
    facets = record.get("facets", {})  # of a scene
    scene = [f"{part}: {count} facets" for part, count in facets.items()]
    lines = scene if to == "mitsuba" else _lines(record)
    print_result(record, [*lines, files], json)
    return 0


def _lines(record: dict[str, Any]) -> Iterator[str]:
    """Lines on the files written, then on how well pinholes fit."""
    left_out, size = len(record["left_out"]), record.get("size_px")
    return result_lines(
        "dataset",
        content=f"{record['rays']} rays" if size is None else f"{size} x {size} pixels each",
        missing=f"; {left_out} mirrors give none" if left_out else "",
        reprojected=record.get("reprojection_error_px"),
        **record,
    )


AllFramesOption = Annotated[bool, typer.Option("--all-frames")]
"""All frames, one after the other, each started from the one before; the number of the frame is
added to the names of files."""


@command()
def reconstruct(
    options: ReconstructOptions,
    all_frames: AllFramesOption = False,
    json: JsonResult = False,
) -> int:
    """Reconstruct one object from all rays of a light field, as a field of density and colour.

    The field is fitted to all photographed rays, from a coarse grid to a fine one. Views of it are
    sharper than those of the light field alone; they are the default where it lies beside it.
    """
    if options.frame is not None and all_frames:
        raise InputError("--frame and --all-frames exclude each other: leave one out")
    from tbcad.app.api.reconstructions import checked_frames, expected_seconds, reconstruct_files

    asked = replace(options, frame="all") if all_frames else options
    frames = checked_frames(asked)
    try:
        with stages(expected_seconds(asked, frames)) as screen:
            done = reconstruct_files(asked.on(screen), frames)
    except KeyboardInterrupt:
        parts = [str(frame.part) for frame in frames if frame.part.exists()]
        if not parts:
            raise
        kept = f"{parts[0]} keeps what is done: go on with the same options and --resume"
        raise Stopped(kept) from None
    record = {"schema": "tbcad-reconstruct/1", "fields": [one.record() for one in done]}
    print_result(record, (line for one in done for line in _reconstruction_lines(one)), json)
    return 0


def _reconstruction_lines(one: "Reconstructed") -> Iterator[str]:
    """The verdict first."""
    facts: dict[str, Any] = one.field.facts
    yield from result_lines(
        "reconstruct",
        none_left_out=not facts["mirrors_left_out"],
        several="1 ray" if facts["rays_a_pixel"] == 1 else f"{facts['rays_a_pixel']} rays",
        unexplained=100 * facts["unexplained_light"],
        file=one.file,
        word="was there already" if one.kept else "written",
        grids=", ".join(str(level["nodes"]) for level in facts["chosen"]["levels"]),
        **facts,
    )
    for file, known in one.meshes.items():
        yield f"{file}: {known['triangles']} triangles"
        if "mean_mm" in known:
            yield (
                f"  from the true object: mean {known['mean_mm']:.3f} mm, 95 % within "
                f"{known['percentile_95_mm']:.3f} mm, at most {known['hausdorff_mm']:.2f} mm, "
                "where rays see it"
            )


tell_options(__name__)
