"""Rays of pixels: of cameras that look at the object, and off the exact mirrors."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled
from tbcad.core.geometry.loop_vectors import (
    Vector,
    dot,
    minus,
    plus_scaled,
    reflect,
    scaled,
    unit,
    vector,
)
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.surfaces import Surfaces
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.types import Bools, Floats, Ints

MirrorNumbers = NDArray[np.int32]
Shift = tuple[float, float]

AT_PINHOLE = np.zeros(3)

# A point on the edge of two cells lies on both spheres but for rounding.
ROUNDING_MM = 1e-9
# Size of a picture in diameters of the capture sphere.
FRAME_MARGIN = 1.05


@dataclass(frozen=True)
class TracedRays:
    """Rays after the mirrors, of a band of h rows and w columns."""

    # number of the mirror, from 1 in the order of the ids; 0 where there is none of this camera's,
    # (h, w)
    mirror: MirrorNumbers
    origin: Floats  # points on the mirrors, mm, (h, w, 3); zero where there is none
    direction: Floats  # unit vectors after the mirror, (h, w, 3); zero where there is none

    def meeting(self, radius: float) -> Bools:
        """Which rays meet the sphere of a radius (mm) about the origin, (h, w)."""
        meets = meets_sphere(self.origin.reshape(-1, 3), self.direction.reshape(-1, 3), radius)
        return (self.mirror > 0) & meets.reshape(self.mirror.shape)

    def without(self, removed: Bools) -> "TracedRays":
        """These rays without those of some pixels (h, w)."""
        if not removed.any():
            return self
        none = removed[..., None]
        return TracedRays(
            np.where(removed, np.int32(0), self.mirror),
            np.where(none, 0.0, self.origin),
            np.where(none, 0.0, self.direction),
        )


def pixel_directions(view: Camera, rows: range, shift: Shift = (0.0, 0.0)) -> Floats:
    """Directions (h, w, 3) through pixels of rows, their component along `forward` one.

    `shift`: from the pixels' centres, in pixels, to the right and down.
    """
    columns, lines = _lattice(view, rows, shift)
    return np.asarray(columns + lines[:, None])


def unit_directions(
    view: Camera,
    rows: range,
    shift: Shift = (0.0, 0.0),
    depth: float = 1.0,
    aside: Floats = AT_PINHOLE,
) -> Floats:
    """Unit vectors (h, w, 3) toward what pixels see at a depth, from a place beside the pinhole.

    `shift` as of `pixel_directions`; `depth` is along `forward`, mm; `aside`: the place less the
    pinhole, mm, (3,).
    """
    return _toward(*_lattice(view, rows, shift), depth, aside)


def _lattice(view: Camera, rows: range, shift: Shift) -> tuple[Floats, Floats]:
    """Directions to columns (w, 3), and what rows add to them (h, 3)."""
    right, down, forward = view.axes
    x = np.arange(view.width_px) - (view.width_px - 1) / 2 + shift[0]
    y = np.arange(rows.start, rows.stop) - (view.height_px - 1) / 2 + shift[1]
    pitch = view.pixel_pitch
    return forward + (x * pitch)[:, None] * right, (y * pitch)[:, None] * down


@compiled
def _toward(columns: Floats, lines: Floats, depth: float, aside: Floats) -> Floats:
    result = np.empty((len(lines), len(columns), 3))
    for y in range(len(lines)):
        for x in range(len(columns)):
            seen = scaled(depth, plus_scaled(vector(columns[x]), 1.0, vector(lines[y])))
            result[y, x, 0], result[y, x, 1], result[y, x, 2] = unit(minus(seen, vector(aside)))
    return result


@dataclass(frozen=True)
class PupilPoint:
    """A point of a lens's pupil that rays go through, from what is in focus."""

    aside: Floats  # the point less the pinhole, mm, (3,)
    focus: float  # depth that is in focus, along `forward`, mm
    margin_px: int = 1  # by which what is out of focus may be beside its place from the pinhole

    def directions(self, view: Camera, rows: range, shift: Shift) -> Floats:
        """Unit vectors (h, w, 3) from the point toward what pixels see in focus."""
        return unit_directions(view, rows, shift, self.focus, self.aside)


def exact_tracer(
    reflector: Reflector, through: PupilPoint | None = None
) -> Callable[[range, Shift], TracedRays]:
    """A function that traces rows of a camera's pixels off its exact mirrors (`part_tracer`)."""
    trace, columns = part_tracer(reflector, through), range(reflector.camera.width_px)
    return lambda rows, shift: trace(rows, columns, shift)


