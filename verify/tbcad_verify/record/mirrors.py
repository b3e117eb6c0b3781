"""The mirrors as recorded, once in design.json and once in mirrors.csv."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.errors import BadExport
from tbcad_verify.record.fields import limited
from tbcad_verify.record.files import AGAIN, FileBytes
from tbcad_verify.types import Floats

# fmt: off
COLUMNS = (
    "id", "camera", "ux", "uy", "uz", "px", "py", "pz", "nx", "ny", "nz", "cx", "cy", "cz",
    "radius_mm", "size_mm", "theta0_deg", "theta1_deg", "polar_deg", "azimuth_deg",
    "cell_area_mm2", "coverage_mm",
)
# fmt: on
NUMBERS = COLUMNS[2:]
MAY_BE_EMPTY = frozenset({"cx", "cy", "cz", "radius_mm"})
MOST = 200_000


@dataclass(frozen=True)
class Mirrors:
    """One mirror a row, M of them, in the record's own order.

    Attributes:
        ids: names.
        camera: (M,) camera ids.
        table: (M, 20), the columns `NUMBERS`; NaN where empty (planar mirrors).
    """

    ids: tuple[str, ...]
    camera: NDArray[np.str_]
    table: Floats

    def __len__(self) -> int:
        """How many mirrors."""
        return len(self.ids)

    def columns(self, first: str, count: int = 1) -> Floats:
        """Consecutive columns, shape (count, M)."""
        start = NUMBERS.index(first)
        return np.ascontiguousarray(self.table[:, start : start + count].T)

    def take(self, index: NDArray[np.integer]) -> Mirrors:
        """The mirrors with these numbers, in this order."""
        return Mirrors(
            tuple(self.ids[k] for k in index.tolist()), self.camera[index], self.table[index]
        )

    @property
    def flat(self) -> NDArray[np.bool_]:
        """(M,) true for planar mirrors, which have no radius."""
        return np.asarray(np.isnan(self.columns("radius_mm")[0]))


def from_json(items: Sequence[dict[str, Any]]) -> Mirrors:
    """Mirrors from design.json's list of objects.

    Raises:
        BadExport: missing or non-numeric fields, or an absurd count.
    """
    rows = [[_value(item, key) for key in NUMBERS] for item in items]
    return _mirrors("design.json", [(str(m.get("id")), str(m.get("camera"))) for m in items], rows)


def from_csv(blob: FileBytes) -> Mirrors:
    """Mirrors from mirrors.csv; columns after the known ones are left alone.

    Raises:
        BadExport: broken, truncated or foreign, numbers that are not finite, or an absurd count.
    """
    try:
        lines = list(csv.reader(io.StringIO(blob.text()), strict=True))
    except csv.Error as error:
        raise BadExport(f"{blob.name}: broken CSV ({error}); {AGAIN}") from error
    _refuse_ragged(blob.name, lines)
    rows = [
        [_field(line[k], key, line[0]) for k, key in enumerate(NUMBERS, 2)] for line in lines[1:]
    ]
    return _mirrors(blob.name, [(line[0], line[1]) for line in lines[1:]], rows)


def _refuse_ragged(name: str, lines: list[list[str]]) -> None:
    if not lines or tuple(lines[0][: len(COLUMNS)]) != COLUMNS:
        raise BadExport(f"{name}: the first line must begin {','.join(COLUMNS[:5])}...; {AGAIN}")
    width = len(lines[0])
    for number, line in enumerate(lines[1:], 2):
        if len(line) != width:
            raise BadExport(
                f"{name}: line {number} has {len(line)} fields, not {width}: truncated or "
                f"foreign; {AGAIN}"
            )


def _value(item: dict[str, Any], key: str) -> float:
    value = item.get(key)
    if value is None and key in MAY_BE_EMPTY:
        return math.nan
    return limited(f"design.json: mirror {item.get('id')!r:.20} {key}", value, -1e12, 1e12)


def _field(word: str, key: str, mirror: str) -> float:
    if not word and key in MAY_BE_EMPTY:
        return math.nan
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadExport(
            f"mirrors.csv: {mirror!r:.20} {key} is {word!r:.40}, no finite number; {AGAIN}"
        )
    return value


def _mirrors(name: str, labels: list[tuple[str, str]], rows: list[list[float]]) -> Mirrors:
    if not 0 < len(rows) <= MOST:
        raise BadExport(f"{name}: {len(rows)} mirrors; allowed are 1 to {MOST}; {AGAIN}")
    ids, cameras = zip(*labels, strict=True)
    return Mirrors(tuple(ids), np.array(cameras), np.array(rows, dtype=np.float64))
