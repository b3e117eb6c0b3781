"""The whole rig in one file to look at: is everything where its own file and the record have it?

Purchased parts have no file of their own; their shapes are taken from here, and must not be in the
base's way.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.record.files import read
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, short_list
from tbcad_verify.types import Floats

Shapes = dict[str, tuple[Floats, NDArray[np.int64]]]

CHECK = ("assembly", "mm")
OFF_MM = 0.25  # it is meshed coarsely
METRE_MM = 1000.0
# glTF's y is up: rows that its x, y and z are in the frame of the shell.
UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def assembly_meshes(context: PrototypeContext) -> Shapes:
    """Corners (V, 3) in mm and facets (F, 3) of all bodies by name, in the frame of the shell.

    Raises:
        Unknown: there is no GLB, or it cannot be read.
    """
    name = context.prototype.assembly.glb
    if not name:
        raise Unknown("there is no GLB of the assembly")
    data = read(context.export.folder, name).data.tobytes()
    return {title: _merged(*mesh) for title, mesh in _bodies(data)}


def check(
    name: CheckName, context: PrototypeContext, bodies: list[MeasuredPart], found: Shapes
) -> Check:
    """Every part's and every ball's box, against its own mesh's or the record's."""
    placed = of_roles(bodies, "base", "cap", "stage", "frame")
    boxes = {one.part.name: _box(one.placed_mesh.points) for one in placed}
    balls = context.prototype.balls
    for k in np.flatnonzero(~balls.cap).tolist():
        middle, radius = balls.columns("bx", 3)[:, k], balls.body_radius_mm[k]
        boxes[f"ball_{k + 1}"] = np.stack([middle - radius, middle + radius])
    off = {title: _off(box, found.get(title)) for title, box in boxes.items()}
    off |= {one.name: 0.0 if one.name in found else np.inf for one in context.prototype.bought}
    wrong = sorted(title for title, away in off.items() if away > OFF_MM)
    return at_most(name, max(off.values()), OFF_MM, f"missing or elsewhere: {short_list(wrong)}")


def standing_solids(context: PrototypeContext, found: Shapes) -> list[tuple[str, Any]]:
    """Purchased parts that stand still, as manifold3d has them.

    Raises:
        Unknown: one is missing, or no closed solid.
    """
    names = [one.name for one in context.prototype.bought if not one.turns]
    if lost := [name for name in names if name not in found]:
        raise Unknown(f"the assembly lacks {short_list(lost)}")
    return [(name, _solid(name, *found[name])) for name in names]


def _bodies(data: bytes) -> Iterable[tuple[str, tuple[Floats, NDArray[np.int64]]]]:
    import trimesh

    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type="glb")
        for node in sorted(scene.graph.nodes_geometry):
            place, geometry = scene.graph[node]
            mesh = scene.geometry[geometry]
            points = trimesh.transform_points(mesh.vertices, place)
            yield str(node), (METRE_MM * points @ UP, np.asarray(mesh.faces, dtype=np.int64))
    except Exception as error:
        raise Unknown(f"the GLB cannot be read ({type(error).__name__}: {error})") from error


def _merged(points: Floats, faces: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64]]:
    """Corners that are the same made one: shading wants them apart."""
    corners, of = np.unique(points, axis=0, return_inverse=True)
    return corners, of.reshape(-1)[faces]


def _solid(name: str, points: Floats, faces: NDArray[np.int64]) -> Any:
    import manifold3d

    mesh = manifold3d.Mesh64(np.ascontiguousarray(points), faces.astype(np.uint64))
    solid = manifold3d.Manifold(mesh)
    if solid.status() != manifold3d.Error.NoError:
        raise Unknown(f"{name} of the assembly is no closed solid ({solid.status().name})")
    return solid


def _box(points: Floats) -> Floats:
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _off(box: Floats, shape: tuple[Floats, NDArray[np.int64]] | None) -> float:
    return float(np.abs(_box(shape[0]) - box).max()) if shape is not None else float("inf")