def part_tracer(
    reflector: Reflector, through: PupilPoint | None = None
) -> Callable[[range, range, Shift], TracedRays]:
    """A function that traces some rows and columns of a camera's pixels off its exact mirrors.

    The mirror that a ray meets first is the one whose surface it enters first, since a cell is
    what no other sphere covers (DESIGN.md section 2). What lies beyond seam or foot is no mirror,
    nor what lies beyond a wall of the mirror's own pedestal: there the ray ends in a groove.
    Rays go through the pinhole, or another point of the pupil.
    """
    boxes, neighbours = reflector.boxes(), reflector.neighbours_at_edge()
    camera, edges = reflector.camera, (reflector.side, reflector.foot)
    start = camera.pinhole
    if through is not None:
        start = camera.pinhole + through.aside
        boxes = boxes + through.margin_px * np.array([-1, 1, -1, 1])
    table = _table(reflector.mirrors, start)
    walls = reflector.walls.of_mirrors(len(reflector))

    def trace(rows: range, columns: range, shift: Shift) -> TracedRays:
        every = through.directions if through else pixel_directions
        direction = every(camera, rows, shift)[:, columns.start : columns.stop]
        in_part = boxes - np.repeat([columns.start, rows.start], 2)
        in_part[:, :2] = np.clip(in_part[:, :2], 0, len(columns))
        near = np.flatnonzero(
            (in_part[:, 2] < len(rows)) & (in_part[:, 3] > 0) & (in_part[:, 0] < in_part[:, 1])
        )
        mirror = _first_mirror(start, direction, table, near, in_part, walls, edges)
        rays = reflect_pixels(start, direction, reflector.mirrors, mirror)
        return rays.without(_inside_neighbours(table, neighbours, mirror, rays.origin))

    return trace


def reflect_pixels(
    pinhole: Floats, direction: Floats, mirrors: Surfaces, mirror: MirrorNumbers
) -> TracedRays:
    """Rays along (h, w, 3) from the pinhole after mirrors of given numbers (h, w)."""
    origin, reflected = np.zeros_like(direction), np.zeros_like(direction)
    _reflect(pinhole, direction, _table(mirrors, pinhole), mirror, origin, reflected)
    return TracedRays(mirror, origin, reflected)


def _table(mirrors: Surfaces, pinhole: Floats) -> Floats:
    """For each mirror apex, normal, curvature, and value and gradient at the pinhole, (m, 11)."""
    every = np.arange(len(mirrors))
    at_pinhole = np.broadcast_to(pinhole, mirrors.apex.shape)
    value, gradient = mirrors.value(every, at_pinhole), mirrors.gradient(every, at_pinhole)
    return np.column_stack([mirrors.apex, mirrors.normal, mirrors.curvature, value, gradient])


@compiled
def meets_sphere(origin: Floats, direction: Floats, radius: float) -> Bools:
    """Which rays (n, 3) along unit directions meet the sphere of a radius about (0, 0, 0), (n,)."""
    meets = np.zeros(len(origin), dtype=np.bool_)
    for i in range(len(origin)):
        start, way = vector(origin[i]), vector(direction[i])
        along, squared = dot(start, way), dot(start, start)
        ahead = along < 0 or squared <= radius * radius
        meets[i] = dot(way, way) > 0 and ahead and squared - along * along <= radius * radius
    return meets


@compiled
def _entry(mirror: Floats, way: Vector) -> float:
    """Where a ray from the pinhole enters a mirror (11,), in lengths of its direction.

    On the ray x = pinhole + t d the surface's f (core.optics.surfaces) is k/2 d.d t^2 + g.d t + h;
    the ray enters at the smaller root, in the form that loses no digits and holds for planes.
    Infinite where it does not enter.
    """
    slope = dot(vector(mirror, 8), way)
    root = slope * slope - 2 * mirror[6] * mirror[7] * dot(way, way)
    if slope >= 0 or root < 0:
        return np.inf
    t: float = 2 * mirror[7] / (np.sqrt(root) - slope)
    return t


@compiled
def within_walls(walls: Floats, point: Vector) -> bool:
    """Whether a point lies on the inner side of all walls (k, 6)."""
    for wall in walls:
        inward = vector(wall, 3)
        if dot(minus(point, vector(wall)), inward) < 0:
            return False
    return True


