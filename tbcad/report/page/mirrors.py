"""Arrays as text in a page, and what the page knows of each mirror."""

import base64
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tbcad.cad.formats.checked_files import columns
from tbcad.records.tables import BallRow, MirrorRow, PictureRow
from tbcad.report.page.verdict import Verdict
from tbcad.types import Floats

LEVEL = 6
ALIGNED = 4  # bytes: typed arrays of a browser begin at multiples of their items
# Kinds of numbers by the names of JavaScript's typed arrays.
KINDS = {"Int16Array": "<i2", "Uint16Array": "<u2", "Uint32Array": "<u4", "Float32Array": "<f4"}

Place = list[int | str]  # where an array lies: first byte, number of items, kind


@dataclass
class PackedArrays:
    """Arrays that are added one by one, and the text that holds them all."""

    _parts: list[bytes] = field(default_factory=list)
    _size: int = 0

    def add(self, values: NDArray[Any], kind: str) -> Place:
        """Add an array, flattened, as one of KINDS; return where it lies."""
        data = np.ascontiguousarray(values, dtype=KINDS[kind]).tobytes()
        place: Place = [self._size, values.size, kind]
        padded = data + bytes(-len(data) % ALIGNED)
        self._parts.append(padded)
        self._size += len(padded)
        return place

    def text(self) -> str:
        """All arrays: zlib's format, in base64."""
        return base64.b64encode(zlib.compress(b"".join(self._parts), LEVEL)).decode("ascii")


UM_PER_MM = 1000.0
# Key, label, unit, digits, and field of a mirror in verify.json.
MEASURED = (
    ("covered", "Coverage, on the spheres in the files", "mm", 2, "coverage_fitted_mm"),
    ("facets", "Coverage, on the facets in the files", "mm", 2, "coverage_facet_mm"),
    ("pixels", "Pixels", "", 0, "pixels"),
    ("centre", "Centre in the files, off by", "µm", 3, "centre_error_mm"),
    ("radius_error", "Radius in the files, off by", "µm", 3, "radius_error_mm"),
)


class Quantity(NamedTuple):
    """A figure of every mirror."""

    key: str  # short name
    label: str  # what it is
    unit: str  # of the values
    digits: int  # after the point
    values: Floats  # (m,); NaN is unknown
    map: bool = True  # whether the map can show it
    added: bool = False  # whether both halves of a mirror on the seam add up

    def packed(self, arrays: PackedArrays) -> dict[str, Any]:
        """The figure for the page."""
        told = {name: value for name, value in self._asdict().items() if name != "values"}
        return told | {"values": arrays.add(self.values, "Float32Array")}


def packed_mirrors(folder: Path, verdict: Verdict | None, arrays: PackedArrays) -> dict[str, Any]:
    """All mirrors of both cameras for the page, with the prototype's balls if there are any."""
    rows = MirrorRow.read(folder)
    there = (folder / PictureRow.FILE).is_file()  # not without a prototype
    plan = {row.mirror: row for row in PictureRow.read(folder)} if there else {}
    shown = [plan.get(row.id) for row in rows]
    off = np.array([one.error_deg if one else np.nan for one in shown])
    pointing = Quantity("pointing", "Prototype: direction off by", "°", 2, off)
    quantities = [*_verified(rows, verdict), *_designed(rows), pointing]
    # Ball, stop, angle of the base and turn of the object, degrees.
    photographs = [
        one and [one.ball, one.stop, round(one.base_angle_deg, 4), one.object_turn_deg]
        for one in shown
    ]
    known = [one for one in quantities if np.isfinite(one.values).any()]
    return {
        "ids": [row.id for row in rows],
        "pose": arrays.add(columns(rows, "ux uy uz px py pz nx ny nz"), "Float32Array"),
        "radius": arrays.add(np.array([row.radius_mm or np.inf for row in rows]), "Float32Array"),
        "size": arrays.add(columns(rows, "size_mm")[:, 0], "Float32Array"),
        "quantities": [one.packed(arrays) for one in known],
        "plan": photographs if plan else [],
        "balls": _balls(folder) if plan else [],
    }


def _verified(rows: Sequence[MirrorRow], verdict: Verdict | None) -> Iterator[Quantity]:
    if verdict is None:
        return
    measured = {one.id: one for one in verdict.mirrors}
    for key, label, unit, digits, name in MEASURED:
        found = (getattr(measured.get(row.id), name, None) for row in rows)
        factor = UM_PER_MM if unit == "µm" else 1.0
        values = np.array([np.nan if value is None else factor * value for value in found])
        yield Quantity(key, label, unit, digits, values, added=key == "pixels")


def _designed(rows: Sequence[MirrorRow]) -> Iterator[Quantity]:
    def column(name: str) -> Floats:
        return columns(rows, name)[:, 0]

    yield Quantity("designed", "Coverage, as computed", "mm", 2, column("coverage_mm"))
    yield Quantity("radius", "Radius", "mm", 2, column("radius_mm"))
    yield Quantity("area", "Area of the cell", "mm²", 2, column("cell_area_mm2"), added=True)
    yield Quantity("polar", "Polar angle about the axis", "°", 2, column("polar_deg"), False)
    yield Quantity("azimuth", "Azimuth about the axis", "°", 2, column("azimuth_deg"), False)


def _balls(folder: Path) -> list[dict[str, Any]]:
    return [
        {
            "number": ball.number,
            "name": f"ball {ball.size}" if ball.kind != "cap" else ball.size,
            "apex": [ball.px, ball.py, ball.pz],
            "normal": [ball.nx, ball.ny, ball.nz],
            "radius": ball.radius_mm,
        }
        for ball in BallRow.read(folder)
    ]
