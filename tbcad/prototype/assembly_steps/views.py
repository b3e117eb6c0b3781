"""Line pictures of the steps of assembly: new parts apart from their places, others thin."""

from collections.abc import Callable, Iterable, Sequence
from itertools import product

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from tbcad.cad.drafting.callouts import EDGE, PIXELS, balloons
from tbcad.cad.drafting.line_pictures import Bodies, LinePicture, axes_toward, ray_scene, seen_lines
from tbcad.cad.drafting.sheet import Box
from tbcad.cad.formats.entities import Entity, Layer, Line, Point, Polyline
from tbcad.common.reuse import kept
from tbcad.prototype.assembly_steps.exploded import offsets
from tbcad.prototype.assembly_steps.machine import AssembledMachine
from tbcad.prototype.assembly_steps.steps import Step
from tbcad.types import Floats, Ints

FILLED, CONTEXT = 0.94, 0.45  # share of the room that new parts fill, and of all that is shown
PIECE_MM = 0.4  # on paper, of edges that are tested as one
# Directions to look from, degrees; their worth, since people look from above and from a corner.
AZIMUTHS, ELEVATIONS = range(-135, 181, 45), {20: 1.0, 50: 0.95, -25: 0.8, -55: 0.7}
SQUARE_DEG, SQUARE_WORTH = 90, 0.55  # lines do not tell what is in front
GRID = 50  # rays along the longer side, to see what is seen from a direction
DECIMALS = 2  # of a place on paper, mm
EXPLODED_EYE, APART = (1.0, -1.0, 0.45), 0.5  # share of its place that what stands still is moved
HIDING = ("shroud_", "capture_sphere", "camera_view")


def step_picture(machine: AssembledMachine, step: Step, bodies: Bodies, room: Box) -> list[Entity]:
    """The picture of a step in a room on paper, mm, with the numbers of its parts.

    Nothing where no body of the step is drawn.
    """
    new = frozenset(name for use in step.parts for name in use.bodies if name in bodies)
    if not new:
        return []
    moved = offsets(machine, new)
    shown = {
        name: _moved(bodies[name], moved.get(name, np.zeros(3)))
        for name in sorted({*new, *step.near} & bodies.keys())
    }
    groups = [[name for name in use.bodies if name in new] for use in step.parts]
    listed = [(use.item, group) for use, group in zip(step.parts, groups, strict=True)]
    return _drawn(shown, new, None, listed, room)


def whole_picture(machine: AssembledMachine, bodies: Bodies, room: Box) -> list[Entity]:
    """All parts but shroud and fasteners, apart."""
    fasteners = {one.name for one in machine.fasteners}
    tools = {one.name for one in machine.record.with_role("tool")}
    new = frozenset(
        name
        for name in machine.bodies.keys() & bodies.keys()
        if not name.startswith(HIDING) and name not in fasteners | tools
    )
    turning = {one.name for one in machine.record.bought if one.turns}
    turning |= {one.name for one in machine.record.with_role("base", "cap")}
    moved = offsets(machine, new)
    for name in new - turning:
        if not name.startswith("ball_"):
            moved[name] = moved[name] + APART * bodies[name].bounds.mean(axis=0)
    shown = {name: _moved(bodies[name], moved[name]) for name in sorted(new)}
    names: dict[int, list[str]] = {}
    for name in sorted(new):
        if part := machine.bodies[name]:
            names.setdefault(machine.bill.items[part], []).append(name)
    return _drawn(shown, new, EXPLODED_EYE, sorted(names.items()), room)


def _moved(mesh: trimesh.Trimesh, way: Floats) -> trimesh.Trimesh:
    """A mesh elsewhere; one in its place is itself, so that its edges are found once."""
    return mesh.copy(include_cache=True).apply_translation(way) if way.any() else mesh


@kept("pictures")
def _drawn(
    shown: Bodies,
    new: frozenset[str],
    eye: tuple[float, float, float] | None,
    listed: list[tuple[int, list[str]]],
    room: Box,
) -> list[Entity]:
    """Lines in the room that balloons leave, and a balloon for each kind of part that is seen.

    From the direction `eye`; None: from which most kinds are seen.
    """
    rays = ray_scene(shown)
    groups = [group for _, group in listed if group]
    axes = axes_toward(eye or best_eye(_counting(shown, rays, groups), SQUARE_WORTH))
    left, low, right, high = room
    edge = 2 * EDGE / PIXELS
    inner = (left + edge, low, right - edge, high)
    middle, scale = _fitted(shown, new, axes, inner)
    picture = seen_lines(shown, rays, axes, PIECE_MM / scale, shown.keys() - new)
    centre = np.array([inner[0] + inner[2], inner[1] + inner[3]]) / 2
    on_paper = _placing(centre - scale * middle, scale)
    lines = [
        Line(one.layer, *clipped)
        for one in picture.lines
        if (clipped := _clipped(on_paper(one.start), on_paper(one.end), inner))
    ]
    points = list(_anchors(picture, listed, on_paper, inner))
    return [*_chained(lines), *balloons(points, room)]


def _fitted(shown: Bodies, new: frozenset[str], axes: Floats, room: Box) -> tuple[Floats, float]:
    """Middle of the new parts in the picture's plane, and the scale at which they fit, (2,)."""
    least, most = _reach(_corners(shown, shown.keys()), axes)
    low, high = _reach(_corners(shown, new), axes)
    size = np.maximum(high - low, CONTEXT * (most - least))
    space = np.array([room[2] - room[0], room[3] - room[1]])
    return (low + high) / 2, float(FILLED * (space / np.maximum(size, 1.0)).min())


