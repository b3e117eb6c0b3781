"""Scenes of the machine for Mitsuba 3 and Blender: meshes, and a camera each.

The object sends out the light that a capture shows it in, whatever shines on it: a picture then
differs from the capture's by geometry alone. After Mitsuba's documentation of scene files
(mitsuba.readthedocs.io): cameras look along their forward axis with `up` given, mirrors are smooth
conductors without loss, `mesh_attribute` takes colours from the corners.
"""

import json
from importlib.resources import files
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np

from tbcad.datasets.machine_meshes import object_mesh, shell_meshes
from tbcad.optics.camera import Camera
from tbcad.simulate.scene.exported import ExportedDesign
from tbcad.simulate.scene.ray_casting import Scene
from tbcad.types import Floats, Progress

MESHES = "meshes"
SAMPLES = 16
BLENDER = "blender.py"


def write_machine_scene(
    folder: Path, export: ExportedDesign, scene: Scene, progress: Progress
) -> dict[str, Any]:
    """Write meshes and scenes into a folder that exists, and return what is in it.

    Raises:
        InputError: the export has no shells.
    """
    (folder / MESHES).mkdir()
    facets, cameras = {}, {}
    for reflector in export.reflectors:
        name = reflector.camera_id
        progress(f"shell {name}")
        mirrors, walls = shell_meshes(export, reflector)
        for part, mesh in ((f"mirrors_{name}", mirrors), (f"walls_{name}", walls)):
            (folder / MESHES / f"{part}.ply").write_bytes(mesh.ply())
            facets[part] = len(mesh.faces)
        cameras[name] = reflector.camera
    progress("object")
    mesh = object_mesh(scene)
    (folder / MESHES / "object.ply").write_bytes(mesh.ply())
    facets["object"] = len(mesh.faces)
    for name, camera in cameras.items():
        (folder / f"camera_{name}.xml").write_bytes(mitsuba_scene(camera, list(facets)))
    (folder / BLENDER).write_text(blender_script(cameras, list(facets)), encoding="utf-8")
    return {"facets": facets}


def mitsuba_scene(camera: Camera, parts: list[str]) -> bytes:
    """The scene file of a camera (XML)."""
    scene = Xml.Element("scene", version="3.0.0")
    # What a capture sees: from the camera, by one mirror at most. The object is no lamp: Mitsuba
    # 3.9 crashes when it chooses points on one whose colours are those of its corners.
    integrator = _child(scene, "integrator", type="direct")
    _child(integrator, "integer", name="emitter_samples", value="0")
    _child(integrator, "integer", name="bsdf_samples", value="1")
    _add_sensor(scene, camera)
    for part in parts:
        shape = _child(scene, "shape", type="ply", id=part)
        _child(shape, "string", name="filename", value=f"{MESHES}/{part}.ply")
        _add_material(shape, part)
    Xml.indent(scene)
    return bytes(Xml.tostring(scene, encoding="utf-8", xml_declaration=True)) + b"\n"


def _add_sensor(scene: Xml.Element, camera: Camera) -> None:
    sensor = _child(scene, "sensor", type="perspective")
    _child(sensor, "string", name="fov_axis", value="x")
    _child(sensor, "float", name="fov", value=repr(float(np.degrees(camera.hfov))))
    _child(sensor, "float", name="near_clip", value="1")
    _child(sensor, "float", name="far_clip", value="10000")
    view = _child(_child(sensor, "transform", name="to_world"), "lookat")
    view.set("origin", _text(camera.pinhole))
    view.set("target", _text(camera.pinhole + 100 * camera.forward))
    view.set("up", _text(-camera.axes[1]))
    film = _child(sensor, "film", type="hdrfilm")
    _child(film, "integer", name="width", value=str(camera.width_px))
    _child(film, "integer", name="height", value=str(camera.height_px))
    _child(film, "rfilter", type="box")
    sampler = _child(sensor, "sampler", type="stratified")
    _child(sampler, "integer", name="sample_count", value=str(SAMPLES))


def _add_material(shape: Xml.Element, part: str) -> None:
    """Mirrors reflect all light, walls none; the object sends out its colours."""
    if part.startswith("mirrors"):
        sides = _child(shape, "bsdf", type="twosided")
        _child(_child(sides, "bsdf", type="conductor"), "string", name="material", value="none")
        return
    black = _child(shape, "bsdf", type="diffuse")
    _child(black, "rgb", name="reflectance", value="0")
    if part == "object":
        emitter = _child(shape, "emitter", type="area")
        colour = _child(emitter, "texture", type="mesh_attribute", name="radiance")
        _child(colour, "string", name="name", value="vertex_color")


def _child(parent: Xml.Element, tag: str, **attributes: str) -> Xml.Element:
    return Xml.SubElement(parent, tag, attributes)


def _text(values: Floats) -> str:
    return ", ".join(repr(float(value)) for value in values)


def blender_script(cameras: dict[str, Camera], parts: list[str]) -> str:
    """A program for Blender's own Python that builds the same scene."""
    data = {
        "parts": parts,
        "samples": SAMPLES,
        "cameras": {name: _blender_camera(camera) for name, camera in cameras.items()},
    }
    script = files("tbcad.datasets") / "blender_scene.py.txt"
    return script.read_text(encoding="utf-8").replace("{{DATA}}", json.dumps(data))


def _blender_camera(camera: Camera) -> dict[str, Any]:
    """Matrix of a camera that looks along -z with +y up, angle of view, and size."""
    right, down, forward = camera.axes
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, -down, -forward, camera.pinhole])
    return {
        "matrix": matrix.tolist(),
        "angle": float(camera.hfov),
        "size": [camera.width_px, camera.height_px],
    }
