"""The object before the cameras from a file: in millimetres, z up, with the file's colours."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tbcad.core.geometry.round_cones import smallest_sphere
from tbcad.core.geometry.vectors import facet_vectors, norm
from tbcad.errors import InputError, PlausibilityWarning
from tbcad.light.simulate.object_files.contents import (
    UNITS_MM,
    Fault,
    ObjectFile,
    ObjectPart,
    Up,
    even,
    without_facets,
)
from tbcad.light.simulate.object_files.finish import Finish, joined
from tbcad.light.simulate.object_files.normals import (
    corner_normals,
    first_of_each,
    turned_outward,
    usable,
)
from tbcad.light.simulate.object_files.read import read_object_file
from tbcad.light.simulate.scene.object import GREY, Reading, SceneObject, built_in_object
from tbcad.types import Floats, Ints, Progress

Paint = Literal["own", "pattern", "plain"]
Unit = Literal["mm", "cm", "m", "in"]

MAX_FACETS = 20_000_000
MAX_TEXTURE_BYTES = 2 << 30
MAX_COORDINATE_MM = 1e9
# Larger than the capture sphere by less than rounding in a file: not too large.
ROUNDING = 1e-6
# An object in inches that fits the capture sphere is 25.4 times smaller than was meant.
SMALL_SHARE = 1 / 20
LIKELY_UNITS_MM = {"mm": 1.0, "cm": 10.0, "in": 25.4, "m": 1000.0}
# Facets of less than this share of their longest side squared are lines.
LEAST_AREA = 1e-12
PATTERN, PLAIN = "the built-in pattern", "plain grey"


@dataclass(frozen=True)
class ObjectOptions:
    """How an object's file is taken."""

    fit: bool = False  # move and scale it so that it just fits the capture sphere
    # its own colours, or the built-in pattern where the file has none; the pattern in any case; or
    # plain grey
    paint: Paint = "own"
    # the file's axis that points up; None: as the file or its format says, else z
    up: Up | None = None
    unit: Unit | None = None  # of the file; None: as the file or its format says, else mm


def load_object(
    file: str | PathLike[str] | None,
    capture_mm: float,
    options: ObjectOptions | None = None,
    told: Progress | None = None,
) -> SceneObject:
    """Read a triangle mesh: PLY, STL, OBJ, OFF, GLB, glTF or 3MF, its textures in the same folder.

    Without a file it is the built-in object. `told` is called with a line that says which unit,
    axis and colours were taken.

    Raises:
        InputError: it cannot be read, is empty, has no facets or is too large; it names the size;
            or its colours are asked for, and a number of its materials cannot be or a texture is
            missing.

    Warns:
        PlausibilityWarning: it is so small that its unit is likely to be another one, or it has
            what is left out.
    """
    if file is None:
        return built_in_object(capture_mm)
    path, asked = Path(file), options or ObjectOptions()
    with np.errstate(all="ignore"):  # what is not finite is refused, in words
        found = read_object_file(path)
        unit, up = asked.unit or found.unit or "mm", asked.up or found.up or "z"
        turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) if up == "y" else np.eye(3)
        matrix = np.eye(4)  # to millimetres, z up
        matrix[:3, :3] = UNITS_MM[unit] * turn
        parts = [part.moved(matrix) for part in found.parts]
    mesh = _Mesh.of(path, parts)
    points = mesh.points
    if asked.fit:  # the smallest sphere about them becomes the capture sphere
        middle, reach = smallest_sphere(points)
        points = np.asarray((points - middle) * (capture_mm / 2 / reach))
    _check_size(path, points, capture_mm, unit)
    colours, notes = _painted(path, mesh, found, asked.paint)
    finish = colours.get("finish")
    gloss = "" if finish is None else finish.text()
    reading = Reading(unit, up, colours.pop("text"), tuple(notes), gloss)
    if notes:
        _warn(f"{path.name}: {'; '.join(notes)}")
    if told is not None:
        told(reading.line(path.name))
    return SceneObject(path.name, points, mesh.faces, mesh.normals, reading=reading, **colours)


