"""What closes a shell behind its mirrors: wall and holes, measured in the STEP file's text.

The back is a spheroid, both of whose semi-axes are the ellipsoid's and one length more. The wall is
its least distance from the spheroid of the same kind through the deepest valley between mirrors:
points of both meridians are compared, not support functions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.record.export import Camera
from tbcad_verify.record.flange_holes import Hole
from tbcad_verify.report.checks import Unknown
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.step.solids_text import holes, round_face
from tbcad_verify.types import Floats

AXIAL_MM = 1e-6  # of the spheroid's centre, axis and semi-axes
HOLE_MM = 1e-6  # of radii and places along an axis
MERIDIAN = 20_000  # points on a quarter of an ellipse
HALVINGS = 60


@dataclass(frozen=True)
class Casing:
    """Back and holes of one shell.

    Attributes:
        semi_axes: of the back along the axis and across it, mm.
        centre: (3,) of the back, mm.
        axis: (3,) unit, of the back.
        valleys: (V, 3) corners of the mirrors and of the walls below them, mm.
        holes: round, by diameter, from the spec.
    """

    semi_axes: tuple[float, float]
    centre: Floats
    axis: Floats
    valleys: Floats
    holes: tuple[Hole, ...]


def read_casing(text: str, mirrors: frozenset[str]) -> Casing:
    """Find the back, the mirrors' corners and all round holes.

    Args:
        text: of the STEP file.
        mirrors: names of the mirrors' faces and of the walls below them.

    Raises:
        Unknown: there is no back, more than one, or no spheroid.
    """
    try:
        table = StepTable(text)
        backs = table.of("SURFACE_OF_REVOLUTION")
        if len(backs) != 1:
            raise Unknown(f"{len(backs)} surfaces of revolution, where the back is one")
        curve, place = table.references(backs[0])[:2]
        if table.kinds[curve] != "ELLIPSE":
            raise Unknown("the back is no spheroid")
        centre, axis = table.placement(place)
        major, minor = table.numbers(curve)[-2:]
        names = _face_names(table)
        reached = table.reached(*(one for one, name in names.items() if name in mirrors))
        corners = [one for one in reached if table.kinds.get(one) == "VERTEX_POINT"]
        valleys = [table.triple(table.references(one)[0]) for one in sorted(corners)]
        bores = _bores(table, names, mirrors)
    except (LookupError, ValueError) as error:
        raise Unknown(f"broken STEP text ({type(error).__name__}: {error})") from error
    return Casing((major, minor), centre, axis, np.array(valleys).reshape(-1, 3), bores)


def read_bores(text: str, mirrors: frozenset[str]) -> tuple[Hole, ...]:
    """All round holes of a solid.

    Args:
        text: of the STEP file.
        mirrors: names of the mirrors' faces and of the walls below them.

    Raises:
        Unknown: the text is broken.
    """
    try:
        table = StepTable(text)
        return _bores(table, _face_names(table), mirrors)
    except (LookupError, ValueError) as error:
        raise Unknown(f"broken STEP text ({type(error).__name__}: {error})") from error


def _face_names(table: StepTable) -> dict[int, str]:
    return {one: table.label(one) for one in table.of("ADVANCED_FACE")}


def _bores(table: StepTable, names: dict[int, str], mirrors: frozenset[str]) -> tuple[Hole, ...]:
    round_faces = [round_face(table, one) for one, name in names.items() if name not in mirrors]
    hollow = tuple(face for face in round_faces if face and face.kind == "cylinder" and face.hollow)
    radii = sorted({round(face.radius, 6) for face in hollow})
    return tuple(hole for radius in radii for hole in holes(hollow, radius, HOLE_MM))


def wall(casing: Casing, camera: Camera, semi_minor: float) -> float:
    """Least material behind the deepest valley, mm.

    Raises:
        Unknown: the back is not the spheroid that belongs to the camera.
    """
    focal = camera.pinhole / 2
    semi_axes = np.array([float(np.hypot(semi_minor, np.linalg.norm(focal))), semi_minor])
    outer = np.array(casing.semi_axes)
    along = abs(float(casing.axis @ focal)) / float(np.linalg.norm(focal))
    beyond = outer - semi_axes
    if max(np.abs(casing.centre - focal).max(), abs(1 - along), abs(np.ptp(beyond))) > AXIAL_MM:
        raise Unknown("the back is another spheroid than the camera's")
    inner = semi_axes + _deepest(casing, semi_axes, float(beyond.max()))
    angle = np.linspace(0, np.pi / 2, MERIDIAN)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    distance = np.asarray(cKDTree(circle * outer).query(circle * inner)[0])
    return float(distance.min())


def _deepest(casing: Casing, semi_axes: Floats, most: float) -> float:
    """By how much a spheroid must be longer than the ellipsoid to hold all valleys, mm."""
    offset = casing.valleys - casing.centre
    along = offset @ casing.axis
    across = np.linalg.norm(offset - along[:, None] * casing.axis, axis=1)
    places = np.column_stack([along, across])
    low, high = -float(semi_axes.min()) / 2, most
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        inside = ((places / (semi_axes + middle)) ** 2).sum(axis=1).max() <= 1
        low, high = (low, middle) if inside else (middle, high)
    return high
