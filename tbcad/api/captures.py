"""Simulated photographs of both cameras."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tbcad.api.arguments import silent

if TYPE_CHECKING:
    from tbcad.simulate.capture.geometry import CameraPhotographs, Geometry
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.scene.object import Paint, SceneObject
    from tbcad.simulate.views.synthesis import Method, SynthesisedView
    from tbcad.types import Progress


def capture(
    exports: Path | str,
    object_file: Path | str | None = None,
    *,
    out: Path | str | None = None,
    geometry: Geometry = "spheres",
    fit: bool = False,
    paint: Paint = "own",
    samples: int = 1,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
) -> LightField:
    """Simulate the photographs of both cameras through the mirrors of a build.

    Args:
        exports: folder that `build` wrote.
        object_file: triangle mesh, mm, z up, about the origin; None for a built-in knot.
        out: folder to write photographs and light field to, as `tbcad capture` does; None: none.
        geometry: mirrors of the record ("spheres"), of the exported meshes ("mesh"), or the
            prototype's balls, stop by stop ("prototype").
        fit: move and scale the object into the capture sphere.
        paint: colours of the file ("own"), a pattern, or plain grey.
        samples: a pixel is the mean of samples x samples rays.
        force: keep files in the folder that tbcad did not write.
        progress: called with the name of each stage.
        detail: called with the state of a stage.

    Returns:
        The light field, in memory: for every pixel the ray it sees along and its colour.

    Raises:
        InputError: export or object cannot be read, or the folder cannot be replaced.
    """
    from tbcad.simulate.capture.light_field import LightField, light_field_in_memory

    photographs = photograph(exports, object_file, geometry, fit, paint, samples, progress, detail)
    if out is not None:
        write_photographs(photographs, Path(out), force, progress)
        return LightField.read(Path(out))
    progress("photographs and light field")
    bands = ((reflector, bands()) for reflector, bands in photographs.cameras)
    return light_field_in_memory(bands, photographs.capture_mm, photographs.facts)


def view(
    light_field: LightField,
    azimuth_deg: float = 0.0,
    elevation_deg: float = 30.0,
    *,
    distance_mm: float = 640.0,
    size: tuple[int, int] = (640, 480),
    method: Method | Literal["depth"] = "depth",
) -> SynthesisedView:
    """Synthesise the picture of a pinhole camera anywhere around the object, as `tbcad view` does.

    Args:
        light_field: in memory, or in an open file.
        azimuth_deg: of the camera about z, from x.
        elevation_deg: of the camera above the plane z = 0, 0 to 90.
        distance_mm: of the camera from the centre of the object.
        size: columns and rows of the picture.
        method: "nearest" rays, the quickest; "blend" on a plane; or a blend at the "depth" that
            the light field itself shows, the best, for which the pictures of all virtual cameras
            are made first.

    Raises:
        InputError: the viewpoint lies below the hemisphere of virtual cameras, or in the object.
    """
    from math import radians

    from tbcad.depth.view import depth_view
    from tbcad.simulate.scene.viewpoint import camera_around_object
    from tbcad.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.simulate.views.synthesis import synthesise

    angles = radians(azimuth_deg), radians(elevation_deg)
    camera = camera_around_object(*angles, distance_mm, light_field.capture_mm, size)
    tiles = MirrorTiles(light_field)
    if method == "depth":
        return depth_view(tiles, camera)[0]
    return synthesise(tiles, camera, method)


@dataclass(frozen=True)
class Photographs:
    """Both photographs before they are taken: light is traced when their bands are asked for.

    Attributes:
        cameras: each camera with what gives its bands of pixel rows.
        subject: the object before the cameras.
        capture_mm: diameter of the capture sphere.
        facts: how they are taken: design, n, geometry, samples.
    """

    cameras: CameraPhotographs
    subject: SceneObject
    capture_mm: float
    facts: dict[str, Any]


def photograph(
    exports: Path | str,
    object_file: Path | str | None,
    geometry: Geometry,
    fit: bool,
    paint: Paint,
    samples: int,
    progress: Progress,
    detail: Progress,
) -> Photographs:
    """Prepare both photographs; arguments as for `capture`."""
    from tbcad.simulate.capture.geometry import camera_photographs
    from tbcad.simulate.scene.exported import read_export
    from tbcad.simulate.scene.lamps import lit_by, read_lamps
    from tbcad.simulate.scene.object import load_or_built_in
    from tbcad.simulate.scene.ray_casting import prepared_scene

    progress("object and scene")
    export = read_export(Path(exports))
    subject = load_or_built_in(object_file, export.capture_mm, fit, paint)
    lamps = read_lamps(export.folder) if geometry == "prototype" else None
    subject = lit_by(lamps, subject) if lamps else subject
    cameras = camera_photographs(export, prepared_scene(subject), geometry, samples, detail)
    facts = {
        "object": subject.name,
        "design": export.spec.name,
        "n": export.spec.optics.n,
        "geometry": geometry,
        "samples": samples,
    } | ({"light": "lamps of the prototype"} if lamps else {})
    return Photographs(cameras, subject, export.capture_mm, facts)


def write_photographs(
    photographs: Photographs, out: Path, force: bool, progress: Progress
) -> dict[str, Any]:
    """Take both photographs and replace a folder by their files; return the record of them."""
    from tbcad.output.folder import replacing
    from tbcad.output.manifest import write_manifest
    from tbcad.simulate.capture.files import write_capture

    progress("photographs and light field")
    with replacing(out, force) as folder:
        record = write_capture(
            folder,
            photographs.cameras,
            photographs.subject,
            photographs.capture_mm,
            photographs.facts,
        )
        write_manifest(folder)
    return record
