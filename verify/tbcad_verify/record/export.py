"""The records of a build: design.json, mirrors.csv, manifest.json and those of a prototype.

Only requirements and poses are taken from here. What the mirrors are is measured on the mesh.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from tbcad_verify.errors import BadExport
from tbcad_verify.record.files import (
    AGAIN,
    MAX_TEXT_BYTES,
    open_folder,
    read,
    refuse_other_kinds,
    refuse_unsafe,
)
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.record.prototype import RECORD, PrintedPart, Prototype, read_prototype
from tbcad_verify.record.spec import LARGEST_MESH_ERROR_MM, Spec
from tbcad_verify.record.validation import Name, PartFiles, Strict, Vector, parse_json, validated
from tbcad_verify.types import Floats

SCHEMA, MANIFEST_SCHEMA = "tbcad-design/2", "tbcad-manifest/1"
DESIGN, MIRRORS, MANIFEST = "design.json", "mirrors.csv", "manifest.json"
TEXTS = (DESIGN, MIRRORS, MANIFEST)
GIVE = "give the folder that `tbcad build` wrote"
# By what else a folder of tbcad is known, and what it is.
OTHER_RECORDS = {
    "run.json": "a run of photographs",
    "calibration.json": "a calibration",
    "capture.json": "a capture or a merged run",
    "dataset.json": "a dataset",
    "order.json": "an order",
    "as_built.json": "a prototype as built",
}
MOST = 1000  # cameras or parts
MOST_FILES = 10_000
MAX_SIDE_PX = 65536
MAX_NAME = 64
MAX_PIXELS = 500_000_000
SQUARE = 1e-6  # by which axes of a camera may be off unit length or a right angle


def _unit(vector: Floats) -> Floats:
    if abs(float(vector @ vector) - 1) > SQUARE:
        raise ValueError("is no unit vector")
    return vector


UnitVector = Annotated[Vector, AfterValidator(_unit)]


class Camera(Strict):
    """A pinhole with square pixels, looking along `forward`; rows run along `right`."""

    id: Name  # one letter
    pinhole: Vector = Field(alias="pinhole_mm")  # (3,) mm
    forward: Vector  # (3,) unit, the optical axis
    right: Vector  # (3,) unit, across the columns
    width: int = Field(alias="width_px", ge=1, le=MAX_SIDE_PX)  # columns
    height: int = Field(alias="height_px", ge=1, le=MAX_SIDE_PX)  # rows
    hfov_deg: float = Field(ge=1e-3, le=179)  # full view angle across the columns

    @model_validator(mode="after")
    def _traceable(self) -> Self:
        if self.width * self.height > MAX_PIXELS:
            size = f"{self.width} x {self.height}"
            raise ValueError(f"has {size} pixels; at most {MAX_PIXELS} are traced")
        forward, right = self.forward, self.right
        gram = np.array([forward @ forward - 1, right @ right - 1, forward @ right])
        if np.abs(gram).max() > SQUARE:
            raise ValueError("has forward and right that are no unit vectors at right angles")
        return self

    @property
    def hfov(self) -> float:
        """Full view angle across the columns, rad."""
        return math.radians(self.hfov_deg)

    @property
    def down(self) -> Floats:
        """(3,) unit, down the rows."""
        return np.cross(self.forward, self.right)

    @property
    def pitch(self) -> float:
        """Tangent of view angle per pixel, at unit distance along `forward`."""
        return 2 * math.tan(self.hfov / 2) / self.width


class Part(PartFiles):
    """One solid of the shell, and the camera its mirrors are for."""

    camera: str = ""


class Mandrel(Part):
    """The negative of one camera's shell, and how the shell comes off."""

    pull: UnitVector  # (3,), along which the shell is drawn
    # least angle between pull and surface; below 0 it catches
    draft_deg: float = Field(ge=-90, le=90)