@dataclass(frozen=True)
class _Mesh:
    """All parts as one mesh that can be shaded: facets have area, corners a normal."""

    points: Floats  # as of SceneObject
    faces: Ints
    normals: Floats
    facet: Ints  # number of each facet among those of all parts, (f,)
    turned: Any  # whether its corners go the other way than there, (f,)

    @classmethod
    def of(cls, path: Path, parts: Sequence[ObjectPart]) -> "_Mesh":
        """The mesh of some parts."""
        _check(path, parts)
        points = np.concatenate([part.points for part in parts])
        begin = np.cumsum([0, *(len(part.points) for part in parts)])
        faces = np.concatenate([p.faces + k for p, k in zip(parts, begin[:-1], strict=True)])
        given = np.concatenate([
            np.full_like(p.points, np.nan) if p.normals is None else p.normals for p in parts
        ])  # fmt: skip
        facet = _shown(path, points, faces)
        used, faces = np.unique(faces[facet], return_inverse=True)
        points, given, faces = points[used], given[used], faces.reshape(-1, 3)
        turned = turned_outward(points, faces)
        faces = np.where(turned[:, None], faces[:, ::-1], faces)
        known = np.isfinite(given).all(axis=1, keepdims=True) & (norm(given) > 0)[:, None]
        normals = np.where(known, given, corner_normals(points, faces))
        return cls(*usable(points, faces, normals), facet, turned)

    def corners(self, values: Sequence[Floats]) -> Floats:
        """Values (k, 3, n) of each part at the corners of its facets, as they go in the mesh."""
        own = np.concatenate(values)[self.facet]
        return np.asarray(np.where(self.turned[:, None, None], own[:, ::-1], own))


def _check(path: Path, parts: Sequence[ObjectPart]) -> None:
    count = sum(len(part.faces) for part in parts)
    if count == 0:
        points = sum(len(part.points) for part in parts)
        raise InputError(f"{path} cannot be read as a mesh: {without_facets(points)}")
    if count > MAX_FACETS:
        raise InputError(f"{path} has {count} facets, allowed are {MAX_FACETS}: reduce it")
    for part in parts:
        if len(part.faces) == 0:
            continue
        if part.faces.min() < 0 or part.faces.max() >= len(part.points):
            raise InputError(f"{path} has facets with corners that do not exist: repair the mesh")
        used = part.points[part.faces]
        if not np.isfinite(used).all():
            raise InputError(f"{path} has points that are not finite: repair the mesh")
        if np.abs(used).max() > MAX_COORDINATE_MM:
            raise InputError(
                f"{path} has coordinates up to {np.abs(used).max():.3g} mm, allowed is "
                f"{MAX_COORDINATE_MM:g}: repair the mesh, or give another --unit"
            )
        if part.uv is not None and not np.isfinite(part.uv).all():
            raise InputError(f"{path} has texture coordinates that are not finite: repair the mesh")


def _shown(path: Path, points: Floats, faces: Ints) -> Ints:
    """Numbers of the facets that have an area, without the backs of others."""
    corners = points[faces]
    if np.ptp(corners.reshape(-1, 3), axis=0).max() == 0:
        raise InputError(f"{path} has no extent: all its points are one: name another")
    longest = norm(corners - np.roll(corners, 1, axis=1)).max(axis=1)
    shown = np.flatnonzero(norm(facet_vectors(corners)) > LEAST_AREA * longest**2)
    if len(shown) == 0:
        raise InputError(f"{path} has no area: all its facets are lines or points: name another")
    return shown[first_of_each(faces[shown])]


