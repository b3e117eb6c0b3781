"""What closes a shell behind its mirrors: wall and holes, measured in the STEP file's text.

The back is a spheroid, both of whose semi-axes are the ellipsoid's and one length more. The wall is
its least distance from the spheroid of the same kind through the deepest valley between mirrors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.spheroids import growth, least_wall
from tbcad_verify.record.export import Camera
from tbcad_verify.record.flange_holes import Hole
from tbcad_verify.report.checks import Unknown
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.step.solids_text import holes, round_face
from tbcad_verify.types import Floats

AXIAL_MM = 1e-6  # of the spheroid's centre, axis and semi-axes
HOLE_MM = 1e-6  # of radii and places along an axis


@dataclass(frozen=True)
class Casing:
    """Back and holes of one shell."""

    semi_axes: tuple[float, float]  # of the back along the axis and across it, mm
    centre: Floats  # (3,) of the back, mm
    axis: Floats  # (3,) unit, of the back
    valleys: Floats  # (V, 3) corners of the mirrors and of the walls below them, mm
    holes: tuple[Hole, ...]  # round, by diameter, from the spec


def read_casing(table: StepTable, mirrors: frozenset[str]) -> Casing:
    """Find the back, the mirrors' corners and all round holes.

    Args:
        table: of the STEP file.
        mirrors: names of the mirrors' faces and of the walls below them.

    Raises:
        Unknown: there is no back, more than one, or no spheroid.
    """
    backs = table.of("SURFACE_OF_REVOLUTION")
    if len(backs) != 1:
        raise Unknown(f"{len(backs)} surfaces of revolution, where the back is one")
    curve, place = table.references(backs[0])[:2]
    if table.kinds[curve] != "ELLIPSE":
        raise Unknown("the back is no spheroid")
    major, minor = table.numbers(curve)[-2:]
    faces = [one for one in table.of("ADVANCED_FACE") if table.label(one) in mirrors]
    corners = [one for one in table.reached(*faces) if table.kinds.get(one) == "VERTEX_POINT"]
    valleys = [table.triple(table.references(one)[0]) for one in sorted(corners)]
    at = np.array(valleys).reshape(-1, 3)
    return Casing((major, minor), *table.placement(place), at, bores(table, mirrors))


def bores(table: StepTable, mirrors: frozenset[str]) -> tuple[Hole, ...]:
    """All round holes of a solid, but in faces of mirrors and of the walls below them."""
    others = [one for one in table.of("ADVANCED_FACE") if table.label(one) not in mirrors]
    round_faces = [face for face in (round_face(table, one) for one in others) if face]
    hollow = tuple(face for face in round_faces if face.kind == "cylinder" and face.hollow)
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
    deepest = float(growth(semi_axes, camera, casing.valleys.T).max())
    return least_wall(semi_axes, deepest, float(beyond.max()))