class ShellLamp(Strict):
    """An LED: the camera that it is at, its middle (3,), mm, and its unit direction (3,)."""

    camera: Name
    position: Vector = Field(alias="position_mm")
    direction: UnitVector


class ShellLamps(Strict):
    """LEDs on the lenses of a shell's cameras, and the ring that carries those of each."""

    ring: PrintedPart
    led: str = Field(max_length=MAX_NAME)
    front_mm: float = Field(ge=-1e3, le=1e3)
    places: list[ShellLamp] = Field(min_length=1, max_length=MOST)


class Design(Strict):
    """design.json: see `Export`."""

    spec: Spec
    target_mm: float = Field(ge=1e-3, le=1e6)
    coating_mm: float = Field(ge=0, le=1e3)
    foot_z_mm: float = Field(ge=-1e6, le=1e6)
    cameras: list[Camera] = Field(min_length=1, max_length=MOST)
    parts: list[Part] = Field(max_length=MOST)
    mandrels: list[Mandrel] = Field(default=[], max_length=MOST)
    lamps: ShellLamps | None = None
    mirrors: Literal["mirrors.csv"]

    @model_validator(mode="after")
    def _distinct(self) -> Self:
        if len({camera.id for camera in self.cameras}) != len(self.cameras):
            raise ValueError("cameras must differ in id")
        return self


class Entry(Strict):
    """A file's entry in the manifest."""

    size: int
    sha256: str


class Manifest(Strict):
    """manifest.json: every file of the build. Builds of earlier versions tell no kind."""

    kind: Literal["build"] = "build"
    files: dict[str, Entry] = Field(min_length=1)

    @field_validator("files", mode="before")
    @classmethod
    def _few_and_inside(cls, files: object) -> object:
        names = list(files) if isinstance(files, dict) else []
        if len(names) > MOST_FILES:
            raise ValueError(f"lists {len(names)}; at most {MOST_FILES} are read")
        for name in names:
            refuse_unsafe(name)
        return files

    def digests(self) -> dict[str, tuple[int, str]]:
        """File name -> (size, sha256)."""
        return {name: (entry.size, entry.sha256.lower()) for name, entry in self.files.items()}


@dataclass(frozen=True)
class Export:
    """A folder's record."""

    folder: Path  # resolved path
    spec: Spec  # the resolved design
    target_mm: float  # diameter that every virtual camera must see
    coating_mm: float  # thickness of the reflecting coat over the meshed surface
    foot_z_mm: float  # height of the foot plane
    cameras: Mapping[str, Camera]  # by id
    parts: tuple[Part, ...]  # in the record's order
    mirrors: Mirrors  # from mirrors.csv
    manifest: Mapping[str, tuple[int, str]]  # file name -> (size, sha256), as it should be
    # file name -> (size, sha256), of the bytes that all this was parsed from
    digests: Mapping[str, tuple[int, str]]
    # the machine with balls; None where only the shell was built
    prototype: Prototype | None = None
    mandrels: tuple[Mandrel, ...] = ()  # negatives of the shells, in the record's order
    lamps: ShellLamps | None = None  # on the lenses of the shell's cameras

    @property
    def rings(self) -> tuple[PrintedPart, ...]:
        """The part that carries the shell's lamps."""
        return (self.lamps.ring,) if self.lamps else ()

    @property
    def printed(self) -> tuple[PrintedPart, ...]:
        """Parts of the prototype."""
        return tuple(self.prototype.parts) if self.prototype else ()

    @property
    def files(self) -> frozenset[str]:
        """All files that are read: records, parts, their assembly, drawings and programs."""
        parts = (*self.parts, *self.mandrels, *self.printed, *self.rings)
        names = {name for part in parts for name in (part.stl, part.step, part.threemf)}
        names |= {DESIGN, MIRRORS}
        if self.prototype:
            names |= self.prototype.files
        return frozenset(names - {""})

    @property
    def semi_minor_mm(self) -> float:
        """Semi-minor axis of the ellipsoid."""
        return self.spec.optics.semi_minor_mm

    @property
    def mesh_error_mm(self) -> float:
        """Largest distance from mesh to exact surface that is allowed, mm."""
        return min(self.spec.mesh.largest_mm, LARGEST_MESH_ERROR_MM)


