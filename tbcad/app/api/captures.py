"""Simulated photographs of both cameras, and captures as data of other programs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.options.call import keywords
from tbcad.options.captures import CaptureOptions, DatasetOptions
from tbcad.options.checks import check_is_capture, check_is_export, check_is_object
from tbcad.options.python_help import in_lines
from tbcad.options.shared import AnyPath

if TYPE_CHECKING:
    from tbcad.light.reflectance.environment import LightFormat
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.capture.photograph import CameraPhotographs, Samples
    from tbcad.light.simulate.capture.real import RealOptics
    from tbcad.light.simulate.scene.ray_casting import Scene
    from tbcad.light.simulate.scene.reflector import ExportedDesign


@keywords(CaptureOptions)
def capture(options: CaptureOptions) -> LightField:
    """Simulate the photographs of both cameras through the mirrors of a build.

    Returns:
        The light field, in memory: for every pixel the ray it sees along and its colour.

    Raises:
        InputError: build, object or lamps cannot be read, or the folder cannot be replaced.
    """
    photographs = photograph(options)
    from tbcad.light.simulate.capture.light_field import LightField, light_field_in_memory

    if options.out is not None:
        write_photographs(photographs, options)
        return LightField.read(Path(options.out))
    options.progress("photographs and light field")
    bands = ((reflector, bands()) for reflector, bands in photographs.cameras)
    return light_field_in_memory(bands, photographs.capture_mm, photographs.facts)


@dataclass(frozen=True)
class Photographs:
    """Both photographs before they are taken: light is traced when their bands are asked for."""

    cameras: CameraPhotographs  # each camera with what gives its bands of pixel rows
    scene: Scene  # the object before the cameras
    capture_mm: float  # diameter of the capture sphere
    facts: dict[str, Any]  # how they are taken: design, n, geometry, samples
    sources: tuple[AnyPath | None, ...] = ()  # files and folders that they are made from


def photograph(options: CaptureOptions) -> Photographs:
    """Prepare both photographs, when all that can be refused at once has been."""
    options.check()
    exports, file = Path(options.exports), options.object_file
    check_is_export(exports)
    check_is_object(options.object_file, options.up, options.unit)
    from tbcad.light.simulate.camera_photographs import camera_photographs
    from tbcad.light.simulate.real_camera import real_optics
    from tbcad.light.simulate.scene.lamps import lit_by, read_lamps
    from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object
    from tbcad.light.simulate.scene.ray_casting import prepared_scene
    from tbcad.light.simulate.scene.real_scene import real_scene
    from tbcad.light.simulate.scene.reflector import read_export
    from tbcad.light.simulate.scene.shell_lamps import lit_by_mirrors, read_shell_lamps
    from tbcad.output.folder import check_replaceable
    from tbcad.output.single_files import files_named

    sources = (exports, file, *files_named(options.lights))
    if options.out is not None:
        check_replaceable(Path(options.out), "capture", options.force, sources)
    options.progress("object and scene")
    export = read_export(exports)
    how = ObjectOptions(options.fit, options.paint, options.up, options.unit)
    subject = load_object(file, export.capture_mm, how, options.answer)
    lamps = read_lamps(export.folder) if options.geometry == "prototype" else None
    lit = "lamps of the prototype" if lamps else "lamps of the shell" if options.own_light else ""
    facts: dict[str, Any] = {
        "object": subject.name,
        "design": export.spec.name,
        "n": export.spec.optics.n,
        "geometry": options.geometry,
        "samples": options.samples,
    } | ({"light": lit} if lit else {})
    taken_by: Samples | RealOptics = options.samples
    if options.optics == "real":
        taken_by, record = real_optics(export, _roughness_nm(export, options))
        shell_lamps = read_shell_lamps(export.folder) if options.own_light else None
        scene = real_scene(export, subject, lamps or shell_lamps, options.gloss)
        facts |= {"optics": "real", "real": record.model_dump() | {"gloss": options.gloss}}
    else:
        subject = lit_by(lamps, subject) if lamps else subject
        if options.own_light:
            subject = lit_by_mirrors(export, read_shell_lamps(export.folder), subject)
        scene = prepared_scene(subject)
    cameras = camera_photographs(export, scene, options.geometry, taken_by, options.detail)
    if subject.reading is not None:
        facts["object_file"] = asdict(subject.reading)
    return Photographs(cameras, scene, export.capture_mm, facts, sources)


def _roughness_nm(export: ExportedDesign, options: CaptureOptions) -> list[float] | None:
    """Of each ball of a prototype; None of a shell's mirrors."""
    if options.geometry != "prototype":
        return None
    from tbcad.prototype.balls.catalogue import recorded_roughness_nm

    return recorded_roughness_nm(export.folder)


def write_photographs(photographs: Photographs, options: CaptureOptions) -> dict[str, Any]:
    """Take both photographs and replace a folder by their files; return the record of them."""
    from math import radians

    from tbcad.light.reflectance.lamp_places import (
        MIRRORS,
        PROJECTORS,
        lamps_of_mirrors,
        read_lamp_places,
    )
    from tbcad.light.simulate.capture.files import write_capture
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.capture.sequence import turns, write_turning
    from tbcad.output.folder import replacing
    from tbcad.output.manifest import write_manifest

    lights, scene, table = options.lights, photographs.scene, None
    if lights is not None and str(lights) not in (MIRRORS, PROJECTORS):
        table = read_lamp_places(Path(lights), photographs.capture_mm)  # before long work
    options.progress("photographs and light field")
    out = Path(options.out or "")
    with replacing(out, "capture", options.force, photographs.sources) as folder:
        taken = photographs.cameras, scene.subject, photographs.capture_mm, photographs.facts
        record = write_capture(folder, *taken)
        if lights is not None:
            from tbcad.light.reflectance.transport import write_reflectance

            options.progress("a photograph for each lamp")
            thrown = str(lights) == PROJECTORS
            with LightField.open(folder) as source:
                lamps = table or lamps_of_mirrors(source, options.every)
                record["reflectance"] = write_reflectance(
                    folder, source, scene, lamps, options.detail, thrown
                )
        if options.frames is not None:
            options.progress("a photograph for each frame")
            angles = turns(options.frames, radians(options.turn))
            with LightField.open(folder) as source:
                record["sequence"] = write_turning(folder, source, scene, angles, options.detail)
        write_manifest(folder, "capture")
    return record


@in_lines
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

    from tbcad.light.reflectance.environment import read_environment
    from tbcad.light.reflectance.transport import open_reflectance, relit
    from tbcad.light.simulate.capture.light_field import LightField

    folder = Path(capture_folder)
    environment = read_environment(Path(light), radians(turn_deg), light_format)
    with open_reflectance(folder) as reflectance:
        return relit(LightField.read(folder), reflectance, environment).field


@keywords(DatasetOptions)
def dataset(options: DatasetOptions) -> dict[str, Any]:
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
    from tbcad.light.datasets.write import write_dataset, write_scene
    from tbcad.light.simulate.capture.files import captured_scene
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.output.folder import check_replaceable, replacing
    from tbcad.output.manifest import write_manifest

    inputs = (place if place.is_dir() else place.parent, exports)
    check_replaceable(out, "dataset", options.force, inputs)
    with (
        LightField.open(place) as source,
        replacing(out, "dataset", options.force, inputs) as folder,
    ):
        scene = captured_scene(place)
        if exports is not None:
            record = write_scene(folder, source, scene, Path(exports), options.progress)
        else:
            record = write_dataset(folder, source, scene, options)
        write_manifest(folder, "dataset")
    return record
