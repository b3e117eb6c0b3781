"""Captures as data of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tbcad.options.call import keywords
from tbcad.options.captures import ExportOptions
from tbcad.options.checks import check_is_capture


@keywords(ExportOptions)
def dataset(options: ExportOptions) -> dict[str, Any]:
    """Write the light field of a capture as data that another program reads.

    Returns:
        What is in dataset.json: also how far the rays are from those of pinholes; of scenes the
        numbers of facets.

    Raises:
        InputError: the capture cannot be read, an option does not fit it, or out cannot be
            replaced.
    """
    options.check()
    place, out, exports = Path(options.capture), Path(options.out), options.exports
    check_is_capture(place)
    from tbcad.light.datasets.export import write_dataset, write_scene
    from tbcad.light.simulate.capture.files import OBJECT, read_object
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.scene.ray_casting import prepared_scene
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest

    inputs = (place if place.is_dir() else place.parent, exports)
    check_replaceable(out, "dataset", options.force, inputs)
    known = (place / OBJECT).is_file()
    with (
        LightField.open(place) as source,
        replacing(out, "dataset", options.force, inputs) as folder,
    ):
        scene = prepared_scene(read_object(place)) if known else None
        if exports is not None:
            record = write_scene(folder, source, scene, Path(exports), options.progress)
        else:
            record = write_dataset(folder, source, scene, options)
        write_manifest(folder, "dataset")
    return record


export = dataset  # as it was called at first
