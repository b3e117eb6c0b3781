"""Solids of a STEP file as its text has them: corners, round faces, and what closes a shell.

References and numbers are searched for in the text of each entity's parameters, which are not
parsed. The back of a shell is a spheroid, both of whose semi-axes are the ellipsoid's and one
length more. The wall is its least distance from the spheroid of the same kind through the deepest
valley between mirrors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.spheroids import growth, least_wall
from tbcad_verify.record.export import Camera
from tbcad_verify.record.flange_holes import Hole
from tbcad_verify.report.checks import Unknown
from tbcad_verify.run.kept import kept
from tbcad_verify.step.grammar import refuse_foreign
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.types import Floats

UNMOVED = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
SAME_LINE_MM = 1e-6  # of axes of one hole
PARALLEL = 1e-9
ROUND = {"CYLINDRICAL_SURFACE": "cylinder", "SPHERICAL_SURFACE": "sphere"}
AXIAL_MM = 1e-6  # of the spheroid's centre, axis and semi-axes
HOLE_MM = 1e-6  # of radii and places along an axis


@dataclass(frozen=True)
class RoundFace:
    """A cylinder's or sphere's face."""

    kind: str  # "cylinder" or "sphere"
    point: Floats  # (3,) mm, on the axis or the centre
    axis: Floats  # (3,) unit
    radius: float  # mm
    hollow: bool  # whether the material is outside
    # first and last place of its corners along the axis, from `point`, mm
    span: tuple[float, float]


@dataclass(frozen=True)
class TextSolid:
    """One solid."""

    corners: Floats  # (V, 3) mm, sorted
    faces: tuple[RoundFace, ...]  # the round ones
    colour: tuple[float, ...] = ()  # red, green, blue (sRGB) and opacity, 0 to 1; empty: none


@kept("text of STEP files")
def read_solids(text: str) -> dict[str, TextSolid]:
    """Solids by the name of their product, where the file itself puts them.

    Unknown: a solid is moved by the assembly, has no product, or two have the same name.
    """
    try:
        table = StepTable(text)
        refuse_foreign(table)
        _refuse_moved(table)
        solids = [
            (table.product(table.references(shape)[-1]), solid)
            for shape, representation in map(
                table.references, table.of("SHAPE_DEFINITION_REPRESENTATION")
            )
            if table.kinds[shape] == "PRODUCT_DEFINITION_SHAPE"
            for solid in table.references(representation)
            if table.kinds.get(solid) == "MANIFOLD_SOLID_BREP"
        ]
        if len(solids) != len(table.of("MANIFOLD_SOLID_BREP")):
            raise Unknown("a solid is no product's, or of several")
        names = [name for name, _ in solids]
        if len(set(names)) != len(names):
            raise Unknown("two solids have the same name")
        colours = dict(_colours(table))
        return {name: _solid(table, solid, colours.get(solid, ())) for name, solid in solids}
    except (LookupError, ValueError) as error:
        raise Unknown(f"broken STEP text ({type(error).__name__}: {error})") from error


def holes(faces: tuple[RoundFace, ...], radius: float, tolerance: float) -> list[Hole]:
    """Round holes of a radius, each once: coaxial hollow faces that follow each other.

    `radius`: mm.
    `tolerance`: of it, mm.
    """
    some = [
        face
        for face in faces
        if face.kind == "cylinder" and face.hollow and abs(face.radius - radius) <= tolerance
    ]
    round_holes: list[Hole] = []
    for line in _lines(some):
        first = line[0]
        spans = sorted(_span_on(first, face) for face in line)
        start, end = spans[0]
        for low, high in [*spans[1:], (np.inf, np.inf)]:
            if low > end + SAME_LINE_MM:
                middle = first.point + (start + end) / 2 * first.axis
                round_holes.append(Hole(middle, first.axis, first.radius, end - start))
                start, end = low, high
            end = max(end, high)
    return round_holes


def _lines(faces: list[RoundFace]) -> list[list[RoundFace]]:
    """Faces by their axis."""
    lines: list[list[RoundFace]] = []
    for face in faces:
        for line in lines:
            if _is_on(line[0], face):
                line.append(face)
                break
        else:
            lines.append([face])
    return lines


def _is_on(one: RoundFace, two: RoundFace) -> bool:
    parallel = cross_length(one.axis, two.axis) <= PARALLEL
    return parallel and distance_to_line(two.point, one.point, one.axis) <= SAME_LINE_MM


def distance_to_line(point: Floats, start: Floats, axis: Floats) -> float:
    """Distance of a point (3,) from a line through another along a unit axis, mm."""
    return cross_length(point - start, axis)


def cross_length(one: Floats, other: Floats) -> float:
    """Length of the cross product of two vectors (3,); numpy's takes twenty times as long."""
    (x, y, z), (a, b, c) = one.tolist(), other.tolist()
    return math.hypot(y * c - z * b, z * a - x * c, x * b - y * a)