def _corners(bodies: Bodies, names: Iterable[str]) -> Floats:
    return np.vstack([bodies[name].vertices for name in sorted(names)])


def _reach(corners: Floats, axes: Floats) -> tuple[Floats, Floats]:
    points = axes[:2] @ corners.T
    return points.min(axis=1), points.max(axis=1)


def _placing(origin: Floats, scale: float) -> Callable[[Point], Point]:
    left, low = origin.tolist()
    return lambda point: (
        round(left + scale * point[0], DECIMALS),
        round(low + scale * point[1], DECIMALS),
    )


def _anchors(
    picture: LinePicture,
    listed: Iterable[tuple[int, list[str]]],
    on_paper: Callable[[Point], Point],
    room: Box,
) -> Iterable[tuple[int, Point]]:
    """A visible point in the room of one body of each kind of part."""
    for item, names in listed:
        places = (on_paper(picture.anchors[name]) for name in names if name in picture.anchors)
        found = next((place for place in places if _inside(place, room)), None)
        if found is not None:
            yield item, found


def _inside(point: Point, room: Box) -> bool:
    return room[0] <= point[0] <= room[2] and room[1] <= point[1] <= room[3]


def _clipped(start: Point, end: Point, room: Box) -> tuple[Point, Point] | None:
    """The part of a line inside a box (Liang and Barsky); None without any."""
    if _inside(start, room) and _inside(end, room):
        return (start, end) if start != end else None
    way, first, last = (end[0] - start[0], end[1] - start[1]), 0.0, 1.0
    for k in (0, 1):
        for sign, limit in ((-1.0, room[k]), (1.0, room[k + 2])):
            along, off = sign * way[k], sign * (limit - start[k])
            if along == 0.0:
                if off < 0.0:
                    return None
            elif along < 0.0:
                first = max(first, off / along)
            else:
                last = min(last, off / along)
    if first >= last:
        return None
    ends = [
        (round(start[0] + t * way[0], DECIMALS), round(start[1] + t * way[1], DECIMALS))
        for t in (first, last)
    ]
    return (ends[0], ends[1]) if ends[0] != ends[1] else None


def _chained(lines: Iterable[Line]) -> list[Entity]:
    """Lines that meet end to end as polylines, each line once."""
    left = dict.fromkeys(Line(one.layer, *sorted((one.start, one.end))) for one in lines)
    meeting: dict[tuple[Layer, Point], list[Line]] = {}
    for one in left:
        for end in (one.start, one.end):
            meeting.setdefault((one.layer, end), []).append(one)
    drawn: list[Entity] = []
    while left:
        one = next(iter(left))
        del left[one]
        corners = [one.start, one.end]
        while follow := [two for two in meeting[one.layer, corners[-1]] if two in left]:
            del left[follow[0]]
            corners.append(_other_end(follow[0], corners[-1]))
        drawn.append(Polyline(one.layer, tuple(corners), closed=False))
    return drawn


def _other_end(line: Line, end: Point) -> Point:
    return line.end if line.start == end else line.start


def best_eye(seen: Callable[[Floats], Sequence[int]], square_worth: float) -> Floats:
    """The direction from which most kinds of new parts are seen.

    seen: how much is seen of each kind from a direction; square_worth: of directions along x or y.
    """
    eyes, worth, area = [], [], []
    for (elevation, value), azimuth in product(ELEVATIONS.items(), AZIMUTHS):
        turn, up = np.radians(azimuth), np.radians(elevation)
        eye = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
        eyes.append(eye)
        worth.append(value * (square_worth if azimuth % SQUARE_DEG == 0 else 1.0))
        area.append(seen(eye))
    share = np.array(area) / np.maximum(np.max(area, axis=0), 1.0)
    return eyes[int(np.argmax(np.sqrt(share).sum(axis=1) * np.array(worth)))]


def _counting(
    bodies: Bodies, rays: RayMeshIntersector, groups: list[list[str]]
) -> Callable[[Floats], list[int]]:
    """Rays from a direction that meet the best seen body of each group; rays: of their scene."""
    names = sorted(bodies)
    owner = np.repeat(np.arange(len(names)), [len(bodies[name].faces) for name in names])
    numbers = [[names.index(name) for name in group] for group in groups]
    corners = _corners(bodies, bodies)

    def seen(eye: Floats) -> list[int]:
        counts = np.bincount(_seen(rays, owner, corners, eye), minlength=len(names))
        return [int(counts[group].max()) for group in numbers]

    return seen


def _seen(rays: RayMeshIntersector, owner: Ints, corners: Floats, eye: Floats) -> Ints:
    """Numbers of the bodies, of all corners, that a grid of rays from a direction meets first."""
    axes = axes_toward(eye)
    low, high = _reach(corners, axes)
    step = float((high - low).max()) / GRID
    x, y = (np.arange(low[k] + step / 2, high[k], step) for k in (0, 1))
    flat = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)
    far = float((corners @ eye).max()) + 1.0
    start = flat @ axes[:2] + far * eye
    hit = rays.intersects_first(start, np.broadcast_to(-eye, start.shape))
    return np.asarray(owner[hit[hit >= 0]])
