"""How near to the object light passes on its way between mirrors and camera."""

from collections.abc import Callable

import numpy as np

from tbcad.core.geometry.vectors import dot, norm
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.reflection import miss_distances
from tbcad.core.optics.windows import (
    cell_sides,
    minima_by_mirror,
    parabola_minima,
    samples_about_minima,
)
from tbcad.types import Floats, Ints

# Light in use ends at a share of the way from the apex to the edge of the cell, found to 2^-16 of
# it: micrometres on a cell of a hand's width.
BISECTIONS = 16
ROUNDS = 2  # after two rounds the samples are a 32nd of the side apart; a parabola does the rest


def closest_passage(cells: Cells, pinhole: Floats, capture: float) -> tuple[float, int]:
    """Smallest distance (mm) from the origin at which light passes, and its mirror.

    Light is in use where its mirror shows the capture sphere of a radius (mm). If it passes closer,
    the object stands in it. Apices show the origin, and in the picture a mirror's part in use does
    not contain it, so what passes closest is at the edge of that part: where rays graze the capture
    sphere, or at the edge of the cell.
    """
    mirror, arc = cell_sides(cells)

    def passing(point: Floats) -> Floats:
        return passing_distances(pinhole, point)

    def in_use(edge: Floats) -> Floats:
        mirrors = np.broadcast_to(mirror[:, None], edge.shape[:-1])
        return passing(_last_in_use(cells, mirrors, edge, pinhole, capture))

    # An apex is in use: a mirror all of whose cell is farther off than one needs no closer look.
    at_edge = minima_by_mirror(mirror, _minima(cells, arc, passing), cells.mirrors)
    enough = max(passing(cells.mirror_surfaces.apex).min(), at_edge.min())
    close = at_edge[mirror] <= enough
    mirror, arc = mirror[close], arc[close]
    distance = _minima(cells, arc, in_use)
    return float(distance.min()), int(mirror[distance.argmin()])


def passing_distances(pinhole: Floats, point: Floats) -> Floats:
    """Distances (...) from the origin of straight ways from a pinhole to points (..., 3), mm."""
    ray = point - pinhole
    share = np.clip(-(ray @ pinhole) / dot(ray, ray), 0, 1)
    return norm(pinhole + share[..., None] * ray)


def _minima(cells: Cells, arc: Ints, function: Callable[[Floats], Floats]) -> Floats:
    """Smallest value (k,) on each arc (k,) of a function of points (k, s, 3)."""

    def values(t: Floats) -> Floats:
        return function(cells.arcs.at(np.broadcast_to(arc[:, None], t.shape), t))

    return parabola_minima(samples_about_minima(values, len(arc), ROUNDS))


def _last_in_use(
    cells: Cells, mirror: Ints, edge: Floats, pinhole: Floats, capture: float
) -> Floats:
    """Points (..., 3) on mirrors (...) where light in use ends from the apex toward an edge."""
    apex = cells.surfaces.apex[mirror]
    low, high = np.zeros(mirror.shape), np.ones(mirror.shape)
    for _ in range(BISECTIONS):
        share = (low + high) / 2
        point = _seen_at(cells, mirror, apex + share[..., None] * (edge - apex), pinhole)
        normal = cells.surfaces.gradient(mirror, point)
        used = miss_distances(pinhole, point, normal) <= capture
        low, high = np.where(used, share, low), np.where(used, high, share)
    return _seen_at(cells, mirror, apex + low[..., None] * (edge - apex), pinhole)


def _seen_at(cells: Cells, mirror: Ints, chord: Floats, pinhole: Floats) -> Floats:
    """Points (..., 3) on mirrors (...) that a pinhole sees in line with points of their chords."""
    ray = chord - pinhole
    return pinhole + cells.surfaces.first_reach(mirror, pinhole, ray)[..., None] * ray
