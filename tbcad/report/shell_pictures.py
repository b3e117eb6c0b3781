"""Pictures and sections of the shells, from a build's STL files and mirrors.csv.

Run as a program, `python -m tbcad.report.shell_pictures DIR shell FILE`: drawing without a screen
may crash the process, so the command starts it as a child.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyvista
from scipy.spatial import cKDTree

from tbcad.cad.formats.checked_files import columns
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.pedestals.cells import PedestalCells
from tbcad.core.optics.surfaces import Surfaces
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.records.design import NAME, DesignRecord
from tbcad.records.tables import MirrorRow
from tbcad.types import Bools, Floats, Ints

SIZE = (1600, 800)
ANGLE_DEG = 30.0
UP = (0.0, 0.0, 1.0)
# Gap between the shells, in largest coordinates, and the direction of view, of both pictures.
VIEWS = ((0.08, (1.5, 3.0, -1.95)), (0.0, (-0.4, 0.9, 2.8)))
FRAME_MARGIN = 1.04  # the picture is larger than what it shows by this factor
STRUCTURE_GREY = 205
# A facet is a mirror's when its corners lie on the mirror and it faces as the mirror does there.
# Several mirrors are tried, those with the nearest apices: cells of different radius are not those
# of the nearest apex.
CORNER_TOLERANCE_MM = 0.01
FACING_COS = 0.9
TRIED = 8
ON_MIRROR_MM = 0.005  # facets are nearer than this to the spheres
SAME_MM = 0.02  # rims nearer than this are one edge
ROUNDS = 20
BEYOND = 0.35  # shown beyond the outer apices, of the distance of apices


def draw(folder: Path, picture: Path) -> None:
    """Draw both shells: from outside, apart, and up into the mirrors as the cameras look."""
    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2), window_size=SIZE, border=False)
    shells = [coloured(folder, camera) for camera in "ab"]
    size = float(np.abs(np.asarray(shells[0].bounds)).max())
    for column, (gap, direction) in enumerate(VIEWS):
        plotter.subplot(0, column)
        plotter.set_background("white")
        shift = np.array([gap * size, 0.0, 0.0])
        placed = [
            shell.translate(side * shift) for shell, side in zip(shells, (1, -1), strict=True)
        ]
        for shell in placed:
            plotter.add_mesh(
                shell,
                scalars="colour",
                rgb=True,
                smooth_shading=False,
                specular=0.4,
                specular_power=20,
            )
        points = np.concatenate([np.asarray(array.points) for array in placed])
        eye, focus = camera_that_shows(points, np.array(direction))
        plotter.camera_position = [tuple(eye), tuple(focus), UP]
        plotter.camera.view_angle = ANGLE_DEG
        plotter.reset_camera_clipping_range()
    plotter.screenshot(picture)
    plotter.close()


def camera_that_shows(points: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Pinhole and focus (3,) of a camera in whose square picture points (n, 3), mm, just fit.

    A point is in the picture where |across - centre| <= slope (distance + depth), for both axes of
    the picture: the distance follows from the outermost points on either side of a direction (3,).
    """
    forward = unit(direction)
    right = unit(np.cross(forward, UP))
    axes = np.stack([right, np.cross(right, forward)])
    slope = np.tan(np.radians(ANGLE_DEG / 2)) / FRAME_MARGIN
    across, depth = points @ axes.T, slope * (points @ forward)[:, None]
    high, low = (across - depth).max(axis=0), (across + depth).min(axis=0)
    distance = float((high - low).max() / (2 * slope))
    focus = (high + low) / 2 @ axes
    return focus - distance * forward, focus


def coloured(folder: Path, camera: str) -> pyvista.PolyData:
    """A shell with mirrors in the colour of their polar angle, alternating in brightness."""
    shell = pyvista.read(folder / f"shell_{camera}.stl")
    mirrors, polar = read_modelled(folder, camera)
    corners = np.asarray(shell.points, dtype=np.float64)[shell.regular_faces]
    mirror, on_mirror = mirror_of_facets(corners, mirrors)
    share = (polar - polar.min()) / np.ptp(polar)
    colour = np.column_stack([0.25 + 0.7 * share, 0.5 + 0.25 * share, 0.95 - 0.65 * share])
    colour *= np.where(np.arange(len(colour)) % 3 == 0, 0.85, 1.0)[:, None]
    rgb = np.where(on_mirror[:, None], 255 * colour[mirror], STRUCTURE_GREY)
    shell["colour"] = rgb.astype(np.uint8)
    return shell


def mirror_of_facets(corners: Floats, mirrors: Surfaces) -> tuple[Ints, Bools]:
    """The mirror that each facet (f, 3, 3) is of, and whether it is a mirror's, (f,) each."""
    middle = corners.mean(axis=1)
    facing = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    ranks = range(1, min(TRIED, len(mirrors)) + 1)
    nearest = np.asarray(cKDTree(mirrors.apex).query(middle, k=ranks)[1])
    best = np.zeros(len(corners), dtype=np.int64)
    smallest = np.full(len(corners), np.inf)
    for tried in nearest.T:
        # Values are heights to the first order, (|p - centre|^2 - r^2) / 2r.
        distance = np.abs(mirrors.value(tried[:, None], corners)).max(axis=1)
        distance[dot(facing, unit(mirrors.gradient(tried, middle))) < FACING_COS] = np.inf
        better = distance < smallest
        best[better], smallest[better] = tried[better], distance[better]
    return best, smallest < CORNER_TOLERANCE_MM


def read_modelled(folder: Path, camera: str) -> tuple[Surfaces, Floats]:
    """One camera's m mirrors as they are modelled, under the coat; polar angles, degrees, (m,)."""
    coat = DesignRecord.read(folder / NAME).coating_mm
    rows = [row for row in MirrorRow.read(folder) if row.camera == camera]
    curvature = np.array([1 / row.radius_mm if row.radius_mm else 0.0 for row in rows])
    coated = Surfaces(columns(rows, "px py pz"), columns(rows, "nx ny nz"), curvature)
    return coated.offset(-coat), columns(rows, "polar_deg")[:, 0]


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
    spheres, outer = reflector.mirrors.subset(np.array(mirrors)), outline @ frame + apex[middle]
    height = norm(outer[None] - spheres.centre[:, None]) - spheres.radius[:, None]
    on = np.abs(height) < ON_MIRROR_MM
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


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[3]))
