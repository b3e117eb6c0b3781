"""Whether one STEP file holds the mirror image of another in the plane x = 0, by their texts.

What the kernel measures of a solid holds for its mirror image, reflected. Both files must have the
same statements under the same numbers; every number, sense and reference must be the other's to the
last bit, as the reflection changes it. One that differs, or a kind of geometry without a rule here,
and the file is no mirror image: the kernel reads it by itself.

A reflection R turns cross products over. A curve keeps its parameter if R moves its points: the
axis n of a circle of first radius d becomes -R n, for its second radius is n x d. Planes, round
surfaces and surfaces of revolution keep the sides of their normals; an extrusion's is one cross
product, and changes sides. Loops lead the other way round.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any

import numpy as np

from tbcad_verify.step.part21 import TEXT, Entities, read_entities
from tbcad_verify.types import Floats

Row = dict[str, Any]
Texts = dict[int, tuple[str, str]]

REFERENCE = re.compile(r"#(\d+)")
LABEL = re.compile(TEXT)
NAME = re.compile(r"\b[A-Z]\w*+(?=\()")
DIGITS = re.compile(r"[-+.\dE\s,]*+")
STATEMENT = re.compile(rf"(?:[^';]++|{TEXT})*+;")
IMAGE, AXIAL, STILL = (-1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (1.0, 1.0, 1.0)
TURNING = frozenset(("CIRCLE", "ELLIPSE"))
PLACED = frozenset(
    (
        *("PLANE", "SPHERICAL_SURFACE", "CYLINDRICAL_SURFACE", "CONICAL_SURFACE"),
        "TOROIDAL_SURFACE",
    )
)
EXTRUSION = "SURFACE_OF_LINEAR_EXTRUSION"
TRIPLES = frozenset(("CARTESIAN_POINT", "DIRECTION"))
DIRECTED = frozenset(("VECTOR", "AXIS1_PLACEMENT"))
PLACEMENT, LOOP, FACE = "AXIS2_PLACEMENT_3D", "EDGE_LOOP", "ADVANCED_FACE"
TURNED_OVER = "ORIENTED_EDGE"
LABELLED = frozenset((FACE, "MANIFOLD_SOLID_BREP", "PRODUCT"))  # no kernel reads their names
SAME = frozenset(
    (
        *(*TURNING, *PLACED, *DIRECTED, PLACEMENT, EXTRUSION, "SURFACE_OF_REVOLUTION", "LINE"),
        *("B_SPLINE_CURVE_WITH_KNOTS", "VERTEX_POINT", "EDGE_CURVE", "FACE_BOUND"),
        *("FACE_OUTER_BOUND", "CLOSED_SHELL", "ADVANCED_BREP_SHAPE_REPRESENTATION"),
        *("APPLICATION_PROTOCOL_DEFINITION", "APPLICATION_CONTEXT", "PRODUCT_CONTEXT"),
        *("PRODUCT_DEFINITION", "PRODUCT_DEFINITION_CONTEXT", "PRODUCT_DEFINITION_FORMATION"),
        *("PRODUCT_DEFINITION_SHAPE", "PRODUCT_RELATED_PRODUCT_CATEGORY", "SHAPE_ASPECT"),
        *("SHAPE_DEFINITION_REPRESENTATION", "SHAPE_REPRESENTATION", "REPRESENTATION"),
        *("PROPERTY_DEFINITION", "PROPERTY_DEFINITION_REPRESENTATION", "DERIVED_UNIT"),
        *("DERIVED_UNIT_ELEMENT", "MEASURE_REPRESENTATION_ITEM"),
        "UNCERTAINTY_MEASURE_WITH_UNIT",
    )
)
UNITS = frozenset(
    (
        *("GEOMETRIC_REPRESENTATION_CONTEXT", "GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT"),
        *("GLOBAL_UNIT_ASSIGNED_CONTEXT", "REPRESENTATION_CONTEXT", "NAMED_UNIT", "SI_UNIT"),
        *("LENGTH_UNIT", "PLANE_ANGLE_UNIT", "SOLID_ANGLE_UNIT"),
    )
)


def is_mirror_image(one: str, other: str) -> bool:
    """Whether the text of a file is that of another's mirror image, but for names.

    Also false where either is no readable STEP text.
    """
    try:
        tables = read_entities(one), read_entities(other)
        return _same_frame(*tables) and _reflected(tables[0].texts, tables[1].texts)
    except (LookupError, ValueError):
        return False


def _same_frame(one: Entities, other: Entities) -> bool:
    """Header and units are the same."""
    headers = [_unnamed(table.header) for table in (one, other)]
    units = [{n: _packed(text) for n, text in table.units.items()} for table in (one, other)]
    known = UNITS.issuperset(chain(*(NAME.findall(text) for text in units[0].values())))
    return headers[0] == headers[1] and units[0] == units[1] and known


def _reflected(one: Texts, other: Texts) -> bool:
    if {n: kind for n, (kind, _) in one.items()} != {n: kind for n, (kind, _) in other.items()}:
        return False
    triples = [n for n, (kind, _) in one.items() if kind in TRIPLES]
    rest = (n for n, (kind, _) in one.items() if kind not in TRIPLES)
    signs = _signs(one)
    factors = np.array([signs.get(n, IMAGE) for n in triples]).reshape(-1, 3)
    return all(_same_statement(one, n, other[n][1]) for n in rest) and np.array_equal(
        _numbers(one[n][1] for n in triples) * factors, _numbers(other[n][1] for n in triples)
    )


def _same_statement(one: Texts, number: int, image: str) -> bool:
    """Whether a statement other than a point's or direction's is reflected in a text."""
    kind, text = one[number]
    if kind in LABELLED:
        text, image = (LABEL.sub("", some) for some in (text, image))
    if kind == LOOP:
        found = REFERENCE.findall(image)
        return REFERENCE.findall(text) == found[::-1] and _unlinked(text) == _unlinked(image)
    if kind == TURNED_OVER or (kind == FACE and one[_references(text)[-1]][0] == EXTRUSION):
        return _other_sense(_packed(text)) == _packed(image)
    known = kind in SAME or kind in LABELLED
    return known and (text == image or _packed(text) == _packed(image))


def _signs(one: Texts) -> dict[int, tuple[float, float, float]]:
    """By what the components of each direction that has a part in a cross product are multiplied.

    Raises:
        ValueError: one direction has several parts.
    """
    signs: dict[int, tuple[float, float, float]] = {}
    for direction, sign in _parts(one):
        if signs.setdefault(direction, sign) != sign:
            raise ValueError("a direction with several parts")
    return signs


def _parts(one: Texts) -> Iterator[tuple[int, tuple[float, float, float]]]:
    """Every use of a direction, and its signs there."""
    places = [
        (_references(text)[0], kind) for kind, text in one.values() if kind in TURNING | PLACED
    ]
    owners = dict(places)
    if len(owners) < len(places):
        raise ValueError("a placement of several curves or surfaces")
    for number, (kind, text) in one.items():
        if kind in DIRECTED:
            yield from ((reference, IMAGE) for reference in _references(text))
        elif kind == PLACEMENT:
            owner, (_, axis, first) = owners.get(number), _references(text)
            yield axis, STILL if owner is None else AXIAL if owner in TURNING else IMAGE
            yield first, STILL if owner is None else IMAGE


def _numbers(texts: Iterable[str]) -> Floats:
    """(N, 3) of points and directions."""
    inside = [text.partition("(")[2].rstrip()[:-1] for text in texts]
    rows = [text.split(",") for text in inside]
    if any(len(row) != 3 for row in rows) or not DIGITS.fullmatch(",".join(inside)):
        raise ValueError("no point or direction of three numbers")
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _references(text: str) -> list[int]:
    return [int(digits) for digits in REFERENCE.findall(text)]


def _unnamed(header: str) -> list[str]:
    """Statements of a header but for the file's name and date."""
    statements = map(_packed, STATEMENT.findall(header))
    return [text for text in statements if not text.startswith("FILE_NAME(")]


def _unlinked(text: str) -> str:
    return REFERENCE.sub("#", _packed(text))


def _packed(text: str) -> str:
    """Without blanks and ends of lines, which mean nothing."""
    return "".join(text.split())


def _other_sense(text: str) -> str:
    """A sense, true or false, is the last parameter."""
    return text[:-3] + {".T.": ".F.", ".F.": ".T."}[text[-3:]]


def flipped_solid(solid: Row) -> Row:
    """What the kernel would read of the mirror image of what it has read."""
    low, high = solid["box"]
    return solid | {
        "centroid": _flipped(solid["centroid"]),
        "box": [[-high[0], *low[1:]], [-low[0], *high[1:]]],
        "faces": [_flipped_face(row) for row in solid["faces"]],
    }


def _flipped_face(row: Row) -> Row:
    vectors = ("centroid", "point", "axis", "normal")
    return row | {key: _flipped(row[key]) for key in vectors if key in row}


def _flipped(vector: list[float]) -> list[float]:
    return [-vector[0], *vector[1:]]
