"""Captures as data of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.api.arguments import silent
from tbcad.errors import InputError

if TYPE_CHECKING:
    from tbcad.datasets.options import Target
    from tbcad.types import Progress


def export(
    capture: Path | str,
    to: Target,
    *,
    out: Path | str,
    every: int = 1,
    size: int | None = None,
    cameras: str | None = None,
    exports: Path | str | None = None,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> dict[str, Any]:
    """Write the light field of a capture as data that another program reads.

    Args:
        capture: folder that `capture` or `merge` wrote, or its lightfield.h5.
        to: virtual cameras as pinholes with pictures and masks ("nerfstudio", "colmap"), or every
            pixel with its ray, not resampled, for instant-ngp ("ngp-rays") or as numpy arrays
            ("rays"); or the machine itself as scenes for Mitsuba and Blender ("mitsuba").
        out: folder to write, replaced as a whole.
        every: one virtual camera of so many, spread evenly.
        size: width and height of the pictures, pixels; None: as fine as the capture.
        cameras: "a", "b" or mirrors by name, apart by commas; None: all.
        exports: folder that `build` wrote, with the shells of the machine; for "mitsuba" only.
        force: keep files in the folder that tbcad did not write.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Returns:
        What is in dataset.json: also how far the rays are from those of pinholes; of scenes the
        numbers of facets.

    Raises:
        InputError: the capture cannot be read, an option does not fit it, or out cannot be
            replaced.
    """
    from tbcad.datasets.export import write_dataset, write_scene
    from tbcad.datasets.options import ExportOptions
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest
    from tbcad.simulate.capture.files import OBJECT, read_object
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.scene.ray_casting import prepared_scene

    if (to == "mitsuba") != (exports is not None):
        raise InputError(
            "--to mitsuba shows the shells of an export: give its folder by --exports"
            if exports is None
            else f"--exports {exports} is for --to mitsuba: leave it out"
        )
    options, place = ExportOptions(to, every, cameras, size), Path(capture)
    inputs = (place if place.is_dir() else place.parent, exports)
    check_replaceable(Path(out), "dataset", force, inputs)
    known = (place / OBJECT).is_file()
    with LightField.open(place) as source, replacing(Path(out), "dataset", force, inputs) as folder:
        scene = prepared_scene(read_object(place)) if known else None
        if exports is not None:
            record = write_scene(folder, source, scene, Path(exports), progress)
        else:
            record = write_dataset(folder, source, scene, options, progress, detail)
        write_manifest(folder, "dataset")
    return record
