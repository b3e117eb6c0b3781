"""A STEP file as text (ISO 10303-21), read without any CAD kernel.

What one kernel writes and reads can be wrong both times. Names, spheres, planes and validation
properties are therefore taken from the text.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from steputils import p21

Row = dict[str, Any]
Entities = Mapping[str, Any]

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
        table = _entities(p21.readfile(str(path)))
        return {
            "solids": [str(item.params[0]) for item in _of(table, "MANIFOLD_SOLID_BREP")],
            "faces": [_face(table, item) for item in _of(table, "ADVANCED_FACE")],
            "properties": _properties(table),
        }
    except (p21.ParseError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(f"broken STEP text ({type(error).__name__}: {error})") from error


def _entities(file: Any) -> dict[str, Any]:
    """Simple entities by their number; complex ones carry units only."""
    return {
        reference: instance.entity
        for section in file.data
        for reference, instance in section.instances.items()
        if hasattr(instance, "entity")
    }


def _of(table: Entities, kind: str) -> Iterator[Any]:
    return (item for item in table.values() if item.name == kind)


def _face(table: Entities, face: Any) -> Row:
    surface = table[face.params[2]]
    row: Row = {"name": str(face.params[0]), "kind": SURFACES.get(surface.name, "other")}
    if row["kind"] == "other":
        return row
    row["forward"] = face.params[3] == ".T."
    place = table[surface.params[1]]
    row["point"] = _numbers(table[place.params[1]])
    if row["kind"] == "sphere":
        return row | {"radius": float(surface.params[2])}
    return row | {"axis": _numbers(table[place.params[2]])}


def _numbers(entity: Any) -> list[float]:
    if entity.name not in TRIPLES:
        raise ValueError(f"broken STEP text: {entity.name} where a point or direction must be")
    return [float(value) for value in entity.params[1]]


def _properties(table: Entities) -> Row:
    """Values under every property definition called a geometric validation property."""
    definitions = {
        reference
        for reference, item in table.items()
        if item.name == "PROPERTY_DEFINITION" and item.params[0] == "geometric validation property"
    }
    properties: Row = {}
    for link in _of(table, "PROPERTY_DEFINITION_REPRESENTATION"):
        if link.params[0] in definitions:
            for item in (table[reference] for reference in table[link.params[1]].params[1]):
                key = PROPERTIES.get(str(item.params[0]))
                if key in properties:
                    raise ValueError(f"broken STEP text: {key} is claimed twice")
                if key:
                    properties[key] = _value(item)
    return properties


def _value(item: Any) -> float | list[float]:
    if item.name == "CARTESIAN_POINT":
        return _numbers(item)
    return float(item.params[1].param)
