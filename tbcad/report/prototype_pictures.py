"""Pictures of the prototype, drawn from an export's records, STL files and assembly.

Run as a program, as `shell_pictures`: `python -m tbcad.report.prototype_pictures DIR SUBJECT FILE`.
"""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyvista

from tbcad.cad.formats.glb import read_glb
from tbcad.records.prototype import NAME, PrintedPartRecord, Prototype
from tbcad.records.tables import BallRow
from tbcad.types import Floats


class Drawn(NamedTuple):
    """A body of the assembly: its name, its group, its surface, its colour and opacity."""

    name: str
    group: str
    mesh: pyvista.PolyData
    colour: Floats


SIZE = (1600, 800)
ANGLE_DEG = 30.0
UP = (0.0, 0.0, 1.0)
COLOURS = {"base": "#5b7394", "cap": "#d9b366", "ball": "#c7ccd4"}
# Where it is seen from, and what points up in the picture. Camera a is toward +x.
SIDES = (
    ("from the camera's side (+x)", (1.0, 0.0, 0.0), UP),
    ("from the right (+y)", (0.0, 1.0, 0.0), UP),
    ("from the left (-y)", (0.0, -1.0, 0.0), UP),
    ("from above (+z)", UP, (0.0, 1.0, 0.0)),
)
SIDES_BORDER = 1.15  # height and width of a picture, in the longest side of all that is drawn
ROWS = {"sides": 2}  # of pictures; one where nothing is said
# In the exploded view: static parts are moved away from the object by this share of their
# distance, balls and caps are lifted out of their seats by so many radii of the capture sphere.
APART = 0.7
LIFTED = 1.5


def draw(folder: Path, subject: str, picture: Path) -> None:
    """Draw one of SUBJECTS of an export with a prototype to a PNG file."""
    record = Prototype.read(folder / NAME)
    rows = ROWS.get(subject, 1)
    size = (SIZE[0], rows * SIZE[1])
    plotter = pyvista.Plotter(off_screen=True, shape=(rows, 2), window_size=size, border=False)
    SUBJECTS[subject](plotter, folder, record)
    plotter.screenshot(picture)
    plotter.close()


def _whole(plotter: pyvista.Plotter, folder: Path, record: Prototype) -> None:
    """The whole prototype with purchased parts, from two sides."""
    bodies = assembly_bodies(folder, record)
    for column, eye in enumerate(((-0.6, -2.8, 0.9), (2.5, -1.6, 1.0))):
        plotter.subplot(0, column)
        for body in bodies:
            if body.name != "camera_view":
                _add(plotter, body, np.zeros(3))
        _show_all(plotter, eye)


def _sides(plotter: pyvista.Plotter, folder: Path, record: Prototype) -> None:
    """The prototype without its shroud from four sides, all to one scale."""
    bodies = assembly_bodies(folder, record)
    for number, (title, eye, up) in enumerate(SIDES):
        plotter.subplot(*divmod(number, 2))
        for body in bodies:
            if body.group not in ("views", "shroud") and body.name != "camera_view":
                _add(plotter, body, np.zeros(3))
        plotter.set_background("white")
        plotter.add_text(title, position="upper_edge", color="black", font_size=12)
        plotter.enable_parallel_projection()
        plotter.view_vector(eye, viewup=up)
        plotter.reset_camera()
    longest = np.ptp([np.reshape(one.bounds, (3, 2)) for one in plotter.renderers], axis=2).max()
    for view in plotter.renderers:
        view.camera.parallel_scale = SIDES_BORDER * longest / 2  # half the height of a picture


def _base(plotter: pyvista.Plotter, folder: Path, record: Prototype) -> None:
    """The base with its balls, from the object and from behind."""
    axis, zero, third = map(np.array, (record.frame.axis, record.frame.zero, record.frame.third))
    for column, eye in enumerate((axis - zero - 0.4 * third, zero - 0.4 * axis + 0.3 * third)):
        plotter.subplot(0, column)
        _parts(plotter, folder, record, "base", "cap")
        _add_balls(plotter, folder)
        _show_all(plotter, eye)


