"""The assembly file: every part must be drawn where its own file and the record have it.

Purchased parts have no file of their own. Their shapes are taken from the assembly, and must not
obstruct the base.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, manifold, of_roles
from tbcad_verify.record.files import read
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, short_list
from tbcad_verify.types import Floats, Ints

Shape = tuple[Floats, Ints]  # corners (V, 3) in mm, facets (F, 3)

CHECKS = {"assembly": "mm"}
SUNK = ("INSERT-", "DOWEL-", "MAGNET-", "LED-")  # fasteners that stand out of nothing
OFF_MM = 0.25  # the assembly is meshed coarsely
METRE_MM = 1000.0
# glTF's y is up: rows that its x, y and z are in the frame of the shell.
UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


def assembly_meshes(context: PrototypeContext) -> dict[str, Shape]:
    """Shapes of all bodies by name, in the frame of the shell.

    Raises:
        Unknown: there is no GLB, or it cannot be read.
    """
    name = context.prototype.assembly.glb
    if not name:
        raise Unknown("there is no GLB of the assembly")
    data = read(context.export.folder, name).data.tobytes()
    return {title: _welded(*shape) for title, shape in _shapes(data)}


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    parts: list[MeasuredPart],
    drawn: dict[str, Shape],
) -> list[Check]:
    """The box of every part and ball, against its own mesh's or the record's."""
    placed = of_roles(parts, "base", "cap", "stage", "frame")
    boxes = {part.part.name: _box(part.placed_mesh.points) for part in placed}
    balls = context.prototype.balls
    for k in np.flatnonzero(~balls.cap).tolist():
        middle, radius = balls.columns("bx", 3)[:, k], balls.body_radius_mm[k]
        boxes[f"ball_{k + 1}"] = np.stack([middle - radius, middle + radius])
    error = {title: _box_error(box, drawn.get(title)) for title, box in boxes.items()}
    error |= {one.name: 0.0 if one.name in drawn else np.inf for one in context.prototype.bought}
    wrong = sorted(title for title, value in error.items() if value > OFF_MM)
    detail = f"missing or elsewhere: {short_list(wrong)}"
    return [at_most(names[0], max(error.values()), OFF_MM, detail)]


def fixed_solids(context: PrototypeContext, drawn: dict[str, Shape]) -> list[tuple[str, Any]]:
    """Names and manifold3d solids of panels and what is bought that do not rotate with the base.

    Raises:
        Unknown: one is missing, or no closed solid.
    """
    shroud = context.prototype.shroud
    names = [one.name for one in context.prototype.bought if not one.turns]
    names += [panel.name for panel in shroud.panels] if shroud else []
    solids = [(name, _solid(name, drawn)) for name in names]
    return [*solids, *fastener_solids(context, drawn, turns=False)]


def fastener_solids(
    context: PrototypeContext, drawn: dict[str, Shape], *, turns: bool
) -> list[tuple[str, Any]]:
    """All screws and nuts that rotate with the base, or all others, as one solid with a name.

    Inserts, dowels, magnets and LEDs are inside of what holds them.

    Raises:
        Unknown: one is missing, or no closed solid.
    """
    import manifold3d

    some = [
        one.name
        for one in context.prototype.fasteners
        if one.turns == turns and not one.part.startswith(SUNK)
    ]
    title = "fasteners of the base" if turns else "fasteners of stage and frame"
    solids = [_solid(name, drawn) for name in some]
    return [(title, manifold3d.Manifold.compose(solids))] if solids else []


def _solid(name: str, drawn: dict[str, Shape]) -> Any:
    if name not in drawn:
        raise Unknown(f"the assembly lacks {name}")
    solid = manifold(*drawn[name])
    if solid.status().name != "NoError":
        raise Unknown(f"{name} of the assembly is no closed solid ({solid.status().name})")
    return solid


def _shapes(data: bytes) -> Iterable[tuple[str, Shape]]:
    import trimesh

    try:
        scene = trimesh.load_scene(io.BytesIO(data), file_type="glb")
        for node in sorted(scene.graph.nodes_geometry):
            transform, geometry = scene.graph[node]
            mesh = scene.geometry[geometry]
            points = trimesh.transform_points(mesh.vertices, transform)
            yield str(node), (METRE_MM * points @ UP, np.asarray(mesh.faces, dtype=np.int64))
    except Exception as error:
        raise Unknown(f"the GLB cannot be read ({type(error).__name__}: {error})") from error


def _welded(points: Floats, faces: NDArray[np.int64]) -> Shape:
    """Equal corners as one: shading needs them apart."""
    # Sorted column by column, which takes a fifth of the time of np.unique's rows.
    order = np.lexsort(points.T[::-1])
    ordered = points[order]
    first = np.append(True, (ordered[1:] != ordered[:-1]).any(axis=1))
    number = np.empty(order.size, dtype=np.int64)
    number[order] = np.cumsum(first) - 1
    return ordered[first], number[faces]


def _box(points: Floats) -> Floats:
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _box_error(box: Floats, shape: Shape | None) -> float:
    return float(np.abs(_box(shape[0]) - box).max()) if shape is not None else float("inf")
