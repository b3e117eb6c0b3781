"""Where each pixel's ray meets its mirror, and where it goes from there: exact spheres."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.optics.camera import Camera
from tbcad.optics.surfaces import Surfaces
from tbcad.simulate.parallel import compiled
from tbcad.simulate.scene.reflector import Reflector, pixel_pitch
from tbcad.types import Floats, Ints

MirrorNumbers = NDArray[np.int32]
Shift = tuple[float, float]

AT_PINHOLE = np.zeros(3)

# A point on the edge of two cells lies on both spheres but for rounding.
ROUNDING_MM = 1e-9


@dataclass(frozen=True)
class ReflectedRays:
    """Rays after the mirrors, of a band of h rows and w columns.

    Attributes:
        mirror: number of the mirror, from 1 in the order of the ids; 0 where there is none
            of this camera's, (h, w).
        origin: points on the mirrors, mm, (h, w, 3); zero where there is none.
        direction: unit vectors after the mirror, (h, w, 3); zero where there is none.
    """

    mirror: MirrorNumbers
    origin: Floats
    direction: Floats

    def meeting(self, radius: float) -> NDArray[np.bool_]:
        """Which rays meet the sphere of a radius (mm) about the origin, (h, w)."""
        along = np.einsum("hwx,hwx->hw", self.origin, self.direction)
        away = np.einsum("hwx,hwx->hw", self.origin, self.origin) - along**2
        meets: NDArray[np.bool_] = (self.mirror > 0) & (along < 0) & (away <= radius**2)
        return meets

    def without(self, gone: NDArray[np.bool_]) -> "ReflectedRays":
        """These rays but for some pixels (h, w)."""
        if not gone.any():
            return self
        none = gone[..., None]
        return ReflectedRays(
            np.where(gone, np.int32(0), self.mirror),
            np.where(none, 0.0, self.origin),
            np.where(none, 0.0, self.direction),
        )


def pixel_directions(view: Camera, rows: range, shift: Shift = (0.0, 0.0)) -> Floats:
    """Directions (h, w, 3) through pixels, their component along `forward` one.

    Args:
        view: the camera.
        rows: rows of the band.
        shift: from the pixels' centres, in pixels: to the right and down.
    """
    columns, lines = _lattice(view, rows, shift)
    result: Floats = columns + lines[:, None]
    return result


def unit_directions(
    view: Camera,
    rows: range,
    shift: Shift = (0.0, 0.0),
    depth: float = 1.0,
    aside: Floats = AT_PINHOLE,
) -> Floats:
    """Unit vectors (h, w, 3) toward what pixels see at a depth, from a place beside the pinhole.

    Args:
        view: the camera.
        rows: rows of the band.
        shift: from the pixels' centres, in pixels: to the right and down.
        depth: along `forward`, mm; it matters beside the pinhole only.
        aside: place less the pinhole, mm, (3,).
    """
    return _toward(*_lattice(view, rows, shift), depth, aside)


def _lattice(view: Camera, rows: range, shift: Shift) -> tuple[Floats, Floats]:
    """Directions to columns (w, 3), and what rows add to them (h, 3)."""
    width = pixel_pitch(view)
    across = (np.arange(view.width_px) - (view.width_px - 1) / 2 + shift[0]) * width
    downward = (np.arange(rows.start, rows.stop) - (view.height_px - 1) / 2 + shift[1]) * width
    down = np.cross(view.forward, view.right)
    return view.forward + across[:, None] * view.right, downward[:, None] * down


@compiled
def _toward(columns: Floats, lines: Floats, depth: float, aside: Floats) -> Floats:
    result = np.empty((len(lines), len(columns), 3))
    for y in range(len(lines)):
        for x in range(len(columns)):
            a = (columns[x, 0] + lines[y, 0]) * depth - aside[0]
            b = (columns[x, 1] + lines[y, 1]) * depth - aside[1]
            c = (columns[x, 2] + lines[y, 2]) * depth - aside[2]
            length = np.sqrt(a * a + b * b + c * c)
            result[y, x, 0], result[y, x, 1], result[y, x, 2] = a / length, b / length, c / length
    return result


def exact_tracer(at: Reflector) -> Callable[[range, Shift], ReflectedRays]:
    """What gives the rays of rows of a camera's picture off its exact mirrors.

    The mirror that a ray meets first is the one whose surface it enters first, since a cell is
    what no other sphere covers (DESIGN.md section 2). What lies beyond seam or foot is no mirror.
    """
    boxes, beside, table = at.boxes(), at.beside_edge(), _table(at.mirrors)

    def trace(rows: range, shift: Shift) -> ReflectedRays:
        way = pixel_directions(at.camera, rows, shift)
        near = np.flatnonzero((boxes[:, 2] < rows.stop) & (boxes[:, 3] > rows.start))
        in_band = boxes - np.array([0, 0, rows.start, rows.start])
        mirror = _first(at.camera.pinhole, way, table, near, in_band, at.side, at.foot)
        rays = reflect_pixels(at.camera.pinhole, way, at.mirrors, mirror)
        return rays.without(_covered(table, beside, mirror, rays.origin))

    return trace


def reflect_pixels(
    pinhole: Floats, way: Floats, mirrors: Surfaces, mirror: MirrorNumbers
) -> ReflectedRays:
    """Rays along (h, w, 3) from the pinhole after mirrors of given numbers (h, w)."""
    origin, direction = np.zeros_like(way), np.zeros_like(way)
    _reflect(pinhole, way, _table(mirrors), mirror, origin, direction)
    return ReflectedRays(mirror, origin, direction)


def _table(mirrors: Surfaces) -> Floats:
    return np.column_stack([mirrors.apex, mirrors.normal, mirrors.curvature])


@compiled
def _first(
    pinhole: Floats,
    way: Floats,
    table: Floats,
    near: Ints,
    boxes: Ints,
    side: float,
    foot: float,
) -> MirrorNumbers:
    """The surface that each ray of the band enters first, from 1, out of those near it.

    On the ray x = pinhole + t d the surface's f (tbcad.optics.surfaces) is A t^2 + B t + C; the
    ray enters at the lesser root, in the form that loses no digits and holds for planes.
    """
    height, width = way.shape[0], way.shape[1]
    mirror = np.zeros((height, width), dtype=np.int32)
    reach = np.full((height, width), np.inf)
    for i in near:
        px, py, pz = pinhole[0] - table[i, 0], pinhole[1] - table[i, 1], pinhole[2] - table[i, 2]
        nx, ny, nz, k = table[i, 3], table[i, 4], table[i, 5], table[i, 6]
        c = nx * px + ny * py + nz * pz + k / 2 * (px * px + py * py + pz * pz)
        gx, gy, gz = nx + k * px, ny + k * py, nz + k * pz
        for y in range(max(boxes[i, 2], 0), min(boxes[i, 3], height)):
            for x in range(boxes[i, 0], boxes[i, 1]):
                dx, dy, dz = way[y, x, 0], way[y, x, 1], way[y, x, 2]
                b = gx * dx + gy * dy + gz * dz
                root = b * b - 2 * k * c * (dx * dx + dy * dy + dz * dz)
                if b >= 0 or root < 0:
                    continue
                t = 2 * c / (np.sqrt(root) - b)
                if (
                    0 < t < reach[y, x]
                    and side * (pinhole[0] + t * dx) >= 0
                    and pinhole[2] + t * dz >= foot
                ):
                    reach[y, x], mirror[y, x] = t, i + 1
    return mirror


@compiled
def _covered(
    table: Floats, beside: Ints, mirror: MirrorNumbers, point: Floats
) -> NDArray[np.bool_]:
    """Which points (h, w, 3) on numbered mirrors lie inside the sphere of one beside the edge."""
    inside = np.zeros(mirror.shape, dtype=np.bool_)
    for y in range(mirror.shape[0]):
        for x in range(mirror.shape[1]):
            if mirror[y, x] == 0:
                continue
            for j in beside[mirror[y, x] - 1]:
                if j < 0:
                    break
                value = 0.0
                for axis in range(3):
                    away = point[y, x, axis] - table[j, axis]
                    value += (table[j, 3 + axis] + table[j, 6] / 2 * away) * away
                if value < -ROUNDING_MM:
                    inside[y, x] = True
    return inside


@compiled
def _reflect(
    pinhole: Floats,
    way: Floats,
    table: Floats,
    mirror: MirrorNumbers,
    origin: Floats,
    direction: Floats,
) -> None:
    """Fill in points on the numbered mirrors and unit directions after them."""
    for y in range(way.shape[0]):
        for x in range(way.shape[1]):
            i = mirror[y, x] - 1
            if i < 0:
                continue
            k, length = table[i, 6], 0.0
            for j in range(3):
                length += way[y, x, j] ** 2
            length, b, c = np.sqrt(length), 0.0, 0.0
            for j in range(3):
                away, n = pinhole[j] - table[i, j], table[i, 3 + j]
                c += (n + k / 2 * away) * away
                b += (n + k * away) * way[y, x, j] / length
            t, slope = 2 * c / (np.sqrt(b * b - 2 * k * c) - b), 0.0
            for j in range(3):
                d = way[y, x, j] / length
                origin[y, x, j] = pinhole[j] + t * d
                slope += d * (table[i, 3 + j] + k * (origin[y, x, j] - table[i, j]))
            for j in range(3):
                n = table[i, 3 + j] + k * (origin[y, x, j] - table[i, j])
                direction[y, x, j] = way[y, x, j] / length - 2 * slope * n
