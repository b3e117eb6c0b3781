"""A section through three mirrors of an export: its facets, cut by a plane through the pinhole."""

from dataclasses import dataclass

import numpy as np
import pyvista

from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.surfaces import Surfaces
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.types import Bools, Floats, Ints

ON_MIRROR_MM = 0.005  # facets are nearer than this to the spheres
SAME_MM = 0.02  # rims nearer than this are one edge
ROUNDS = 20
BEYOND = 0.35  # shown beyond the outer apices, of the distance of apices


@dataclass(frozen=True)
class Edge:
    """Where a section passes from one mirror to the next."""

    bottom: Floats  # lowest point, mm, (2,)
    depth: float  # of it below the line over the crests of both mirrors, mm
    words: str  # its shape


@dataclass(frozen=True)
class EdgeSection:
    """A section in its own plane: along it, and up toward the light."""

    mirrors: tuple[int, int, int]  # numbers of the three, from 0
    points: Floats  # of the outline, from one side to the other, mm, (p, 2)
    apexes: Floats  # of the mirrors, mm, (3, 2)
    edges: tuple[Edge, Edge]  # between them


def section_of(export: ExportedDesign, middle: int) -> EdgeSection:
    """The section of camera a's shell through a mirror and two opposite neighbours."""
    reflector = export.reflectors[0]
    first, last = _opposite_neighbours(reflector, middle)
    mirrors = (first, middle, last)
    apex, pinhole = reflector.mirrors.apex, reflector.camera.pinhole
    along = unit(apex[last] - apex[first])
    across = unit(np.cross(along, pinhole - apex[middle]))
    frame = np.stack([along, np.cross(across, along)])
    cut = pyvista.read(export.folder / "shell_a.stl").slice(across, origin=apex[middle])
    place = np.asarray(cut.points, dtype=np.float64) - apex[middle]
    apexes = (apex[list(mirrors)] - apex[middle]) @ frame.T
    reach = (1 + BEYOND) * np.abs(apexes[:, 0]).max()
    lines = np.asarray(cut.lines).reshape(-1, 3)[:, 1:]
    start = int(np.linalg.norm(place, axis=1).argmin())
    outline = _path(place @ frame.T, lines, start, reach)
    on = [
        _on_sphere(outline @ frame, reflector.mirrors.subset(np.array([k])), apex[middle])
        for k in mirrors
    ]
    edges = [_edge(outline, apexes[k : k + 2], on[k], on[k + 1]) for k in (0, 1)]
    return EdgeSection(mirrors, outline, apexes, (edges[0], edges[1]))


def _path(points: Floats, lines: Ints, start: int, reach: float) -> Floats:
    """Points (p, 2) along lines (e, 2) from one that is given, as far as they are within reach."""
    near: dict[int, list[int]] = {}
    for a, b in lines.tolist():
        near.setdefault(a, []).append(b)
        near.setdefault(b, []).append(a)
    sides = []
    for first in near[start]:
        before, at, path = start, first, []
        while abs(points[at, 0]) < reach and at != start:
            path.append(at)
            before, at = at, next(one for one in near[at] if one != before)
        sides.append(path)
    whole = [*sides[0][::-1], start, *sides[1]]
    ordered = points[whole]
    return ordered if ordered[0, 0] < ordered[-1, 0] else ordered[::-1]


def _on_sphere(place: Floats, sphere: Surfaces, origin: Floats) -> Bools:
    """Which points (p, 3) from an origin are on a sphere."""
    off = np.linalg.norm(place + origin - sphere.centre, axis=1) - sphere.radius
    return np.asarray(np.abs(off) < ON_MIRROR_MM)


def _opposite_neighbours(reflector: Reflector, mirror: int) -> tuple[int, int]:
    """The two neighbours of a mirror that are most opposite to each other."""
    cells = reflector.cells
    faces = cells.walls if isinstance(cells, PedestalCells) else cells.arcs.faces
    pairs = faces[(faces == mirror).any(axis=1)]
    near = np.setdiff1d(pairs[(pairs < len(reflector)).all(axis=1)], [mirror])
    way = unit(reflector.mirrors.apex[near] - reflector.mirrors.apex[mirror])
    first, last = np.unravel_index((way @ way.T).argmin(), (len(near), len(near)))
    a, b = sorted((int(near[first]), int(near[last])))
    return a, b


def _edge(outline: Floats, apexes: Floats, on_left: Bools, on_right: Bools) -> Edge:
    number = np.arange(len(outline))
    ends = [np.linalg.norm(outline - apex, axis=1).argmin() for apex in apexes]
    between = number[ends[0] : ends[1]]
    lowest = int(between[outline[between, 1].argmin()])
    left = outline[number[on_left & (number <= lowest)].max()]
    right = outline[number[on_right & (number >= lowest)].min()]
    bottom = outline[lowest]
    return Edge(bottom, _depth(outline, apexes, lowest), _words(outline, left, right, lowest))


def _depth(outline: Floats, apexes: Floats, lowest: int) -> float:
    """Depth of a point below the line that touches both mirrors, mm."""
    bottom, slope = outline[lowest], 0.0
    near = [
        side[np.abs(side[:, 0] - apex[0]) < np.ptp(apexes[:, 0]) / 2]
        for side, apex in zip((outline[:lowest], outline[lowest + 1 :]), apexes, strict=True)
    ]
    for _ in range(ROUNDS):  # the line's slope follows from the points that it touches
        left, right = (side[(side[:, 1] - slope * side[:, 0]).argmax()] for side in near)
        slope = float((right[1] - left[1]) / (right[0] - left[0]))
    line = left[1] + slope * (bottom[0] - left[0])
    return float((line - bottom[1]) / np.hypot(1, slope))


def _words(outline: Floats, left: Floats, right: Floats, lowest: int) -> str:
    """Width and depth of a groove between two rims, or the opening of a valley."""
    width, bottom = float(np.linalg.norm(right - left)), outline[lowest]
    if width > SAME_MM:
        depth = min(left[1], right[1]) - bottom[1]
        return f"groove {width:.2f} mm wide,\n{depth:.2f} mm deep"
    ways = outline[[lowest - 1, lowest + 1]] - bottom
    steep = np.arctan2(ways[:, 1], np.abs(ways[:, 0]))
    return f"opening {180 - np.degrees(steep.sum()):.0f}°"
