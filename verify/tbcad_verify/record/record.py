"""What the export says about itself: cameras, parts, mirrors, and the manifest.

Only requirements and poses are taken from here. What the mirrors are is measured on the mesh.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tbcad_verify.errors import BadExport
from tbcad_verify.record.fields import (
    Record,
    number,
    objects,
    parse,
    plain_file,
    typed,
    vector,
    word,
)
from tbcad_verify.record.files import AGAIN, MAX_TEXT_BYTES, open_folder, read, refuse_unsafe
from tbcad_verify.record.mirrors import Mirrors, from_csv, from_json
from tbcad_verify.record.prototype import read_prototype
from tbcad_verify.record.prototype_record import RECORD, Prototype
from tbcad_verify.types import Floats

SCHEMA = "tbcad-design/1"
TEXTS = ("design.json", "mirrors.csv", "manifest.json")
MAX_PIXELS = 500_000_000


@dataclass(frozen=True)
class Camera:
    """A pinhole with square pixels, looking along `forward`; rows run along `right`.

    Attributes:
        id: one letter.
        pinhole: (3,) mm.
        forward: (3,) unit, the optical axis.
        right: (3,) unit, across the columns.
        width: columns.
        height: rows.
        hfov: full view angle across the columns, rad.
    """

    id: str
    pinhole: Floats
    forward: Floats
    right: Floats
    width: int
    height: int
    hfov: float

    @property
    def down(self) -> Floats:
        """(3,) unit, down the rows."""
        return np.cross(self.forward, self.right)

    @property
    def pitch(self) -> float:
        """Tangent of view angle per pixel, at unit distance along `forward`."""
        return 2 * math.tan(self.hfov / 2) / self.width


@dataclass(frozen=True)
class Part:
    """One exported solid, the camera its mirrors are for, and its files; empty: it has none."""

    name: str
    camera: str
    stl: str
    step: str = ""
    threemf: str = ""


@dataclass(frozen=True)
class Export:
    """A folder's record.

    Attributes:
        folder: resolved path.
        spec: the resolved design, as written.
        target_mm: diameter that every virtual camera must see.
        coating_mm: thickness of the reflecting coat over the meshed surface.
        foot_z_mm: height of the foot plane.
        cameras: by id.
        parts: in the record's order.
        mirrors: from design.json.
        rows: from mirrors.csv.
        manifest: file name -> (size, sha256), as it should be.
        digests: file name -> (size, sha256), of the bytes that all this was parsed from.
        prototype: the machine with balls; None where only the shell was built.
    """

    folder: Path
    spec: Record
    target_mm: float
    coating_mm: float
    foot_z_mm: float
    cameras: Mapping[str, Camera]
    parts: tuple[Part, ...]
    mirrors: Mirrors
    rows: Mirrors
    manifest: Mapping[str, tuple[int, str]]
    digests: Mapping[str, tuple[int, str]]
    prototype: Prototype | None = None

    @property
    def part_files(self) -> frozenset[str]:
        """All files of all parts, and of their assembly."""
        files = ((part.stl, part.step, part.threemf) for part in self.parts)
        more = self.prototype.part_files if self.prototype else frozenset()
        return frozenset(name for names in files for name in names if name) | more

    @property
    def mesh_error_mm(self) -> float:
        """How far the spec lets the mesh be from the exact surface, mm; NaN if it does not say."""
        mesh = self.spec.get("mesh")
        keys = ("chord_error_mm", "structure_error_mm")
        values = [mesh.get(key) for key in keys] if isinstance(mesh, dict) else [None]
        good = all(isinstance(value, int | float) for value in values)
        return float(max(values)) if good else math.nan  # type: ignore[type-var, arg-type]


def read_export(folder: Path) -> Export:
    """Read design.json, mirrors.csv, manifest.json and what describes a prototype, strictly.

    Raises:
        BadExport: anything missing, foreign, malformed, not finite or absurd.
    """
    root = open_folder(folder)
    texts = {name: read(root, name, MAX_TEXT_BYTES) for name in TEXTS}
    design = parse(texts["design.json"])
    if design.get("schema") != SCHEMA:
        raise BadExport(f"design.json: schema must be {SCHEMA!r}, not {design.get('schema')!r:.60}")
    cameras, manifest = _cameras(design), _manifest(parse(texts["manifest.json"]))
    digests = {name: blob.digest for name, blob in texts.items()}
    prototype = None
    if RECORD in manifest or (root / RECORD).exists():
        prototype = read_prototype(root, cameras)
        digests |= prototype.digests
    return Export(
        folder=root,
        spec=typed(design, "spec", dict),
        target_mm=number(design, "target_mm", 1e-3, 1e6),
        coating_mm=number(design, "coating_mm", 0.0, 1e3),
        foot_z_mm=number(design, "foot_z_mm", -1e6, 1e6),
        cameras=cameras,
        parts=_parts(design, prototype),
        mirrors=from_json(objects(design, "mirrors")),
        rows=from_csv(texts["mirrors.csv"]),
        manifest=manifest,
        digests=digests,
        prototype=prototype,
    )


def _cameras(design: Record) -> dict[str, Camera]:
    cameras = [_camera(item) for item in objects(design, "cameras")]
    if not cameras or len({camera.id for camera in cameras}) != len(cameras):
        raise BadExport(f"design.json: cameras must be there and differ in id; {AGAIN}")
    return {camera.id: camera for camera in cameras}


def _camera(item: Record) -> Camera:
    width, height = (round(number(item, key, 1, 65536)) for key in ("width_px", "height_px"))
    if width * height > MAX_PIXELS:
        raise BadExport(f"design.json: {width} x {height} pixels; at most {MAX_PIXELS} are traced")
    forward, right = vector(item, "forward"), vector(item, "right")
    gram = np.array([forward @ forward - 1, right @ right - 1, forward @ right])
    if np.abs(gram).max() > 1e-6:
        raise BadExport(
            f"design.json: camera {item.get('id')!r:.20}: forward and right must be unit vectors "
            f"at right angles; {AGAIN}"
        )
    hfov = math.radians(number(item, "hfov_deg", 1e-3, 179.0))
    return Camera(word(item, "id"), vector(item, "pinhole_mm"), forward, right, width, height, hfov)


def _parts(design: Record, prototype: Prototype | None) -> tuple[Part, ...]:
    parts = tuple(
        Part(
            word(item, "name"),
            str(item.get("camera") or ""),
            plain_file(item, "stl"),
            plain_file(item, "step") if item.get("step") else "",
            plain_file(item, "3mf") if item.get("3mf") else "",
        )
        for item in objects(design, "parts")
    )
    others = prototype.parts if prototype else ()
    meshes = [part.stl for part in parts] + [part.stl for part in others]
    if not meshes or len(set(meshes)) != len(meshes):
        raise BadExport(f"design.json: parts must be there, each with an STL of its own; {AGAIN}")
    twice = {part.name for part in parts} & {part.name for part in others}
    if twice:
        raise BadExport(f"{RECORD}: part {min(twice)!r} is in design.json too; {AGAIN}")
    return parts


def _manifest(value: Record) -> dict[str, tuple[int, str]]:
    entries = value.get("files")
    if not isinstance(entries, dict) or not entries:
        raise BadExport(f"manifest.json: files must list the export's files; {AGAIN}")
    return {name: _entry(name, entry) for name, entry in entries.items()}


def _entry(name: str, entry: Any) -> tuple[int, str]:
    refuse_unsafe(name)
    size = entry.get("size") if isinstance(entry, dict) else None
    sha = entry.get("sha256") if isinstance(entry, dict) else None
    if not isinstance(size, int) or not isinstance(sha, str):
        raise BadExport(f"manifest.json: {name!r:.80} must have a size and a sha256; {AGAIN}")
    return size, sha.lower()
