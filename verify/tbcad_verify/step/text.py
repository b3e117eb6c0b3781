"""A STEP file as text (ISO 10303-21), read without any CAD kernel.

What one kernel writes and reads can be wrong both times. Names, spheres, planes and validation
properties are therefore taken from the text.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tbcad_verify.step.part21 import Entities, Enumeration, Typed, Value, read_entities

Row = dict[str, Any]

SURFACES = {"SPHERICAL_SURFACE": "sphere", "PLANE": "plane"}
TRIPLES = ("CARTESIAN_POINT", "DIRECTION")
# Recommended Practices for Geometric and Assembly Validation Properties, CAx-IF, section 4.
PROPERTIES = {
    "volume measure": "volume",
    "surface area measure": "area",
    "centre point": "centroid",
}


def read_text(path: Path) -> Row:
    """Named faces with their spheres and planes, solids by name, and validation properties; mm.

    Raises:
        ValueError: the text is no STEP file, or an entity lacks what its kind must have.
    """
    try:
        table = read_entities(ascii_text(path))
        return {
            "solids": [str(name) for _, (name, *_) in table.of("MANIFOLD_SOLID_BREP")],
            "faces": [_face(table, face) for _, face in table.of("ADVANCED_FACE")],
            "properties": _properties(table),
        }
    except (LookupError, TypeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"broken STEP text ({type(error).__name__}: {error})") from error


def ascii_text(path: Path) -> str:
    """The text of a file: names are ASCII, and the standard writes all other characters so too."""
    return path.read_bytes().decode("ascii")


def _face(table: Entities, face: list[Value]) -> Row:
    name, _, reference, forward = face
    kind, surface = table.name(reference), table.parameters(reference)
    row: Row = {"name": str(name), "kind": SURFACES.get(kind, "other")}
    if row["kind"] == "other":
        return row
    row["forward"] = forward == Enumeration("T")
    place = table.parameters(surface[1])
    row["point"] = _numbers(table, place[1])
    if row["kind"] == "sphere":
        return row | {"radius": _number(surface[2])}
    return row | {"axis": _numbers(table, place[2])}


def _numbers(table: Entities, reference: Value) -> list[float]:
    if (name := table.name(reference)) not in TRIPLES:
        raise ValueError(f"broken STEP text: {name} where a point or direction must be")
    return [_number(value) for value in _items(table.parameters(reference)[1])]


def _number(value: Value) -> float:
    if not isinstance(value, float):
        raise ValueError(f"broken STEP text: {value!r} where a number must be")
    return value


def _items(value: Value) -> Iterable[Value]:
    if not isinstance(value, list):
        raise ValueError(f"broken STEP text: {value!r} where a list must be")
    return value


def _properties(table: Entities) -> Row:
    """Values under every property definition called a geometric validation property."""
    definitions = {
        number
        for number, (name, *_) in table.of("PROPERTY_DEFINITION")
        if name == "geometric validation property"
    }
    properties: Row = {}
    for _, (definition, representation) in table.of("PROPERTY_DEFINITION_REPRESENTATION"):
        if getattr(definition, "number", None) in definitions:
            for reference in _items(table.parameters(representation)[1]):
                key = PROPERTIES.get(str(table.parameters(reference)[0]))
                if key in properties:
                    raise ValueError(f"broken STEP text: {key} is claimed twice")
                if key:
                    properties[key] = _claim(table, reference)
    return properties


def _claim(table: Entities, reference: Value) -> float | list[float]:
    if table.name(reference) == "CARTESIAN_POINT":
        return _numbers(table, reference)
    measure = table.parameters(reference)[1]
    if not isinstance(measure, Typed):
        raise ValueError(f"broken STEP text: {measure!r} where a measure must be")
    return _number(measure.values[0])