def _span_on(first: RoundFace, face: RoundFace) -> tuple[float, float]:
    """The span of a face along the axis of another that is coaxial."""
    shift, sign = (face.point - first.point) @ first.axis, np.sign(face.axis @ first.axis)
    ends = [float(shift + sign * end) for end in face.span]
    return min(ends), max(ends)


def _refuse_moved(table: StepTable) -> None:
    for move in table.of("ITEM_DEFINED_TRANSFORMATION"):
        for place in table.references(move):
            triples = [table.triple(one) for one in table.references(place)]
            if not np.array_equal(np.array(triples) + 0.0, np.array(UNMOVED)):
                raise Unknown("the assembly moves a part")


def _colours(table: StepTable) -> Iterator[tuple[int, tuple[float, ...]]]:
    """Each styled solid, and its colour and opacity."""
    for item in table.of("STYLED_ITEM"):
        style, solid = table.references(item)
        kinds = {table.kinds[one]: table.numbers(one) for one in table.reached(style)}
        (clear,) = kinds.get("SURFACE_STYLE_TRANSPARENT", [0.0])
        yield solid, (*kinds["COLOUR_RGB"], 1 - clear)


def _solid(table: StepTable, solid: int, colour: tuple[float, ...]) -> TextSolid:
    every = [face for shell in table.references(solid) for face in table.references(shell)]
    vertices = {one for face in every for one in table.vertices(face)}
    points = [table.triple(table.references(one)[0]) for one in vertices]
    corners = np.array(points).reshape(-1, 3)
    faces = [round_face(table, one) for one in reversed(every)]
    order = np.lexsort(corners.T[::-1])
    return TextSolid(corners[order], tuple(face for face in faces if face), colour)


def round_face(table: StepTable, face: int) -> RoundFace | None:
    """A face, by its number, if it is a cylinder's or sphere's."""
    surface = table.references(face)[-1]
    kind = ROUND.get(table.kinds[surface])
    if kind is None:
        return None
    point, axis = table.placement(table.references(surface)[0])
    ends = np.array([table.triple(table.references(one)[0]) for one in table.vertices(face)])
    places = ((ends - point) @ axis).tolist()
    radius = table.numbers(surface)[-1]
    return RoundFace(kind, point, axis, radius, not table.forward(face), (min(places), max(places)))


@dataclass(frozen=True)
class Casing:
    """The back of one shell."""

    semi_axes: tuple[float, float]  # of the back along the axis and across it, mm
    centre: Floats  # (3,) of the back, mm
    axis: Floats  # (3,) unit, of the back
    valleys: Floats  # (V, 3) corners of the mirrors and of the walls below them, mm


def read_casing(table: StepTable, mirrors: frozenset[str]) -> Casing:
    """Find the back and the mirrors' corners.

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
    return Casing((major, minor), *table.placement(place), at)


def bores(table: StepTable, mirrors: frozenset[str]) -> tuple[Hole, ...]:
    """All round holes of a solid, but in faces of mirrors and of the walls below them."""
    others = [one for one in table.of("ADVANCED_FACE") if table.label(one) not in mirrors]
    round_faces = [face for face in (round_face(table, one) for one in others) if face]
    hollow = tuple(face for face in round_faces if face.kind == "cylinder" and face.hollow)
    radii = sorted({round(face.radius, 6) for face in hollow})
    return tuple(hole for radius in radii for hole in holes(hollow, radius, HOLE_MM))


def wall(casing: Casing, camera: Camera, semi_minor: float) -> float:
    """Least material behind the deepest valley, mm.

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