def listed_names(folder: Path) -> frozenset[str]:
    """Names of all files that belong to a build, by its manifest alone.

    BadExport: the folder is no export, which is told at once however much is in it.
    """
    root = _open_build(folder)
    text = read(root, MANIFEST, MAX_TEXT_BYTES)
    manifest = validated(MANIFEST, Manifest, parse_json(text, MANIFEST_SCHEMA))
    return frozenset({*manifest.files, *TEXTS})


def _open_build(folder: Path) -> Path:
    """The folder, resolved; what is no build is known by the first files that there would be.

    BadExport: it is missing, something else that tbcad wrote, or nothing of tbcad.
    """
    root = open_folder(folder)
    there = {name for name in (DESIGN, MANIFEST, *OTHER_RECORDS) if os.path.lexists(root / name)}
    others = [words for name, words in OTHER_RECORDS.items() if name in there]
    # Without one of its files it is a build too, which its reader names.
    if {DESIGN, MANIFEST} <= there or (there and not others):
        return root
    told = others[0] if others else "a folder without design.json and manifest.json"
    if not others and not any(root.iterdir()):
        told = "an empty folder"
    raise BadExport(f"{root} is {told}, no build: {GIVE}")


def read_export(folder: Path) -> Export:
    """Read design.json, mirrors.csv, manifest.json and what describes a prototype, strictly.

    BadExport: anything missing, foreign, malformed, not finite or absurd.
    """
    root = _open_build(folder)
    texts = {name: read(root, name, MAX_TEXT_BYTES) for name in TEXTS}
    design = validated(DESIGN, Design, parse_json(texts[DESIGN], SCHEMA))
    manifest = validated(MANIFEST, Manifest, parse_json(texts[MANIFEST], MANIFEST_SCHEMA))
    refuse_other_kinds(root, manifest.files)
    cameras = {camera.id: camera for camera in design.cameras}
    digests = {name: blob.digest for name, blob in texts.items()}
    prototype = None
    if RECORD in manifest.files or (root / RECORD).exists():
        prototype = read_prototype(root, cameras, design.spec.prototype.motion.controller)
        if missing := design.spec.prototype.left_open():
            raise BadExport(f"{DESIGN}: spec.{missing[0]} has no value for the prototype; {AGAIN}")
        digests |= prototype.digests
    _check_parts(design, prototype)
    return Export(
        folder=root,
        spec=design.spec,
        target_mm=design.target_mm,
        coating_mm=design.coating_mm,
        foot_z_mm=design.foot_z_mm,
        cameras=cameras,
        parts=tuple(design.parts),
        mirrors=Mirrors.read(texts[MIRRORS]),
        manifest=manifest.digests(),
        digests=digests,
        prototype=prototype,
        mandrels=tuple(design.mandrels),
        lamps=design.lamps,
    )


def _check_parts(design: Design, prototype: Prototype | None) -> None:
    others = [*design.mandrels, *(prototype.parts if prototype else [])]
    others += [design.lamps.ring] if design.lamps else []
    meshes = [part.stl for part in (*design.parts, *others)]
    lit = not design.lamps or design.parts  # lamps are of shells
    if not meshes or not lit or len(set(meshes)) != len(meshes):
        raise BadExport(f"{DESIGN}: parts must be there, each with an STL of its own; {AGAIN}")
    twice = {part.name for part in design.parts} & {part.name for part in others}
    if orphans := {one.camera for one in design.mandrels} - {one.camera for one in design.parts}:
        raise BadExport(f"{DESIGN}: camera {min(orphans)!r} has a mandrel and no shell; {AGAIN}")
    if twice:
        raise BadExport(f"{RECORD}: part {min(twice)!r} is in {DESIGN} too; {AGAIN}")
