"""A STEP file of a build: text and kernel read it in another process, and both are joined."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.mesh import MassProperties
from tbcad_verify.record.export import Export
from tbcad_verify.record.files import AGAIN, HEAD, FileBytes, read
from tbcad_verify.report.checks import Unknown
from tbcad_verify.run.kept import kept
from tbcad_verify.run.processes import ProcessEnded, Processes
from tbcad_verify.step.grammar import refuse_foreign
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.types import Floats

MAX_STEP_BYTES = 10**9
START, END = b"ISO-10303-21;", b"END-ISO-10303-21;"
SAME_SURFACE = 2e-9  # mm and differences of unit vectors: digits of the text
BROKEN = "broken STEP text"
SURFACES = {"SPHERICAL_SURFACE": "sphere", "PLANE": "plane"}
# Recommended Practices for Geometric and Assembly Validation Properties, CAx-IF, section 4.
PROPERTIES = {
    "volume measure": "volume",
    "surface area measure": "area",
    "centre point": "centroid",
}
# That read files at the same time, 0.2 GB each; meshes are read meanwhile.
PROCESSES = min(max((os.cpu_count() or 1) - 1, 1), 4)

Row = dict[str, Any]
Found = TypeVar("Found")


@dataclass(frozen=True)
class StepFaces:
    """The F faces of a STEP file: surfaces from the text, measures from the kernel.

    Figures that do not exist are NaN: so are measures where the kernel has no face on the text's
    surface.
    """

    names: tuple[str, ...]  # as the text has them
    kind: NDArray[np.str_]  # (F,) "sphere", "plane" or "other"
    point: Floats  # (F, 3) centre of a sphere, a point of a plane, mm
    radius: Floats  # (F,) of spheres, mm
    normal: Floats  # (F, 3) of planes, out of the solid
    # (F,) true where a sphere is convex seen from outside the solid, and a plane faces the
    # direction that the kernel gives, in the text too: kernels repair reversed faces, other readers
    # may not
    outward: NDArray[np.bool_]
    # (F,) true where a sphere is concave seen from outside the solid, in kernel and text
    inward: NDArray[np.bool_]
    area: Floats  # (F,) mm^2
    middle: Floats  # (F, 3) of the area, mm


@dataclass(frozen=True)
class StepFile:
    """One STEP file."""

    solids: tuple[str, ...]  # names of the solids in the text
    products: tuple[str, ...]  # and of the products
    counts: dict[str, int]  # the kernel's solids, shells and open edges
    valid: bool  # the kernel's check of the shape
    gap: float  # tolerance to which the kernel had to widen corners and edges until they met, mm
    mass: MassProperties  # of the whole, by the kernel
    properties: dict[str, Any]  # volume, area and centroid, as far as the file claims them
    faces: StepFaces  # all of them


def load(folder: Path, name: str) -> FileBytes:
    """The bytes of a STEP file.

    BadExport as `files.read`; it does not begin or end as ISO 10303-21 requires.
    """
    blob = read(folder, name, MAX_STEP_BYTES)
    if not blob.data[:HEAD].tobytes().lstrip().startswith(START):
        raise BadExport(f"{name}: does not begin with {START.decode()}: no STEP file; {AGAIN}")
    if not blob.data[-len(END) - 64 :].tobytes().rstrip().endswith(END):
        raise BadExport(f"{name}: does not end with {END.decode()}: truncated; {AGAIN}")
    return blob


def read_step_files(export: Export, processes: Processes) -> dict[str, StepFile | Unknown]:
    """The STEP files of all parts, or why one is not known, by part.

    BadExport: a file is missing, foreign or truncated.
    """
    every = (*export.parts, *export.mandrels, *export.printed, *export.rings)
    parts = [part for part in every if part.step]
    files = examine_all([load(export.folder, part.step) for part in parts], processes)
    return {part.name: file for part, file in zip(parts, files, strict=True)}


def examine_all(blobs: Sequence[FileBytes], processes: Processes) -> list[StepFile | Unknown]:
    """Read the bytes of files as text and by the kernel, from private copies.

    `processes`: one that crashes, or is stopped, makes the file that it was at unknown, and no
    other.
    """
    with tempfile.TemporaryDirectory(prefix="tbcad-step-") as name:
        paths = [Path(name) / f"part{k}.step" for k in range(len(blobs))]
        for path, blob in zip(paths, blobs, strict=True):
            blob.data.tofile(path)
        # The largest first, so that no process is left with a large one at the end.
        order = sorted(range(len(blobs)), key=lambda k: (-blobs[k].data.size, k))
        asked = {k: processes.submit(read_file, paths[k]) for k in order}
        return [_answer(asked[k]) for k in range(len(blobs))]


def _answer(asked: Future[StepFile]) -> StepFile | Unknown:
    """A file, or why it is not known."""
    try:
        return asked.result()
    except (ProcessEnded, ValueError) as error:
        return Unknown(str(error))
    except Exception as error:
        return Unknown(f"{type(error).__name__}: {error}")


@kept("checks of STEP files")
def read_file(file: Path) -> StepFile:
    """One file: its names and claims by its text, its measures by the kernel, faces by both; mm.

    ValueError: why it cannot be read, as text or by the kernel.
    """
    from tbcad_verify.step.kernel.reading import read_solid

    try:
        # Names are ASCII, and the standard writes all other characters so too.
        table = StepTable(file.read_bytes().decode("ascii"))
        refuse_foreign(table)
        solids, products = (
            tuple(table.label(one) for one in table.of(kind))
            for kind in ("MANIFOLD_SOLID_BREP", "PRODUCT")
        )
        told = [_text_face(table, one) for one in table.of("ADVANCED_FACE")]
        properties = _properties(table)
    except (LookupError, ValueError) as error:
        begin = "" if str(error).startswith(BROKEN) else f"{BROKEN}: "
        raise ValueError(f"{begin}{error}") from error
    solid = read_solid(file)
    area = sum(row["area"] for row in solid["faces"])
    return StepFile(
        solids,
        products,
        {key: solid[key] for key in ("solids", "shells", "open_edges")},
        solid["valid"],
        solid["gap"],
        MassProperties(solid["volume"], area, solid["centroid"], *solid["box"]),
        properties,
        _faces(told, solid["faces"]),
    )


def _text_face(table: StepTable, face: int) -> Row:
    surface = table.references(face)[-1]
    row: Row = {"name": table.label(face), "kind": SURFACES.get(table.kinds[surface], "other")}
    if row["kind"] == "other":
        return row
    point, axis = table.placement(table.references(surface)[0])
    row |= {"forward": table.forward(face), "point": point}
    if row["kind"] == "sphere":
        return row | {"radius": table.numbers(surface)[-1]}
    return row | {"axis": axis}


def _properties(table: StepTable) -> Row:
    """Values under every property definition called a geometric validation property."""
    properties: Row = {}
    for link in table.of("PROPERTY_DEFINITION_REPRESENTATION"):
        definition, representation = table.references(link)
        if table.label(definition) != "geometric validation property":
            continue
        for item in table.references(representation):
            key = PROPERTIES.get(table.label(item)) if item in table.kinds else None
            if key in properties:
                raise ValueError(f"{key} is claimed twice")
            if key == "centroid":
                properties[key] = table.triple(item).tolist()
            elif key:
                (properties[key],) = table.numbers(item)
    return properties


def known(found: Found | Unknown) -> Found:
    """What was found. Unknown: nothing was."""
    if isinstance(found, Unknown):
        raise found
    return found


def _faces(rows: list[Row], measured: list[Row]) -> StepFaces:
    joined = _joined(rows, measured)
    pairs = list(zip(joined, rows, strict=True))
    return StepFaces(
        tuple(row["name"] for row in rows),
        np.array([row["kind"] for row in rows], dtype=str),
        _vectors(rows, "point"),
        np.array([row.get("radius", np.nan) for row in rows]),
        _vectors(joined, "normal"),
        np.array([_outward(*pair) for pair in pairs]),
        np.array([_inward(*pair) for pair in pairs]),
        np.array([row.get("area", np.nan) for row in joined]),
        _vectors(joined, "centroid"),
    )


def _joined(rows: list[Row], measured: list[Row]) -> list[Row]:
    """Each row with what the kernel measured of the same surface, to the precision of the text."""
    joined: list[Row] = [{} for _ in rows]
    for kind in SURFACES.values():
        mine, theirs = (
            [k for k, row in enumerate(some) if row["kind"] == kind] for some in (rows, measured)
        )
        if mine and theirs:
            tree = cKDTree(np.nan_to_num([_numbers(measured[k]) for k in theirs]))
            found = tree.query(np.nan_to_num([_numbers(rows[k]) for k in mine]))
            for k, far, there in zip(mine, *found, strict=True):
                joined[k] = measured[theirs[there]] if far <= SAME_SURFACE else {}
    return joined


def _numbers(row: Row) -> list[float]:
    return [*row["point"], *row.get("axis", ()), row.get("radius", 0.0)]


def _outward(row: Row, text: Row) -> bool:
    if row.get("kind") != "plane":
        return bool(row.get("outward") and text["forward"])
    return bool((np.dot(text["axis"], row["normal"]) > 0) == text["forward"])


def _inward(row: Row, text: Row) -> bool:
    return row.get("kind") == "sphere" and not row["outward"] and not text["forward"]


def _vectors(rows: list[Row], key: str) -> Floats:
    return np.array([row.get(key, [np.nan] * 3) for row in rows], dtype=np.float64).reshape(-1, 3)
