"""The assembly: the whole machine from several sides, call-outs by number of the parts list.

Hidden edges are removed by rays on meshes, in seconds; exact removal takes minutes.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from tbcad.cad.drafting.sheet import (
    A3,
    BESIDE_MM,
    Box,
    Sheet,
    TitleBlock,
    choose_scale,
    drawing_room,
    placed,
    table,
)
from tbcad.cad.formats.entities import Circle, Entity, Layer, Line, Point, Text
from tbcad.cad.formats.glb import read_glb
from tbcad.drawings.export import DrawnExport
from tbcad.report.exploded import EDGE, RADIUS, Callout, place_callouts
from tbcad.types import Bools, Floats, Ints

SHARP_RAD = 0.6  # angle between faces that is drawn
OFF_MM = 0.05  # of a ray's start from its edge
DIGITS = 3
NAME = "assembly"
# Toward the eye: from the camera's side, from behind the uprights, from below to the balls.
EYES = ((1.0, -1.0, 0.6), (-1.0, -1.0, 0.6), (0.6, -1.0, -0.35))
NOTES = (
    "Numbers are those of the parts list, bom.csv.",
    "What is hidden here is on another sheet; what is nowhere is inside others or has no body.",
)
VIEWS = (
    "from the camera's side, without shroud",
    "from behind, without shroud",
    "from below, without shroud",
)
LEFT_OUT = ("shroud_", "capture_sphere", "camera_view")  # would hide the rest, or are no parts
BALLOON_MM, TEXT_MM, DOT_MM = 2.8, 2.5, 0.5
PIXELS = RADIUS / BALLOON_MM  # of the call-outs' own unit, 1/mm
SCALES = (0.5, 0.4, 0.2, 0.1)
PIECE_MM = 2.0  # edges are tested in pieces as long
HEAD, WIDTHS_MM = ("no.", "qty", "part"), (9.0, 9.0, 42.0)
Called: TypeAlias = Mapping[str, tuple[int, int, Point]]
"""Number and quantity of parts, and a point of each in a picture, mm."""


@dataclass(frozen=True)
class LinePicture:
    """What is seen of bodies from a direction."""

    lines: tuple[Line, ...]  # visible edges, x to the right and y up, mm
    # of each body that is seen: a visible point in its middle, mm
    anchors: dict[str, Point]


def line_picture(bodies: Mapping[str, trimesh.Trimesh], axes: Floats, piece: float) -> LinePicture:
    """Draw bodies.

    Args:
        bodies: meshes in mm by name.
        axes: right, up and toward the eye, as rows, (3, 3).
        piece: longest piece of an edge that is tested as one, mm.
    """
    names = sorted(bodies)
    whole = trimesh.util.concatenate([bodies[name] for name in names])
    rays = RayMeshIntersector(whole)
    lines: set[Line] = set()
    for name in names:
        lines.update(_visible(_pieces(bodies[name], axes[2], piece), rays, axes))
    found = {name: _anchor(bodies[name], rays, axes) for name in names}
    anchors = {name: anchor for name, anchor in found.items() if anchor is not None}
    return LinePicture(tuple(sorted(lines, key=lambda one: (one.start, one.end))), anchors)


def _pieces(mesh: trimesh.Trimesh, eye: Floats, piece: float) -> Floats:
    """Pieces of sharp edges and outlines: both ends and an outward direction, (n, 3, 3)."""
    pairs, normals = mesh.face_adjacency, mesh.face_normals
    front = normals[pairs] @ eye
    outline = (front[:, 0] > 0) != (front[:, 1] > 0)
    drawn = (mesh.face_adjacency_angles > SHARP_RAD) | outline
    drawn &= (front > 0).any(axis=1)
    ends = mesh.vertices[mesh.face_adjacency_edges[drawn]]
    facing = (front > 0)[drawn, :, np.newaxis]  # others lie on what the body stands on
    out = (normals[pairs[drawn]] * facing).sum(axis=1)
    out /= np.maximum(np.linalg.norm(out, axis=1), 1e-9)[:, np.newaxis]
    count = np.ceil(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / piece).astype(int)
    return _split(ends, out, np.maximum(count, 1))


def _split(ends: Floats, out: Floats, count: Ints) -> Floats:
    which = np.repeat(np.arange(len(ends)), count)
    place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    along = (ends[:, 1] - ends[:, 0])[which] / count[which][:, np.newaxis]
    start = ends[which, 0] + place[:, np.newaxis] * along
    return np.stack([start, start + along, out[which]], axis=1)


def _visible(pieces: Floats, rays: RayMeshIntersector, axes: Floats) -> list[Line]:
    if not len(pieces):
        return []
    start = pieces[:, :2].mean(axis=1) + OFF_MM * (pieces[:, 2] + axes[2])
    seen = ~_blocked(rays, start, axes[2])
    flat = np.round(pieces[seen, :2] @ axes[:2].T, DIGITS) + 0.0
    pairs = (sorted(map(tuple, pair)) for pair in flat.tolist())
    return [Line(Layer.CUT, start, end) for start, end in pairs]


def _blocked(rays: RayMeshIntersector, start: Floats, eye: Floats) -> Bools:
    return np.asarray(rays.intersects_any(start, np.broadcast_to(eye, start.shape)))


def _anchor(mesh: trimesh.Trimesh, rays: RayMeshIntersector, axes: Floats) -> Point | None:
    """The visible point of a body that is nearest to the middle of all visible ones."""
    facing = mesh.face_normals @ axes[2] > 0
    points = mesh.triangles_center[facing]
    if not len(points):
        return None
    seen = points[~_blocked(rays, points + OFF_MM * axes[2], axes[2])]
    if not len(seen):
        return None
    flat = seen @ axes[:2].T
    best = np.argmin(np.linalg.norm(flat - np.median(flat, axis=0), axis=1))
    x, y = np.round(flat[best], DIGITS).tolist()
    return x, y


def draw_assembly(export: DrawnExport) -> list[Sheet]:
    """A sheet for each side of the machine. InputError: its file is not as it was written."""
    machine = export.machine
    assert machine is not None
    path = export.file(machine.record.assembly.glb)
    parts = {**machine.bodies, **{one.name: one.part for one in machine.fasteners}}
    listed = {
        part: (item, machine.bill.quantities[part]) for part, item in machine.bill.items.items()
    }
    return assembly_sheets(path, parts, listed, export.title)


def assembly_sheets(
    path: Path, parts: Mapping[str, str], listed: Mapping[str, tuple[int, int]], design: str
) -> list[Sheet]:
    """A sheet for each side, with the numbers of what is seen there first.

    From the GLB file of all bodies, the part of each, and each part's number and quantity.
    """
    bodies = {
        one.name: trimesh.Trimesh(one.mesh.vertices, one.mesh.triangles)
        for one in read_glb(path)
        if not one.name.startswith(LEFT_OUT)
    }
    sheets, seen = list[Sheet](), set[str]()
    for k, eye in enumerate(EYES):
        picture = line_picture(bodies, _axes(eye), PIECE_MM)
        anchors: dict[str, Point] = {}  # of each part that has no number yet: its first body's
        for body, point in picture.anchors.items():
            part = parts.get(body, "")
            if part in listed and part not in seen:
                anchors.setdefault(part, point)
        seen |= anchors.keys()
        shown = {part: (*listed[part], point) for part, point in anchors.items()}
        sheets.append(_sheet(picture, shown, design, k))
    return sheets


def _axes(eye: Sequence[float]) -> Floats:
    toward = np.array(eye) / np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def _sheet(picture: LinePicture, shown: Called, design: str, k: int) -> Sheet:
    left, low, right, high = drawing_room(A3)
    column = right - sum(WIDTHS_MM) - BESIDE_MM
    room = left, low, column, high
    scale, origin = _fitted(picture, room)
    block = TitleBlock(
        title="general assembly",
        design=design,
        item="all",
        quantity=1,
        material="see the parts list",
        view=VIEWS[k],
        sheet=f"{k + 1} of {len(EYES)}",
        tolerances="none",
    )
    rows = sorted((item, quantity, part) for part, (item, quantity, _) in shown.items())
    cells = [(str(item), str(quantity), part) for item, quantity, part in rows]
    drawn = [
        *placed(picture.lines, origin, scale),
        *_balloons(shown, room, scale, origin),
        *table((column + BESIDE_MM, high), WIDTHS_MM, (HEAD, *cells)),
    ]
    name = NAME if k == 0 else f"{NAME}_{k + 1}"
    return Sheet.framed((name, NAME), block, A3, scale, origin, drawn, NOTES)


def _fitted(picture: LinePicture, room: Box) -> tuple[float, Point]:
    """Scale and place of a picture between two columns of numbers."""
    points = np.array([end for line in picture.lines for end in (line.start, line.end)])
    low, high = points.min(axis=0), points.max(axis=0)
    edge = 2 * EDGE / PIXELS
    space = room[2] - room[0] - 2 * edge, room[3] - room[1] - 2 * BESIDE_MM
    scale = choose_scale((high - low).tolist(), space, SCALES)
    middle = np.array([room[0] + room[2], room[1] + room[3]]) / 2 - scale * (low + high) / 2
    return scale, (float(middle[0]), float(middle[1]))


def _balloons(shown: Called, room: Box, scale: float, origin: Point) -> Iterator[Entity]:
    """Circles with numbers, and lines to the parts that do not cross."""
    left, low, right, high = room
    callouts = []
    for number, _, (x, y) in shown.values():
        on_paper = origin[0] + scale * x, origin[1] + scale * y
        pixel = (on_paper[0] - left) * PIXELS, (high - on_paper[1]) * PIXELS
        callouts.append(Callout(number, 1, pixel))
    size = round((right - left) * PIXELS), round((high - low) * PIXELS)
    for callout, place in place_callouts(callouts, size):
        x, y = left + place[0] / PIXELS, high - place[1] / PIXELS
        tip = left + callout.anchor[0] / PIXELS, high - callout.anchor[1] / PIXELS
        way = np.array([tip[0] - x, tip[1] - y])
        start = np.array([x, y]) + BALLOON_MM * way / max(float(np.hypot(*way)), BALLOON_MM)
        yield Line(Layer.DIMENSIONS, (float(start[0]), float(start[1])), tip)
        yield Circle(Layer.DIMENSIONS, tip, DOT_MM)
        yield Circle(Layer.DIMENSIONS, (x, y), BALLOON_MM)
        yield Text(Layer.DIMENSIONS, (x, y - TEXT_MM / 2), TEXT_MM, str(callout.number), "centre")
