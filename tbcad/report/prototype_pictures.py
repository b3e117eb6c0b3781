"""Pictures of the prototype, drawn from a build's record and assembly.

Run as a program, as `shell_pictures`: `python -m tbcad.report.prototype_pictures DIR SUBJECT FILE`.
"""

import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import pyvista

from tbcad.records.prototype import NAME, Prototype
from tbcad.records.tables import BallRow
from tbcad.report.page.bodies import Body, prototype_bodies
from tbcad.types import Floats, Ints

SIZE = (1600, 800)
ANGLE_DEG = 30.0
UP = (0.0, 0.0, 1.0)
# Where it is seen from, and what points up in the picture. Camera a is toward +x.
SIDES = (
    ("from the camera's side (+x)", (1.0, 0.0, 0.0), UP),
    ("from the right (+y)", (0.0, 1.0, 0.0), UP),
    ("from the left (-y)", (0.0, -1.0, 0.0), UP),
    ("from above (+z)", UP, (0.0, 1.0, 0.0)),
)
SIDES_BORDER = 1.15  # height and width of a picture, in the longest side of all that is drawn
ROWS = {"sides": 2}  # of pictures; one where nothing is said


def draw(folder: Path, subject: str, picture: Path) -> None:
    """Draw one of SUBJECTS of a build with a prototype to a PNG file."""
    rows = ROWS.get(subject, 1)
    size = (SIZE[0], rows * SIZE[1])
    plotter = pyvista.Plotter(off_screen=True, shape=(rows, 2), window_size=size, border=False)
    bodies = [one for one in prototype_bodies(folder) if one.name != "camera_view"]
    SUBJECTS[subject](plotter, folder, bodies)
    plotter.screenshot(picture)
    plotter.close()


def _whole(plotter: pyvista.Plotter, _: Path, bodies: Sequence[Body]) -> None:
    """The whole prototype with purchased parts, from two sides."""
    _from_two_sides(plotter, bodies, ((-0.6, -2.8, 0.9), (2.5, -1.6, 1.0)))


def _sides(plotter: pyvista.Plotter, _: Path, bodies: Sequence[Body]) -> None:
    """The prototype without its shroud from four sides, all to one scale."""
    shown = [body for body in bodies if body.group not in ("views", "shroud")]
    for number, (title, eye, up) in enumerate(SIDES):
        plotter.subplot(*divmod(number, 2))
        _add(plotter, shown)
        plotter.add_text(title, position="upper_edge", color="black", font_size=12)
        plotter.enable_parallel_projection()
        plotter.view_vector(eye, viewup=up)
        plotter.reset_camera()
    longest = np.ptp([np.reshape(one.bounds, (3, 2)) for one in plotter.renderers], axis=2).max()
    for view in plotter.renderers:
        view.camera.parallel_scale = SIDES_BORDER * longest / 2  # half the height of a picture


def _base(plotter: pyvista.Plotter, folder: Path, bodies: Sequence[Body]) -> None:
    """The base with its balls, from the object and from behind."""
    frame = Prototype.read(folder / NAME).frame
    axis, zero, third = map(np.array, (frame.axis, frame.zero, frame.third))
    eyes = axis - zero - 0.4 * third, zero - 0.4 * axis + 0.3 * third
    _from_two_sides(plotter, [one for one in bodies if one.group in ("base", "balls")], eyes)


def _seat(plotter: pyvista.Plotter, folder: Path, bodies: Sequence[Body]) -> None:
    """The seat of the largest purchased ball: empty, and with the ball in it."""
    balls = BallRow.read(folder)
    ball = max(
        [one for one in balls if one.kind == "ball"] or balls, key=lambda one: one.body_radius_mm
    )
    seat = Prototype.read(folder / NAME).seats[ball.number - 1]
    middle = np.array([ball.bx, ball.by, ball.bz])
    axis, radius = np.array(seat.axis), ball.body_radius_mm
    side = np.cross(axis, (0.0, 1.0, 0.3))
    eye = middle - 7 * radius * axis + 2.5 * radius * side / np.linalg.norm(side)
    base = [one for one in bodies if one.group == "base" and not one.name.startswith("cap_")]
    for column in (0, 1):
        plotter.subplot(0, column)
        _add(plotter, base)
        for contact in seat.contacts_mm if column == 0 else ():
            mark = pyvista.Sphere(radius=seat.pad_diameter_mm / 5, center=contact)
            plotter.add_mesh(mark, color="red")
        if column:
            _add(plotter, (one for one in bodies if one.name == f"ball_{ball.number}"))
        plotter.camera_position = [tuple(eye), tuple(middle + 0.3 * radius * axis), UP]
        plotter.camera.view_angle = ANGLE_DEG
        plotter.reset_camera_clipping_range()


def _exploded(plotter: pyvista.Plotter, _: Path, bodies: Sequence[Body]) -> None:
    """All parts but the shroud apart, as the report's page shows them."""
    shown = [
        body._replace(vertices=body.vertices + body.apart)
        for body in bodies
        if body.group not in ("views", "shroud")
    ]
    _from_two_sides(plotter, shown, ((-0.5, -2.6, 0.8), (2.3, -1.5, 1.1)))


SUBJECTS: dict[str, Callable[[pyvista.Plotter, Path, Sequence[Body]], None]] = {
    "rig": _whole,
    "sides": _sides,
    "base": _base,
    "seat": _seat,
    "exploded": _exploded,
}


def surface(vertices: Floats, triangles: Ints) -> pyvista.PolyData:
    """The surface of a body, mm, that is shaded round where its facets are."""
    mesh = pyvista.PolyData(vertices, np.insert(triangles, 0, 3, axis=1).ravel()).clean()
    return mesh.compute_normals(split_vertices=True, feature_angle=30.0)


def _add(plotter: pyvista.Plotter, bodies: Iterable[Body]) -> None:
    plotter.set_background("white")
    for body in bodies:
        plotter.add_mesh(
            surface(body.vertices, body.triangles),
            color=body.colour[:3],
            opacity=float(body.colour[3]),
            specular=0.3,
        )


def _from_two_sides(
    plotter: pyvista.Plotter, bodies: Sequence[Body], eyes: Iterable[Sequence[float] | Floats]
) -> None:
    """Look from two directions at all bodies."""
    for column, eye in enumerate(eyes):
        plotter.subplot(0, column)
        _add(plotter, bodies)
        plotter.view_vector(tuple(eye), viewup=UP)
        plotter.camera.view_angle = ANGLE_DEG
        plotter.reset_camera()


if __name__ == "__main__":
    draw(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
