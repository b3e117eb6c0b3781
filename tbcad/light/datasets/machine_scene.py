"""Scenes of the machine for Mitsuba 3 and Blender: meshes, and a camera each.

The object sends out the light that a capture shows it in, whatever shines on it: a picture then
differs from the capture's by geometry alone. After Mitsuba's documentation of scene files
(mitsuba.readthedocs.io): cameras look along their forward axis with `up` given, mirrors are smooth
conductors without loss, `mesh_attribute` takes colours from the corners.
"""

import json
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tbcad.cad.formats.mesh_files import mesh_ply
from tbcad.core.geometry.vectors import dot, unit
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.geodesic import triangle_grid
from tbcad.light.datasets.pinholes import camera_to_world
from tbcad.light.simulate.object_files.normals import is_closed
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import Scene, SurfaceHits
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.light.simulate.scene.shell_meshes import facet_owners, read_facets
from tbcad.types import Floats, Ints, Progress

MESHES = "meshes"
SAMPLES = 16
BLENDER = "blender.py"
# Colours that are no function of the facets' corners, patterns and textures, are sampled so finely.
FINEST_MM, MOST_PARTS = 1.0, 64
BEHIND_MM = 1e-3


def write_machine_scene(
    folder: Path, export: ExportedDesign, scene: Scene, progress: Progress
) -> dict[str, Any]:
    """Write meshes and scenes into a folder that exists, and return what is in it.

    InputError: the build has no shells.
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
        text = mitsuba_scene(camera, cameras)
        (folder / f"camera_{name}.xml").write_text(text, encoding="utf-8")
    (folder / BLENDER).write_text(blender_script(cameras, list(facets)), encoding="utf-8")
    return {"facets": facets}


def mitsuba_scene(camera: Camera, cameras: Iterable[str]) -> str:
    """The scene file (XML) of a camera, with the shells of all.

    What a capture sees: from the camera, by one mirror at most. The object is no lamp: Mitsuba 3.9
    crashes when it chooses points on one whose colours are those of its corners.
    """
    target, up = camera.pinhole + 100 * camera.forward, -camera.axes[1]
    places = {"ORIGIN": camera.pinhole, "TARGET": target, "UP": up}
    return _filled(
        "mitsuba_scene.xml.txt",
        FOV=repr(float(np.degrees(camera.hfov))),
        **{name: ", ".join(repr(float(x)) for x in at) for name, at in places.items()},
        WIDTH=str(camera.width_px),
        HEIGHT=str(camera.height_px),
        SAMPLES=str(SAMPLES),
        SHELLS="".join(_filled("mitsuba_shell.xml.txt", CAMERA=name) for name in cameras),
    )


def _filled(template: str, **fields: str) -> str:
    """A file of this package with text in its places."""
    text = (files("tbcad.light.datasets") / template).read_text(encoding="utf-8")
    for name, value in fields.items():
        text = text.replace(f"{{{{{name}}}}}", value)
    return text


def blender_script(cameras: dict[str, Camera], parts: list[str]) -> str:
    """A program for Blender's own Python that builds the same scene."""
    data = {
        "parts": parts,
        "samples": SAMPLES,
        "cameras": {name: _blender_camera(camera) for name, camera in cameras.items()},
    }
    return _filled("blender_scene.py.txt", DATA=json.dumps(data))


def _blender_camera(camera: Camera) -> dict[str, Any]:
    """Matrix of a camera that looks along -z with +y up, angle of view, and size."""
    return {
        "matrix": camera_to_world(camera.pinhole, camera.axes),
        "angle": float(camera.hfov),
        "size": [camera.width_px, camera.height_px],
    }


class SceneMesh(NamedTuple):
    """Triangles: points (v, 3), mm, unit normals there (v, 3), faces (f, 3), colours (v, 3)."""

    points: Floats
    normals: Floats
    faces: Ints
    colours: Floats | None = None

    def ply(self) -> bytes:
        """The mesh as a file."""
        return mesh_ply(*self)


