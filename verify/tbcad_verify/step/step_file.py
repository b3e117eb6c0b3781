"""A STEP file of an export: text and kernel read it in another process, and both are joined."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tbcad_verify.errors import BadExport
from tbcad_verify.mesh.mass import MassProperties
from tbcad_verify.record.export import Export
from tbcad_verify.record.files import AGAIN, HEAD, FileBytes, read
from tbcad_verify.report.checks import Unknown
from tbcad_verify.run.processes import ProcessEnded, Processes
from tbcad_verify.step.mirror_image import flipped_solid, is_mirror_image
from tbcad_verify.step.text import ascii_text, read_text
from tbcad_verify.types import Floats

MAX_STEP_BYTES = 10**9
START, END = b"ISO-10303-21;", b"END-ISO-10303-21;"
SAME_SURFACE = 2e-9  # mm and differences of unit vectors: digits of the text
EXACT_KINDS = ("sphere", "plane")
# That read files at the same time, 0.2 GB each; meshes are read meanwhile.
PROCESSES = min(max((os.cpu_count() or 1) - 1, 1), 4)

Row = dict[str, Any]
Found = TypeVar("Found")


@dataclass(frozen=True)
class StepFaces:
    """The F faces of a STEP file: surfaces from the text, measures from the kernel.

    Attributes:
        names: as the text has them.
        kind: (F,) "sphere", "plane" or "other".
        point: (F, 3) centre of a sphere, a point of a plane, mm.
        radius: (F,) of spheres, mm.
        normal: (F, 3) of planes, out of the solid.
        outward: (F,) true where a sphere is convex seen from outside the solid, and a plane faces
            the direction that the kernel gives, in the text too: kernels repair reversed faces,
            other readers may not.
        inward: (F,) true where a sphere is concave seen from outside the solid, in kernel and text.
        area: (F,) mm^2.
        middle: (F, 3) of the area, mm.

    Figures that do not exist are NaN: so are measures where the kernel has no face on the text's
    surface.
    """

    names: tuple[str, ...]
    kind: NDArray[np.str_]
    point: Floats
    radius: Floats
    normal: Floats
    outward: NDArray[np.bool_]
    inward: NDArray[np.bool_]
    area: Floats
    middle: Floats


@dataclass(frozen=True)
class StepFile:
    """One STEP file.

    Attributes:
        solids: names of the solids in the text.
        counts: the kernel's solids, shells and open edges.
        valid: the kernel's check of the shape.
        gap: tolerance to which the kernel had to widen corners and edges until they met, mm.
        mass: of the whole, by the kernel.
        properties: volume, area and centroid, as far as the file claims them.
        faces: all of them.
    """

    solids: tuple[str, ...]
    counts: dict[str, int]
    valid: bool
    gap: float
    mass: MassProperties
    properties: dict[str, Any]
    faces: StepFaces


def load(folder: Path, name: str) -> FileBytes:
    """The bytes of a STEP file.

    Raises:
        BadExport: as `files.read`; it does not begin or end as ISO 10303-21 requires.
    """
    blob = read(folder, name, MAX_STEP_BYTES)
    if not blob.data[:HEAD].tobytes().lstrip().startswith(START):
        raise BadExport(f"{name}: does not begin with {START.decode()}: no STEP file; {AGAIN}")
    if not blob.data[-len(END) - 64 :].tobytes().rstrip().endswith(END):
        raise BadExport(f"{name}: does not end with {END.decode()}: truncated; {AGAIN}")
    return blob


def read_step_files(export: Export, processes: Processes) -> dict[str, StepFile | Unknown]:
    """The STEP files of all parts, or why one is not known, by part.

    Args:
        export: the record.
        processes: that read them.

    Raises:
        BadExport: a file is missing, foreign or truncated.
    """
    parts = [part for part in (*export.parts, *export.mandrels, *export.printed) if part.step]
    blobs = [load(export.folder, part.step) for part in parts]
    shells = [k for k, part in enumerate(parts) if part in export.parts]
    files = examine_all(blobs, processes, dict.fromkeys(shells[1:], *shells[:1]))
    return {part.name: file for part, file in zip(parts, files, strict=True)}


def examine_all(
    blobs: Sequence[FileBytes],
    processes: Processes,
    originals: Mapping[int, int] = MappingProxyType({}),
) -> list[StepFile | Unknown]:
    """Read the bytes of files as text and by the kernel, from private copies.

    Args:
        blobs: the files.
        processes: one that crashes, or is stopped, makes the file that it was at unknown, and no
            other.
        originals: by the number of a file, that of the one whose mirror image it may be: the kernel
            does not read it if it is.
    """
    with tempfile.TemporaryDirectory(prefix="tbcad-step-") as name:
        paths = [Path(name) / f"part{k}.step" for k in range(len(blobs))]
        for path, blob in zip(paths, blobs, strict=True):
            blob.data.tofile(path)
        # The largest first, so that no process is left with a large one at the end.
        order = sorted(range(len(blobs)), key=lambda k: (-blobs[k].data.size, k))
        asked = {
            k: processes.submit(read_file, paths[k], paths[originals.get(k, k)]) for k in order
        }
        answers = [_answer(asked[k]) for k in range(len(blobs))]
    return [_joined_answer(answers, k, originals.get(k, k)) for k in range(len(blobs))]


def read_file(file: Path, original: Path) -> Row:
    """Read one file as text and by the kernel, or say why it cannot be read.

    Its solid is none where the kernel need not read it: the file is the mirror image of its
    original. One without an original has itself there.
    """
    from tbcad_verify.step.kernel.reading import read_solid

    try:
        content: Row = {"text": read_text(file), "solid": None}
        if original == file or not is_mirror_image(*(ascii_text(one) for one in (original, file))):
            content["solid"] = read_solid(file)
    except ValueError as error:
        return {"refused": str(error)}
    except Exception as error:
        return {"refused": f"{type(error).__name__}: {error}"}
    return content


def _answer(asked: Future[Row]) -> Row:
    """What was read of a file, or why it was not."""
    try:
        return asked.result()
    except ProcessEnded as end:
        return {"refused": str(end)}


def _joined_answer(answers: Sequence[Row], number: int, original: int) -> StepFile | Unknown:
    """Text and solid of a file; that of a mirror image is its original's, reflected."""
    answer = answers[number]
    if "refused" in answer:
        return Unknown(str(answer["refused"]))
    if answer["solid"] is not None:
        return parse(answer["text"], answer["solid"])
    if "refused" in answers[original]:
        return Unknown(str(answers[original]["refused"]))
    return parse(answer["text"], flipped_solid(answers[original]["solid"]))


