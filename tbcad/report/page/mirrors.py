"""Arrays as text in a page, and what the page knows of each mirror."""

import base64
import zlib
from collections.abc import Iterator, Mapping, Sequence
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


class Quantity(NamedTuple):
    """A figure of every mirror."""

    key: str  # short name
    label: str  # what it is
    unit: str  # of the values
    digits: int  # after the point
    values: Floats  # (m,); NaN is unknown
    on_map: bool = True  # whether the map can show it
    added: bool = False  # whether both halves of a mirror on the seam add up


def packed_mirrors(folder: Path, verdict: Verdict | None, arrays: PackedArrays) -> dict[str, Any]:
    """All mirrors of both cameras for the page, with the prototype's balls if there are any."""
    rows = MirrorRow.read(folder)
    plan = _plan(folder)
    quantities = [*_verified(rows, verdict), *_designed(rows), *_pointing(rows, plan)]
    known = [one for one in quantities if np.isfinite(one.values).any()]
    return {
        "ids": [row.id for row in rows],
        "pose": arrays.add(columns(rows, "ux uy uz px py pz nx ny nz"), "Float32Array"),
        "radius": arrays.add(np.array([row.radius_mm or np.inf for row in rows]), "Float32Array"),
        "size": arrays.add(columns(rows, "size_mm")[:, 0], "Float32Array"),
        "quantities": [_packed(one, arrays) for one in known],
        "plan": [_photograph(plan.get(row.id)) for row in rows] if plan else [],
        "balls": _balls(folder) if plan else [],
    }


def _verified(rows: Sequence[MirrorRow], verdict: Verdict | None) -> Iterator[Quantity]:
    if verdict is None:
        return
    measured = {one.id: one for one in verdict.mirrors}

    def column(name: str, factor: float = 1.0) -> Floats:
        found = (getattr(measured.get(row.id), name, None) for row in rows)
        return np.array([np.nan if value is None else factor * value for value in found])

    yield Quantity(
        "covered", "Coverage, on the spheres in the files", "mm", 2, column("coverage_fitted_mm")
    )
    yield Quantity(
        "facets", "Coverage, on the facets in the files", "mm", 2, column("coverage_facet_mm")
    )
    yield Quantity("pixels", "Pixels", "", 0, column("pixels"), added=True)
    yield Quantity(
        "centre", "Centre in the files, off by", "µm", 3, column("centre_error_mm", UM_PER_MM)
    )
    yield Quantity(
        "radius_error",
        "Radius in the files, off by",
        "µm",
        3,
        column("radius_error_mm", UM_PER_MM),
    )


def _designed(rows: Sequence[MirrorRow]) -> Iterator[Quantity]:
    def column(name: str) -> Floats:
        return columns(rows, name)[:, 0]

    yield Quantity("designed", "Coverage, as computed", "mm", 2, column("coverage_mm"))
    yield Quantity("radius", "Radius", "mm", 2, column("radius_mm"))
    yield Quantity("area", "Area of the cell", "mm²", 2, column("cell_area_mm2"), added=True)
    yield Quantity("polar", "Polar angle about the axis", "°", 2, column("polar_deg"), False)
    yield Quantity("azimuth", "Azimuth about the axis", "°", 2, column("azimuth_deg"), False)


def _pointing(rows: Sequence[MirrorRow], plan: Mapping[str, PictureRow]) -> Iterator[Quantity]:
    found = (plan.get(row.id) for row in rows)
    values = np.array([np.nan if one is None else one.error_deg for one in found])
    yield Quantity("pointing", "Prototype: direction off by", "°", 2, values)


def _packed(quantity: Quantity, arrays: PackedArrays) -> dict[str, Any]:
    return {
        "key": quantity.key,
        "label": quantity.label,
        "unit": quantity.unit,
        "digits": quantity.digits,
        "map": quantity.on_map,
        "added": quantity.added,
        "values": arrays.add(quantity.values, "Float32Array"),
    }


def _plan(folder: Path) -> dict[str, PictureRow]:
    """The photograph of each mirror by its ball; none without a prototype."""
    if not (folder / PictureRow.FILE).is_file():
        return {}
    return {row.mirror: row for row in PictureRow.read(folder)}


def _photograph(row: PictureRow | None) -> list[float] | None:
    """Ball, stop, angle of the base and turn of the object, degrees."""
    if row is None:
        return None
    return [row.ball, row.stop, round(row.base_angle_deg, 4), row.object_turn_deg]


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
