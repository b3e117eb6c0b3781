"""The machine as meshes for renderers: mirrors with exact normals, walls, and the object."""

from typing import NamedTuple

import numpy as np

from tbcad.formats.ply import mesh_ply
from tbcad.geometry.vectors import unit
from tbcad.simulate.object_files.normals import is_closed
from tbcad.simulate.scene.exported import ExportedDesign
from tbcad.simulate.scene.object import SceneObject
from tbcad.simulate.scene.ray_casting import Scene, SurfaceHits
from tbcad.simulate.scene.reflector import Reflector
from tbcad.simulate.scene.shell_meshes import facet_owners, read_facets
from tbcad.types import Floats, Ints

# Colours that are no function of the facets' corners, patterns and textures, are sampled so finely.
FINEST_MM, MOST_PARTS = 1.0, 64
BEHIND_MM = 1e-3


class Mesh(NamedTuple):
    """Triangles: points (v, 3), mm, unit normals there (v, 3), faces (f, 3), colours (v, 3)."""

    points: Floats
    normals: Floats
    faces: Ints
    colours: Floats | None = None

    def ply(self) -> bytes:
        """The mesh as a file."""
        return mesh_ply(*self)


def shell_meshes(export: ExportedDesign, reflector: Reflector) -> tuple[Mesh, Mesh]:
    """Mirrors of a camera's shell, with the normals of their spheres; and its walls.

    A facet reflects like a flat mirror, but renderers reflect at normals that they interpolate
    between its corners, and there these are exact.

    Raises:
        InputError: the shell's STL file is not there, or cannot be read.
    """
    corners = read_facets(export.folder / f"shell_{reflector.camera_id}.stl")
    bare = reflector.mirrors.offset(-export.spec.mirrors.coating_um / 1000)
    owner = facet_owners(bare, corners)
    mirrors, walls = corners[owner >= 0], corners[owner < 0]
    number = np.repeat(owner[owner >= 0], 3)
    normals = unit(bare.gradient(number, mirrors.reshape(-1, 3)))
    return _outward(mirrors, normals), _flat(walls)


def _outward(corners: Floats, normals: Floats) -> Mesh:
    """Facets (f, 3, 3) and normals at their corners (3 f, 3), turned as the facets are."""
    across = np.repeat(_facet_normals(corners), 3, axis=0)
    turned = np.where((normals * across).sum(axis=1, keepdims=True) < 0, -normals, normals)
    return Mesh(corners.reshape(-1, 3), turned, _separate(len(corners)))


def _flat(corners: Floats) -> Mesh:
    normals = np.repeat(_facet_normals(corners), 3, axis=0)
    return Mesh(corners.reshape(-1, 3), normals, _separate(len(corners)))


def _facet_normals(corners: Floats) -> Floats:
    return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _separate(count: int) -> Ints:
    return np.arange(3 * count).reshape(-1, 3)


def object_mesh(scene: Scene) -> Mesh:
    """The object with the colours that a capture shows, light included: what it sends out.

    Renderers see light on the outside of facets; one that does not enclose a body has a back too.
    """
    subject, divided = scene.subject, _divided(scene.subject)
    outside = _side(scene, *divided, 1.0)
    if is_closed(subject.points, subject.faces):
        return outside
    back = _side(scene, *divided, -1.0)
    return Mesh(
        np.concatenate([outside.points, back.points]),
        np.concatenate([outside.normals, back.normals]),
        np.concatenate([outside.faces, back.faces[:, ::-1] + len(outside.points)]),
        np.concatenate([outside.colours, back.colours]),
    )


def _side(scene: Scene, facet: Ints, weight: Floats, faces: Ints, side: float) -> Mesh:
    """The outside (1), or the back (-1), which is a little behind it."""
    subject = scene.subject
    toward = -side * _facet_normals(subject.points[subject.faces])[facet]
    hits = SurfaceHits(np.arange(len(facet)), np.zeros(len(facet)), facet, weight, toward)
    spots, light = hits.spots(subject), hits.light(subject, scene.shade)
    place = spots.place if side > 0 else spots.place + BEHIND_MM * spots.facet_normal
    return Mesh(place, spots.normal, faces, hits.albedo(subject) * light[:, None])


def _divided(subject: SceneObject) -> tuple[Ints, Floats, Ints]:
    """Points on facets: facet (v,), barycentric weights (v, 3), and the triangles of them."""
    count, parts = len(subject.faces), _parts(subject)
    i, j = np.array([(i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]).T
    weight = np.column_stack([parts - i - j, i, j]) / parts
    number = {place: k for k, place in enumerate(zip(i.tolist(), j.tolist(), strict=True))}
    upward = [
        (number[a, b], number[a + 1, b], number[a, b + 1])
        for a in range(parts)
        for b in range(parts - a)
    ]
    downward = [
        (number[a + 1, b], number[a + 1, b + 1], number[a, b + 1])
        for a in range(parts)
        for b in range(parts - a - 1)
    ]
    local = np.array(upward + downward)
    faces = (local[None] + len(weight) * np.arange(count)[:, None, None]).reshape(-1, 3)
    return np.repeat(np.arange(count), len(weight)), np.tile(weight, (count, 1)), faces


def _parts(subject: SceneObject) -> int:
    """Into how many parts the sides of all facets are divided."""
    if not subject.patterned and subject.texture is None:
        return 1
    corners = subject.points[subject.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    return int(np.clip(np.ceil(longest / FINEST_MM), 1, MOST_PARTS))
