"""The real camera at full resolution: every pixel's ray to the mirrors, the object, and beyond."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.rays import (
    distances_to_planes,
    first_hits,
    in_threads,
    pixel_rows,
    row_chunks,
)
from tbcad_verify.mesh.surfaces import (
    ReflectedRays,
    distance_before_mirror,
    nearest_to_origin,
    reflect,
    reflect_directions,
)
from tbcad_verify.mesh.vectors import crossings, dot, norm
from tbcad_verify.shell.optics import SensorScene
from tbcad_verify.types import Floats, Ints

# Second rays start this far above the mirror, mm: a hundred times what float32 rounds.
LIFT_MM = 1e-3
SAMPLED = 7  # a prime: no column of pixels is left out


@dataclass(frozen=True)
class PixelTally:
    """Counts over pixels: sums of integers and minima, which do not depend on the order."""

    pixels: Ints  # (M,) per mirror, whose reflected ray meets the capture sphere unhindered
    blocked: Ints  # (M,) per mirror, whose reflected ray is stopped before the capture sphere
    blockers: Ints  # (B,) facets that stop them, each once
    on_mirrors: int  # pixels that see any part of this camera's mirrors, of one in `SAMPLED`
    twice: int  # of those, how many rays meet another mirror after the first
    nearest: Floats  # (M,) minimum distance of useful camera-to-mirror rays from the origin, mm
    # (P,) distance at the object between the rays off facets and off fitted surfaces, for one
    # useful pixel in `SAMPLED`, mm
    spread: NDArray[np.float32]


def full_sensor(sensor: SensorScene) -> PixelTally:
    """Trace every pixel of one camera, twice."""
    return total(in_threads(lambda rows: trace_rows(sensor, *rows), row_chunks(sensor.camera)))


def total(tallies: list[PixelTally]) -> PixelTally:
    """Tallies of several bands or cameras as one."""
    return PixelTally(
        reduce(np.add, [t.pixels for t in tallies]),
        reduce(np.add, [t.blocked for t in tallies]),
        np.unique(np.concatenate([t.blockers for t in tallies])),
        sum(t.on_mirrors for t in tallies),
        sum(t.twice for t in tallies),
        reduce(np.minimum, [t.nearest for t in tallies]),
        np.concatenate([t.spread for t in tallies]),
    )


def trace_rows(sensor: SensorScene, first: int, last: int) -> PixelTally:
    """Trace the pixels of some rows."""
    rays = pixel_rows(sensor.camera, first, last)
    facet = first_hits(sensor.own, sensor.camera.pinhole[:, None], rays)
    mirror = sensor.owner[facet]
    on = np.flatnonzero(mirror >= 0)
    d, facet, mirror = np.take(rays, on, axis=1), facet[on], mirror[on]
    lines = reflect(sensor.seen, mirror, d)
    miss = nearest_to_origin(lines)
    distance = norm(miss)
    useful = distance <= sensor.setup.radius
    sampled = (first * sensor.camera.width + on) % SAMPLED == 0
    second, stopped = _second(sensor, lines, miss, distance, useful, useful | sampled)
    clear = np.flatnonzero(useful & ~stopped)
    on_object = mirror[clear]
    distance = distance_before_mirror(sensor.seen, np.take(d, clear, axis=1), lines.reach[clear])
    nearest = np.full(len(sensor.setup.export.mirrors), np.inf)
    np.minimum.at(nearest, on_object, distance)
    some = clear[sampled[clear]]
    return PixelTally(
        np.bincount(on_object, minlength=len(sensor.setup.export.mirrors)),
        np.bincount(mirror[stopped], minlength=len(sensor.setup.export.mirrors)),
        np.unique(second[stopped]).astype(np.int64),
        int(sampled.sum()),
        int((sensor.other[second] & ~stopped & sampled).sum()),
        nearest,
        _spread(sensor, facet[some], *(np.take(x, some, axis=1) for x in (d, lines.toward, miss))),
    )


def _second(
    sensor: SensorScene,
    lines: ReflectedRays,
    miss: Floats,
    distance: Floats,
    useful: NDArray[np.bool_],
    asked: NDArray[np.bool_],
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """The next facet along reflected rays, and which useful rays it stops before the object.

    -1 where there is none, and where it is not asked for.
    """
    length = norm(lines.toward)
    start = lines.point + (LIFT_MM / length) * lines.toward
    second, some = np.full(asked.size, -1, dtype=np.int32), np.flatnonzero(asked)
    ways = np.take(start, some, axis=1), np.take(lines.toward, some, axis=1)
    second[some] = first_hits(sensor.setup.scene, *ways)
    stopped = np.zeros(second.size, dtype=np.bool_)
    hit = np.flatnonzero(useful & (second >= 0))
    toward, begin = np.take(lines.toward, hit, axis=1), np.take(start, hit, axis=1)
    at = distances_to_planes(sensor.setup.scene, second[hit], begin, toward) * length[hit]
    depth = np.sqrt(np.maximum(sensor.setup.radius**2 - distance[hit] ** 2, 0))
    stopped[hit] = at < norm(np.take(miss, hit, axis=1) - begin) - depth
    return second, stopped


def _spread(
    sensor: SensorScene, facet: NDArray[np.int32], d: Floats, toward: Floats, miss: Floats
) -> NDArray[np.float32]:
    """Distance at the object, across the fitted ray, of the ray off the facet's plane."""
    plane = sensor.setup.scene.plane(facet)
    pinhole = sensor.camera.pinhole[:, None]
    t = (plane[3] + sensor.setup.export.coating_mm - dot(pinhole, plane[:3])) / dot(d, plane[:3])
    point, bounced = pinhole + t * d, reflect_directions(d, plane[:3])
    return norm(crossings(point, bounced, toward) - miss).astype(np.float32)
