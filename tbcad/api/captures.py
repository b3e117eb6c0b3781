"""Simulated photographs of both cameras."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.errors import InputError
from tbcad.options.call import silent

if TYPE_CHECKING:
    from tbcad.reflectance.environment import LightFormat
    from tbcad.simulate.camera_photographs import Geometry
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.capture.photograph import CameraPhotographs
    from tbcad.simulate.object_files.contents import Up
    from tbcad.simulate.scene.object import SceneObject
    from tbcad.simulate.scene.object_from_file import ObjectOptions, Paint, Unit
    from tbcad.types import Progress


def capture(
    exports: Path | str,
    object_file: Path | str | None = None,
    *,
    out: Path | str | None = None,
    geometry: Geometry = "spheres",
    fit: bool = False,
    paint: Paint = "own",
    up: Up | None = None,
    unit: Unit | None = None,
    samples: int = 1,
    lights: Path | str | None = None,
    every: int = 1,
    force: bool = False,
    progress: Progress = silent,
    detail: Progress = silent,
    answer: Progress = silent,
) -> LightField:
    """Simulate the photographs of both cameras through the mirrors of a build.

    Args:
        exports: folder that `build` wrote.
        object_file: triangle mesh about the origin; None for a built-in knot.
        up: axis of that file that points up, "y" or "z"; None: y for glTF, else z.
        unit: of that file, "mm", "cm", "m" or "in"; None: m for glTF, what a 3MF says, else mm.
        out: folder to write photographs and light field to, as `tbcad capture` does; None: none.
        geometry: mirrors of the record ("spheres"), of the exported meshes ("mesh"), or the
            prototype's balls, stop by stop ("prototype").
        fit: move and scale the object into the capture sphere.
        paint: colours of the file ("own"), a pattern, or plain grey.
        samples: a pixel is the mean of samples x samples rays.
        lights: also write a reflectance field to `out`: a table of lamps with the columns x_mm,
            y_mm, z_mm; "mirrors" for a lamp in the place of each virtual camera; or "projectors"
            for the light that each mirror throws of a projector in its camera's place.
        every: one lamp of so many, of "mirrors" or "projectors".
        force: replace an earlier capture, and keep files that tbcad did not write.
        progress: called with the name of each stage.
        detail: called with the state of a stage.
        answer: called with a line that says how the object's file was taken.

    Returns:
        The light field, in memory: for every pixel the ray it sees along and its colour.

    Raises:
        InputError: export, object or lamps cannot be read, or the folder cannot be replaced.
    """
    from tbcad.output.folder import check_replaceable
    from tbcad.output.inputs import files_named
    from tbcad.simulate.capture.light_field import LightField, light_field_in_memory
    from tbcad.simulate.scene.object_from_file import ObjectOptions

    if lights is not None and out is None:
        raise InputError("a reflectance field is written beside the light field: give out")
    if out is not None:
        check_replaceable(Path(out), "capture", force, (exports, object_file, *files_named(lights)))

    options = ObjectOptions(fit, paint, up, unit)
    photographs = photograph(
        exports, object_file, geometry, options, samples, progress, detail, answer
    )
    if out is not None:
        lamps = None if lights is None else WantedLamps(lights, every)
        write_photographs(photographs, Path(out), force, progress, detail, lamps)
        return LightField.read(Path(out))
    progress("photographs and light field")
    bands = ((reflector, bands()) for reflector, bands in photographs.cameras)
    return light_field_in_memory(bands, photographs.capture_mm, photographs.facts)


@dataclass(frozen=True)
class Photographs:
    """Both photographs before they are taken: light is traced when their bands are asked for.

    Attributes:
        cameras: each camera with what gives its bands of pixel rows.
        subject: the object before the cameras.
        capture_mm: diameter of the capture sphere.
        facts: how they are taken: design, n, geometry, samples.
        sources: files and folders that they are made from.
    """

    cameras: CameraPhotographs
    subject: SceneObject
    capture_mm: float
    facts: dict[str, Any]
    sources: tuple[Path | str | None, ...] = ()


def photograph(
    exports: Path | str,
    object_file: Path | str | None,
    geometry: Geometry,
    options: ObjectOptions,
    samples: int,
    progress: Progress,
    detail: Progress,
    answer: Progress = silent,
) -> Photographs:
    """Prepare both photographs; arguments as for `capture`."""
    from tbcad.simulate.camera_photographs import camera_photographs
    from tbcad.simulate.prototype.lamps import lit_by, read_lamps
    from tbcad.simulate.scene.exported import read_export
    from tbcad.simulate.scene.object_from_file import load_or_built_in
    from tbcad.simulate.scene.ray_casting import prepared_scene

    progress("object and scene")
    export = read_export(Path(exports))
    subject = load_or_built_in(object_file, export.capture_mm, options, answer)
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
    if subject.reading is not None:
        facts["object_file"] = asdict(subject.reading)
    return Photographs(cameras, subject, export.capture_mm, facts, (exports, object_file))


@dataclass(frozen=True)
class WantedLamps:
    """The lamps of a reflectance field.

    Attributes:
        lights: table of their places, "mirrors" for virtual cameras, or "projectors".
        every: one virtual camera of so many.
    """

    lights: Path | str
    every: int = 1


@dataclass(frozen=True)
class WantedFrames:
    """Photographs of the object while it turns about z.

    Attributes:
        count: of frames.
        turn_deg: of the object from the first frame to the one after the last.
    """

    count: int
    turn_deg: float


def write_photographs(
    photographs: Photographs,
    out: Path,
    force: bool,
    progress: Progress,
    detail: Progress = silent,
    lamps: WantedLamps | None = None,
    frames: WantedFrames | None = None,
) -> dict[str, Any]:
    """Take both photographs and replace a folder by their files; return the record of them."""
    from tbcad.output.folder import replacing
    from tbcad.output.inputs import files_named
    from tbcad.output.manifest import write_manifest
    from tbcad.simulate.capture.files import write_capture

    write_field = None if lamps is None else _field_writer(photographs, lamps)
    sources = (*photographs.sources, *files_named(lamps.lights if lamps else None))
    progress("photographs and light field")
    with replacing(out, "capture", force, sources) as folder:
        record = write_capture(
            folder,
            photographs.cameras,
            photographs.subject,
            photographs.capture_mm,
            photographs.facts,
        )
        if write_field is not None:
            progress("a photograph for each lamp")
            record["reflectance"] = write_field(folder, detail)
        if frames is not None:
            progress("a photograph for each frame")
            record["sequence"] = _write_frames(folder, photographs, frames, detail)
        write_manifest(folder, "capture")
    return record


def _write_frames(
    folder: Path, photographs: Photographs, wanted: WantedFrames, detail: Progress
) -> dict[str, Any]:
    from math import radians

    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.capture.sequence import turns, write_turning
    from tbcad.simulate.scene.ray_casting import prepared_scene

    angles = turns(wanted.count, radians(wanted.turn_deg))
    with LightField.open(folder) as source:
        return write_turning(folder, source, prepared_scene(photographs.subject), angles, detail)


def _field_writer(
    photographs: Photographs, wanted: WantedLamps
) -> Callable[[Path, Progress], dict[str, Any]]:
    """What writes the reflectance field; a table of lamps is read at once, before long work."""
    from tbcad.reflectance.lamp_places import (
        MIRRORS,
        PROJECTORS,
        lamps_of_mirrors,
        read_lamp_places,
    )
    from tbcad.reflectance.transport import write_reflectance
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.scene.ray_casting import prepared_scene

    table, thrown = None, str(wanted.lights) == PROJECTORS
    if thrown and photographs.facts["geometry"] == "prototype":
        raise InputError(
            "--lights projectors is light from the mirrors of shells: leave out --prototype, or "
            "give --lights mirrors"
        )
    if str(wanted.lights) not in (MIRRORS, PROJECTORS):
        table = read_lamp_places(Path(wanted.lights), photographs.capture_mm)

    def write(folder: Path, detail: Progress) -> dict[str, Any]:
        with LightField.open(folder) as source:
            lamps = table or lamps_of_mirrors(source, wanted.every)
            scene = prepared_scene(photographs.subject)
            return write_reflectance(folder, source, scene, lamps, detail, thrown)

    return write


def relight(
    capture_folder: Path | str,
    light: Path | str,
    *,
    turn_deg: float = 0.0,
    light_format: LightFormat | None = None,
) -> LightField:
    """A light field in the light of its surroundings, as `tbcad view --light` shows it.

    Args:
        capture_folder: that `capture` wrote with lights.
        light: picture of the surroundings by direction, +x in the middle: Radiance (.hdr), OpenEXR
            (.exr) or TIFF in floating point.
        turn_deg: turns it about z.
        light_format: of that picture, "latlong", "angular", "mirror-ball" or "cross"; None:
            latlong, if it is twice as wide as high.

    Returns:
        The light field in memory, with other colours.

    Raises:
        InputError: the folder has no reflectance field, or the picture cannot be read.
    """
    from math import radians

    from tbcad.reflectance.environment import read_environment
    from tbcad.reflectance.field_file import open_reflectance, relit
    from tbcad.simulate.capture.light_field import LightField

    folder, environment = (
        Path(capture_folder),
        read_environment(Path(light), radians(turn_deg), light_format),
    )
    with open_reflectance(folder) as reflectance:
        return relit(LightField.read(folder), reflectance, environment).field
