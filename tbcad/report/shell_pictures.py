"""Pictures of the shells, drawn from an export's STL files and mirrors.csv.

Run as a program, `python -m tbcad.report.shell_pictures DIR FILE`: drawing without a screen may
crash the process, so the command starts it as a child.
"""

import csv
import sys
from pathlib import Path

import numpy as np
import pyvista
from scipy.spatial import cKDTree

from tbcad.types import Floats

SIZE = (1600, 800)
ANGLE_DEG = 30.0
# A facet farther from every apex than this many half widths belongs to the casing.
REACH = 3.0


def draw(folder: Path, picture: Path) -> None:
    """Draw both halves: from outside, apart, and up into the mirrors as the cameras look.

    Args:
        folder: an export.
        picture: PNG file to write.
    """
    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2), window_size=SIZE, border=False)
    halves = [_coloured(folder, camera) for camera in "ab"]
    size = float(np.abs(np.asarray(halves[0].bounds)).max())
    views = (
        (0.08, (-1.5, -3.0, 2.0), (0.0, 0.0, 0.05)),
        (0.0, (0.4, -0.9, -2.7), (0.0, 0.0, 0.1)),
    )
    for column, (gap, eye, focus) in enumerate(views):
        plotter.subplot(0, column)
        plotter.set_background("white")
        for half, side in zip(halves, (1, -1), strict=True):
            plotter.add_mesh(
                half.translate((side * gap * size, 0, 0), inplace=False),
                scalars="colour",
                rgb=True,
                smooth_shading=False,
                specular=0.4,
                specular_power=20,
            )
        scaled = (tuple(size * x for x in point) for point in (eye, focus))
        plotter.camera_position = [*scaled, (0.0, 0.0, 1.0)]
        plotter.camera.view_angle = ANGLE_DEG
    plotter.screenshot(picture)
    plotter.close()


def _coloured(folder: Path, camera: str) -> pyvista.PolyData:
    """A half with mirrors in the colour of their polar angle, alternating in brightness."""
    half = pyvista.read(folder / f"shell_{camera}.stl")
    apex, polar, width = _mirrors(folder, camera)
    centre = np.asarray(half.cell_centers().points)
    distance, nearest = cKDTree(apex).query(centre)
    share = (polar - polar.min()) / np.ptp(polar)
    colour = np.column_stack([0.25 + 0.7 * share, 0.5 + 0.25 * share, 0.95 - 0.65 * share])
    colour *= np.where(np.arange(len(apex)) % 3 == 0, 0.85, 1.0)[:, None]
    inward = (np.asarray(half.cell_normals) * centre).sum(axis=1) < 0
    mirror = inward & (distance < REACH * width[nearest])
    half["colour"] = np.where(mirror[:, None], 255 * colour[nearest], 205).astype(np.uint8)
    return half


def _mirrors(folder: Path, camera: str) -> tuple[Floats, Floats, Floats]:
    """Apices (m, 3), polar angles and half widths of one camera's mirrors."""
    with (folder / "mirrors.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["camera"] == camera]
    columns = ("px", "py", "pz", "polar_deg", "size_mm")
    values = np.array([[float(row[name]) for name in columns] for row in rows])
    return values[:, :3], values[:, 3], values[:, 4]


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