def _seat(plotter: pyvista.Plotter, folder: Path, record: Prototype) -> None:
    """The seat of the largest purchased ball: empty, and with the ball in it."""
    balls = BallRow.read(folder)
    ball = max(
        [one for one in balls if one.kind == "ball"] or balls, key=lambda one: one.body_radius_mm
    )
    seat = record.seats[ball.number - 1]
    axis, radius, middle = np.array(seat.axis), ball.body_radius_mm, _centre(ball)
    side = np.cross(axis, (0.0, 1.0, 0.3))
    eye = middle - 7 * radius * axis + 2.5 * radius * side / np.linalg.norm(side)
    for column in (0, 1):
        plotter.subplot(0, column)
        _parts(plotter, folder, record, "base")
        for contact in seat.contacts_mm if column == 0 else ():
            mark = pyvista.Sphere(radius=seat.pad_diameter_mm / 5, center=contact)
            plotter.add_mesh(mark, color="red")
        if column:
            _add_balls(plotter, folder, only=ball.number)
        plotter.set_background("white")
        plotter.camera_position = [tuple(eye), tuple(middle + 0.3 * radius * axis), UP]
        plotter.camera.view_angle = ANGLE_DEG
        plotter.reset_camera_clipping_range()


def _exploded(plotter: pyvista.Plotter, folder: Path, record: Prototype) -> None:
    """All parts apart: balls and caps out of their seats, the rest away from the base."""
    unit = record.target_mm / 2
    seats = {f"ball_{seat.ball}": np.array(seat.axis) for seat in record.seats}
    seats |= {part.name: seats[f"ball_{part.ball}"] for part in record.with_role("cap")}
    bodies = [body for body in assembly_bodies(folder, record) if body.group != "views"]
    for column, eye in enumerate(((-0.5, -2.6, 0.8), (2.3, -1.5, 1.1))):
        plotter.subplot(0, column)
        for body in bodies:
            static = body.group in ("stage", "frame", "bought")
            lift = -LIFTED * unit * seats.get(body.name, np.zeros(3))
            _add(plotter, body, APART * np.array(body.mesh.center) if static else lift)
        _show_all(plotter, eye)


SUBJECTS: dict[str, Callable[[pyvista.Plotter, Path, Prototype], None]] = {
    "rig": _whole,
    "sides": _sides,
    "base": _base,
    "seat": _seat,
    "exploded": _exploded,
}


def _parts(plotter: pyvista.Plotter, folder: Path, record: Prototype, *roles: str) -> None:
    for part in record.with_role(*roles):
        plotter.add_mesh(placed_mesh(folder, part), color=COLOURS[part.role], specular=0.2)


def placed_mesh(folder: Path, part: PrintedPartRecord) -> pyvista.PolyData:
    """A part moved from the printer's bed back to its place in the prototype."""
    mesh = pyvista.read(folder / part.stl)
    axes, origin = np.array(part.axes), np.array(part.origin_mm)
    mesh.points = (np.asarray(mesh.points, dtype=np.float64) - origin) @ axes.T
    return _smooth(mesh)


def _smooth(mesh: pyvista.PolyData) -> pyvista.PolyData:
    return mesh.compute_normals(split_vertices=True, feature_angle=30.0)


def _centre(ball: BallRow) -> Floats:
    """Of the sphere in the seat, mm, (3,)."""
    return np.array([ball.bx, ball.by, ball.bz])


def _add_balls(plotter: pyvista.Plotter, folder: Path, only: int = 0) -> None:
    """Add the bought balls, or the one of this number."""
    for ball in BallRow.read(folder):
        if ball.kind == "ball" and only in (0, ball.number):
            sphere = pyvista.Sphere(
                radius=ball.body_radius_mm,
                center=_centre(ball),
                theta_resolution=48,
                phi_resolution=48,
            )
            plotter.add_mesh(sphere, color=COLOURS["ball"], smooth_shading=True, specular=0.9)


def assembly_bodies(folder: Path, record: Prototype) -> list[Drawn]:
    """All bodies of prototype.glb, in millimetres and z up."""
    drawn = []
    for one in read_glb(folder / record.assembly.glb):
        faces = np.insert(one.mesh.triangles, 0, 3, axis=1)
        surface = _smooth(pyvista.PolyData(one.mesh.vertices, faces.ravel()).clean())
        drawn.append(Drawn(one.name, one.group, surface, np.array(one.colour)))
    return drawn


def _add(plotter: pyvista.Plotter, body: Drawn, moved: Floats) -> None:
    plotter.add_mesh(
        body.mesh.translate(moved, inplace=False),
        color=body.colour[:3],
        opacity=float(body.colour[3]),
        specular=0.3,
    )


def _show_all(plotter: pyvista.Plotter, eye: Sequence[float] | Floats) -> None:
    """Look from a direction at all that is drawn."""
    plotter.set_background("white")
    plotter.view_vector(tuple(eye), viewup=UP)
    plotter.camera.view_angle = ANGLE_DEG
    plotter.reset_camera()


if __name__ == "__main__":
    draw(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