@compiled
def _first_mirror(
    pinhole: Floats,
    direction: Floats,
    table: Floats,
    near: Ints,
    boxes: Ints,
    walls: tuple[Ints, Floats],
    edges: tuple[float, float],
) -> MirrorNumbers:
    """The mirror that each ray of the band enters first, from 1, out of those near it."""
    (side, foot), (first_wall, every_wall), start = edges, walls, vector(pinhole)
    height, width = direction.shape[0], direction.shape[1]
    mirror = np.zeros((height, width), dtype=np.int32)
    reach = np.full((height, width), np.inf)
    for i in near:
        own = every_wall[first_wall[i] : first_wall[i + 1]]
        for y in range(max(boxes[i, 2], 0), min(boxes[i, 3], height)):
            for x in range(boxes[i, 0], boxes[i, 1]):
                way = vector(direction[y, x])
                t = _entry(table[i], way)
                if 0 < t < reach[y, x]:
                    point = plus_scaled(start, t, way)
                    if side * point[0] >= 0 and point[2] >= foot and within_walls(own, point):
                        reach[y, x], mirror[y, x] = t, i + 1
    return mirror


@compiled
def _inside_neighbours(
    table: Floats, neighbours: Ints, mirror: MirrorNumbers, point: Floats
) -> Bools:
    """Which points (h, w, 3) on mirrors lie inside the sphere of a neighbour cut by the edge."""
    inside = np.zeros(mirror.shape, dtype=np.bool_)
    for y in range(mirror.shape[0]):
        for x in range(mirror.shape[1]):
            if mirror[y, x] == 0:
                continue
            for j in neighbours[mirror[y, x] - 1]:
                if j < 0:
                    break
                offset = minus(vector(point[y, x]), vector(table[j]))
                gradient = plus_scaled(vector(table[j], 3), table[j, 6] / 2, offset)
                if dot(gradient, offset) < -ROUNDING_MM:
                    inside[y, x] = True
    return inside


@compiled
def _reflect(
    pinhole: Floats,
    direction: Floats,
    table: Floats,
    mirror: MirrorNumbers,
    origin: Floats,
    reflected: Floats,
) -> None:
    """Fill in points on the numbered mirrors and unit directions after them."""
    start = vector(pinhole)
    for y in range(direction.shape[0]):
        for x in range(direction.shape[1]):
            if mirror[y, x] == 0:
                continue
            row, way = table[mirror[y, x] - 1], unit(vector(direction[y, x]))
            point = plus_scaled(start, _entry(row, way), way)
            normal = plus_scaled(vector(row, 3), row[6], minus(point, vector(row)))
            origin[y, x, 0], origin[y, x, 1], origin[y, x, 2] = point
            out = reflect(way, normal)
            reflected[y, x, 0], reflected[y, x, 1], reflected[y, x, 2] = out


def camera_around_object(
    azimuth: float,
    elevation: float,
    distance: float,
    capture_mm: float,
    size: tuple[int, int] = (640, 480),
) -> Camera:
    """A pinhole camera that looks at the origin, z up.

    Azimuth about z from x, and elevation above z = 0, in radians; the capture sphere fills the
    shorter side but for a small margin. `size`: columns and rows. InputError for a viewpoint below
    the hemisphere of virtual cameras, or in the object.
    """
    if not 0 <= elevation <= np.pi / 2:
        raise InputError(
            f"--elevation {np.degrees(elevation):g} is not on the hemisphere that the mirrors "
            "see: allowed is 0 to 90 degrees"
        )
    if not np.isfinite(distance):
        raise InputError(f"--distance {distance:g} is no length: give mm")
    if distance <= capture_mm / 2:
        raise InputError(
            f"--distance {distance:g} is inside the object's capture sphere: allowed is more than "
            f"{capture_mm / 2:g} mm"
        )
    if not np.isfinite(azimuth):
        raise InputError("--azimuth is not a number: give degrees")
    horizontal = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    forward = -np.cos(elevation) * horizontal - np.sin(elevation) * np.array([0.0, 0.0, 1.0])
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    tangent = np.tan(np.arcsin(capture_mm / 2 / distance))
    hfov = float(2 * np.arctan(FRAME_MARGIN * tangent * size[0] / min(size)))
    return Camera(-distance * forward, forward, right, *size, hfov)


def view_directions(view: Camera, shift: tuple[float, float] = (0.0, 0.0)) -> Floats:
    """Unit directions (h, w, 3) of all pixels."""
    return unit_directions(view, range(view.height_px), shift)