def known(found: Found | Unknown) -> Found:
    """What was found.

    Raises:
        Unknown: nothing was.
    """
    if isinstance(found, Unknown):
        raise found
    return found


def parse(text: Row, solid: Row) -> StepFile:
    """Join the text's figures with the kernel's."""
    rows = solid["faces"]
    area = sum(row["area"] for row in rows)
    return StepFile(
        tuple(text["solids"]),
        {key: solid[key] for key in ("solids", "shells", "open_edges")},
        solid["valid"],
        solid["gap"],
        MassProperties(solid["volume"], area, solid["centroid"], *solid["box"]),
        text["properties"],
        _faces(text["faces"], rows),
    )


def _joined(rows: list[Row], measured: list[Row]) -> list[Row]:
    """Each row with what the kernel measured of the same surface, to the precision of the text."""
    joined: list[Row] = [{} for _ in rows]
    for kind in EXACT_KINDS:
        mine, theirs = (
            [k for k, row in enumerate(some) if row["kind"] == kind] for some in (rows, measured)
        )
        if mine and theirs:
            tree = cKDTree(np.nan_to_num([_numbers(measured[k]) for k in theirs]))
            found = tree.query(np.nan_to_num([_numbers(rows[k]) for k in mine]))
            distance, nearest = (np.atleast_1d(one).tolist() for one in found)
            for k, far, there in zip(mine, distance, nearest, strict=True):
                joined[k] = measured[theirs[there]] if far <= SAME_SURFACE else {}
    return joined


def _numbers(row: Row) -> list[float]:
    return [*row.get("point", ()), *row.get("axis", ()), row.get("radius", 0.0)]


def _faces(rows: list[Row], measured: list[Row]) -> StepFaces:
    joined = _joined(rows, measured)
    return StepFaces(
        tuple(row["name"] for row in rows),
        np.array([row["kind"] for row in rows], dtype=str),
        _vectors(rows, "point"),
        np.array([row.get("radius", np.nan) for row in rows]),
        _vectors(joined, "normal"),
        np.array([_outward(row, text) for row, text in zip(joined, rows, strict=True)]),
        np.array([_inward(row, text) for row, text in zip(joined, rows, strict=True)]),
        np.array([row.get("area", np.nan) for row in joined]),
        _vectors(joined, "centroid"),
    )


def _outward(row: Row, text: Row) -> bool:
    if row.get("kind") != "plane":
        return bool(row.get("outward") and text["forward"])
    along = sum(a * b for a, b in zip(text["axis"], row["normal"], strict=True)) > 0
    return bool(along == text["forward"])


def _inward(row: Row, text: Row) -> bool:
    return row.get("kind") == "sphere" and not row["outward"] and not text["forward"]


def _vectors(rows: list[Row], key: str) -> Floats:
    return np.array([row.get(key, [np.nan] * 3) for row in rows], dtype=np.float64).reshape(-1, 3)