def shell_meshes(export: ExportedDesign, reflector: Reflector) -> tuple[SceneMesh, SceneMesh]:
    """Mirrors of a camera's shell, with the normals of their spheres; and its walls.

    A facet reflects like a flat mirror, but renderers reflect at normals that they interpolate
    between its corners, and there these are exact.

    InputError: the shell's STL file is not there, or cannot be read.
    """
    corners = read_facets(export.folder / f"shell_{reflector.camera_id}.stl")
    bare = reflector.mirrors.offset(-export.spec.mirrors.coating_um / 1000)
    owner = facet_owners(bare, corners)
    mirrors, walls = corners[owner >= 0], corners[owner < 0]
    number = np.repeat(owner[owner >= 0], 3)
    normals = unit(bare.gradient(number, mirrors.reshape(-1, 3)))
    across = np.repeat(_facet_normals(mirrors), 3, axis=0)
    outward = np.where(dot(normals, across)[:, None] < 0, -normals, normals)
    flat = np.repeat(_facet_normals(walls), 3, axis=0)
    return _separate(mirrors, outward), _separate(walls, flat)


def _facet_normals(corners: Floats) -> Floats:
    return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _separate(corners: Floats, normals: Floats) -> SceneMesh:
    """Facets (f, 3, 3), each with corners of its own, whose normals are (3 f, 3)."""
    return SceneMesh(corners.reshape(-1, 3), normals, np.arange(3 * len(corners)).reshape(-1, 3))


def object_mesh(scene: Scene) -> SceneMesh:
    """The object with the colours that a capture shows, light included: what it sends out.

    Renderers see light on the outside of facets; one that does not enclose a body has a back too.
    """
    subject, divided = scene.subject, _divided(scene.subject)
    outside = _side(scene, *divided, 1.0)
    if is_closed(subject.points, subject.faces):
        return outside
    back = _side(scene, *divided, -1.0)
    return SceneMesh(
        np.concatenate([outside.points, back.points]),
        np.concatenate([outside.normals, back.normals]),
        np.concatenate([outside.faces, back.faces[:, ::-1] + len(outside.points)]),
        np.concatenate([outside.colours, back.colours]),
    )


def _side(scene: Scene, facet: Ints, weight: Floats, faces: Ints, side: float) -> SceneMesh:
    """The outside (1), or the back (-1), which is a little behind it."""
    subject = scene.subject
    toward = -side * _facet_normals(subject.points[subject.faces])[facet]
    hits = SurfaceHits(np.arange(len(facet)), np.zeros(len(facet)), facet, weight, toward)
    spots, light = hits.spots(subject), hits.light(subject, scene.shade)
    place = spots.place if side > 0 else spots.place + BEHIND_MM * spots.facet_normal
    return SceneMesh(place, spots.normal, faces, hits.albedo(subject) * light[:, None])


def _divided(subject: SceneObject) -> tuple[Ints, Floats, Ints]:
    """Points on facets: facet (v,), barycentric weights (v, 3), and the triangles of them."""
    count, parts = len(subject.faces), _parts(subject)
    grid, small = triangle_grid(parts)
    i, j = np.array(grid).T
    weight = np.column_stack([parts - i - j, i, j]) / parts
    number = np.zeros((parts + 1, parts + 1), dtype=np.int64)
    number[i, j] = np.arange(len(grid))
    local = number[small[..., 0], small[..., 1]]
    faces = (local[None] + len(weight) * np.arange(count)[:, None, None]).reshape(-1, 3)
    return np.repeat(np.arange(count), len(weight)), np.tile(weight, (count, 1)), faces


def _parts(subject: SceneObject) -> int:
    """Into how many parts the sides of all facets are divided."""
    if not subject.patterned and subject.texture is None:
        return 1
    corners = subject.points[subject.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    return int(np.clip(np.ceil(longest / FINEST_MM), 1, MOST_PARTS))