def _check_size(path: Path, points: Floats, capture_mm: float, unit: str) -> None:
    size, reach = np.ptp(points, axis=0), 2 * float(norm(points).max())
    sizes = {name: size.max() / UNITS_MM[unit] * mm for name, mm in LIKELY_UNITS_MM.items()}
    other = [one for one, mm in sizes.items() if SMALL_SHARE * capture_mm <= mm <= capture_mm]
    if reach > capture_mm * (1 + ROUNDING):
        raise InputError(
            f"{path} does not fit the capture sphere: it is {size[0]:.4g} x {size[1]:.4g} x "
            f"{size[2]:.4g} mm and reaches {reach / 2:.4g} mm from the origin, allowed is "
            f"{capture_mm / 2:g}: move or scale it, "
            f"{''.join(f'give --unit {name}, ' for name in other)}or use --fit"
        )
    if size.max() < SMALL_SHARE * capture_mm:
        units = " or ".join(f"--unit {name}" for name in other) or "another --unit"
        _warn(
            f"{path.name} is {size.max():.3g} mm large, the capture sphere {capture_mm:g} mm: give "
            f"{units}, scale it, or use --fit"
        )


def _warn(text: str) -> None:
    warnings.warn(text, PlausibilityWarning, stacklevel=3)


def _painted(
    path: Path, mesh: _Mesh, found: ObjectFile, paint: Paint
) -> tuple[dict[str, Any], list[str]]:
    """Colours as fields of SceneObject, with what they are as "text"; and what is left out."""
    plain = np.full((len(mesh.faces), 3, 3), GREY)
    if paint != "own":
        patterned = paint == "pattern"
        text = PATTERN if patterned else PLAIN
        return {"albedo": plain, "patterned": patterned, "text": text}, []
    if faults := [note for note in found.notes if isinstance(note, Fault)]:
        raise InputError(f"{path}: {faults[0]}")
    sources = list(dict.fromkeys(part.source for part in found.parts if part.source))
    notes = list(found.notes)
    if not sources:
        text = f"{PATTERN}, for the file has none"
        return {"albedo": plain, "patterned": True, "text": text}, notes
    if bare := sum(len(part.faces) for part in found.parts if not part.source):
        notes.append(f"{bare} of its {sum(len(p.faces) for p in found.parts)} facets have no "
                     "colour and are grey")  # fmt: skip
    text = ", ".join(sources[:4]) + (f" and {len(sources) - 4} more" if len(sources) > 4 else "")
    albedo = mesh.corners([_shares(part) for part in found.parts])
    shows = {"finish": _finish(mesh, found.parts), **_textures(path, mesh, found.parts)}
    return {"albedo": albedo, "text": text, **shows}, notes


def _finish(mesh: _Mesh, parts: Sequence[ObjectPart]) -> Finish | None:
    """How facets shine; None: all are matt."""
    if all(part.finish is None for part in parts):
        return None
    return joined([part.finish or Finish.even(len(part.faces)) for part in parts]).of(mesh.facet)


def _shares(part: ObjectPart) -> Floats:
    """Colours (f, 3, 3) of a part, or what its picture is multiplied by, or grey."""
    if part.colours is not None:
        return part.colours
    return even((GREY if part.picture is None else 1.0,) * 3, len(part.faces))


def _textures(path: Path, mesh: _Mesh, parts: Sequence[ObjectPart]) -> dict[str, Any]:
    """Fields uv, texture and tiles: each picture once, one below the other, as wide as the widest.

    InputError: they are too large.
    """
    pictures = list({id(p.picture): p.picture for p in parts if p.picture is not None}.values())
    if not pictures:
        return {}
    height, width = sum(map(len, pictures)), max(picture.shape[1] for picture in pictures)
    if len(pictures) > 1 and 3 * height * width > MAX_TEXTURE_BYTES:
        raise InputError(f"{path} has textures of over 2 GiB in all: reduce them")
    texture, tile, row = np.zeros((height, width, 3), dtype=np.uint8), {id(None): (0, 0, 0)}, 0
    for picture in pictures:
        texture[row : row + len(picture), : picture.shape[1]] = picture
        tile[id(picture)] = row, *picture.shape[:2]
        row += len(picture)
    uv = [np.zeros((len(p.faces), 3, 2)) if p.uv is None else p.uv for p in parts]
    tiles = np.repeat([tile[id(p.picture)] for p in parts], [len(p.faces) for p in parts], axis=0)
    return {"uv": mesh.corners(uv), "texture": texture, "tiles": tiles[mesh.facet]}
