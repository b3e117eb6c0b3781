"""3MF files, read by lib3mf: parts as they are built, with colours of triangles."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.object_files.contents import ObjectFile, ObjectPart
from tbcad.types import Floats

UNITS = ("um", "mm", "cm", "in", "ft", "m")  # in the order of lib3mf's ModelUnit
MOST_DEEP = 32
GREY = 0.8  # of facets without a colour beside some that have one


def read_3mf(path: Path) -> ObjectFile:
    """Read all meshes that the file builds, where it puts them.

    InputError: lib3mf cannot read it, or it builds no mesh.
    """
    import lib3mf

    model = lib3mf.get_wrapper().CreateModel()
    try:
        reader = model.QueryReader("3mf")
        reader.SetStrictModeActive(False)
        reader.ReadFromFile(str(path))
    except lib3mf.ELib3MFException as error:
        raise InputError(f"lib3mf says: {error}") from None
    notes, parts, items = list[str](), list[ObjectPart](), model.GetBuildItems()
    while items.MoveNext():
        item = items.GetCurrent()
        matrix = _matrix(item.GetObjectTransform())
        parts += _parts(model, item.GetObjectResource(), matrix, notes)
    if not parts:
        raise InputError("it builds no mesh: its build section is empty")
    return ObjectFile(parts, list(dict.fromkeys(notes)), UNITS[int(model.GetUnit())], "z")


def _matrix(transform: Any) -> Floats:
    """A matrix (4, 4) of 3MF's rows, which multiply points from the right."""
    rows = np.array([list(row) for row in transform.Fields], dtype=np.float64)
    return np.vstack([rows.T, [0, 0, 0, 1]])


def _parts(
    model: Any, found: Any, matrix: Floats, notes: list[str], deep: int = 0
) -> list[ObjectPart]:
    """Meshes of an object, or of its components."""
    if deep > MOST_DEEP:
        raise InputError("its components hold each other")
    if found.IsMeshObject():
        part = _part(model, model.GetMeshObjectByID(found.GetUniqueResourceID()), notes)
        return [part.moved(matrix)] if len(part.faces) else []
    if not found.IsComponentsObject():
        return []
    whole, parts = model.GetComponentsObjectByID(found.GetUniqueResourceID()), list[ObjectPart]()
    for k in range(whole.GetComponentCount()):
        one = whole.GetComponent(k)
        own = matrix @ _matrix(one.GetTransform()) if one.HasTransform() else matrix
        parts += _parts(model, one.GetObjectResource(), own, notes, deep + 1)
    return parts


def _part(model: Any, mesh: Any, notes: list[str]) -> ObjectPart:
    """A mesh with the colours of its triangles, or that of the whole."""
    points = np.array([list(one.Coordinates) for one in mesh.GetVertices()], dtype=np.float64)
    faces = np.array([list(one.Indices) for one in mesh.GetTriangleIndices()], dtype=np.int64)
    part = ObjectPart(points.reshape(-1, 3), faces.reshape(-1, 3))
    keys = [(one.ResourceID, tuple(one.PropertyIDs)) for one in mesh.GetAllTriangleProperties()]
    resource, number, whole = mesh.GetObjectLevelProperty()
    fallback = _colour(model, resource, number, notes) if whole else None
    known = {(r, p): _colour(model, r, p, notes) for r, three in set(keys) if r for p in three}
    if fallback is None and not any(colour is not None for colour in known.values()):
        return part
    other = fallback or (GREY,) * 3
    rows = [[known.get((r, p)) or other for p in three] for r, three in keys]
    colours = np.array(rows or [[other] * 3] * len(faces), dtype=np.float64)
    return replace(part, colours=colours, source="colours of triangles")


def _colour(
    model: Any, resource: int, number: int, notes: list[str]
) -> tuple[float, float, float] | None:
    import lib3mf

    kind = model.GetPropertyTypeByID(resource)
    if kind == lib3mf.PropertyType.BaseMaterial:
        colour = model.GetBaseMaterialGroupByID(resource).GetDisplayColor(number)
    elif kind == lib3mf.PropertyType.Colors:
        colour = model.GetColorGroupByID(resource).GetColor(number)
    else:
        notes.append("its textures and mixed materials are left out")
        return None
    if colour.Alpha < 255:
        notes.append("its transparency is left out")
    return colour.Red / 255, colour.Green / 255, colour.Blue / 255
