"""Pictures of the shells, drawn from an export's STL files and mirrors.csv.

Run as a program, `python -m tbcad.report.shell_pictures DIR FILE`: drawing without a screen may
crash the process, so the command starts it as a child.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyvista
from scipy.spatial import cKDTree

from tbcad.cad.formats.checked_files import columns
from tbcad.core.geometry.vectors import dot, unit
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


class ModelledMirrors(NamedTuple):
    """One camera's m mirrors as they are modelled, mm: surface under the coat."""

    apex: Floats
    normal: Floats
    curvature: Floats
    polar: Floats


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
        _show_all(plotter, points, np.array(direction))
    plotter.screenshot(picture)
    plotter.close()


def _show_all(plotter: pyvista.Plotter, points: Floats, direction: Floats) -> None:
    eye, focus = camera_that_shows(points, direction)
    plotter.camera_position = [tuple(eye), tuple(focus), UP]
    plotter.camera.view_angle = ANGLE_DEG
    plotter.reset_camera_clipping_range()


def camera_that_shows(points: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Pinhole and focus (3,) of a camera in whose square picture points (n, 3) just fit.

    A point is in the picture where |across - centre| <= slope (distance + depth), for both axes of
    the picture: the distance follows from the outermost points on either side.

    Args:
        points: to show, mm.
        direction: of the view, (3,).
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
    mirrors = read_modelled(folder, camera)
    corners = np.asarray(shell.points, dtype=np.float64)[shell.regular_faces]
    mirror, on_mirror = mirror_of_facets(corners, mirrors)
    share = (mirrors.polar - mirrors.polar.min()) / np.ptp(mirrors.polar)
    colour = np.column_stack([0.25 + 0.7 * share, 0.5 + 0.25 * share, 0.95 - 0.65 * share])
    colour *= np.where(np.arange(len(colour)) % 3 == 0, 0.85, 1.0)[:, None]
    rgb = np.where(on_mirror[:, None], 255 * colour[mirror], STRUCTURE_GREY)
    shell["colour"] = rgb.astype(np.uint8)
    return shell


def mirror_of_facets(corners: Floats, mirrors: ModelledMirrors) -> tuple[Ints, Bools]:
    """The mirror that each facet (f, 3, 3) is of, and whether it is a mirror's, (f,) each."""
    middle = corners.mean(axis=1)
    facing = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    ranks = range(1, min(TRIED, len(mirrors.apex)) + 1)
    nearest = np.asarray(cKDTree(mirrors.apex).query(middle, k=ranks)[1])
    best = np.zeros(len(corners), dtype=np.int64)
    smallest = np.full(len(corners), np.inf)
    for tried in nearest.T:
        one = ModelledMirrors(*(values[tried] for values in mirrors))
        distance = np.max([np.abs(_height(corners[:, k], one)) for k in range(3)], axis=0)
        distance[dot(facing, _outward(middle, one)) < FACING_COS] = np.inf
        better = distance < smallest
        best[better], smallest[better] = tried[better], distance[better]
    return best, smallest < CORNER_TOLERANCE_MM


def _height(points: Floats, mirrors: ModelledMirrors) -> Floats:
    """Height of points (f, 3) above the surface of a mirror each, mm, to the first order."""
    offset, curved = points - mirrors.apex, mirrors.curvature
    # (|p - centre|^2 - r^2) / 2r, which is the plane's height where the curvature is zero.
    return np.asarray(dot(offset, mirrors.normal) + curved * dot(offset, offset) / 2)


def _outward(points: Floats, mirrors: ModelledMirrors) -> Floats:
    """Unit normals of mirrors at points (f, 3) near them, toward the object."""
    return unit(mirrors.normal + mirrors.curvature[:, None] * (points - mirrors.apex))


def read_modelled(folder: Path, camera: str) -> ModelledMirrors:
    """One camera's mirrors of an export."""
    coat = DesignRecord.read(folder / NAME).coating_mm
    rows = [row for row in MirrorRow.read(folder) if row.camera == camera]
    apex, normal = columns(rows, "px py pz"), columns(rows, "nx ny nz")
    radius = np.array([row.radius_mm or np.inf for row in rows])
    polar = columns(rows, "polar_deg")[:, 0]
    return ModelledMirrors(apex - coat * normal, normal, 1 / (radius - coat), polar)


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
