"""Tables of a prototype, read as text that nobody vouches for."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tbcad_verify.errors import BadExport
from tbcad_verify.record.fields import NAME, limited
from tbcad_verify.record.files import AGAIN, FileBytes
from tbcad_verify.types import Floats, Ints

PLAN_COLUMNS = (
    *("order", "object_turn_deg", "stop", "base_angle_deg", "ball", "mirror"),
    *("polar_error_deg", "azimuth_error_deg", "error_deg"),
)
STOP_COLUMNS = ("stop", "base_angle_deg", "mirrors", "balls", "azimuth_error_deg", "error_deg")
MOST_ROWS = 400_000
MOST_NUMBER = 1e9


@dataclass(frozen=True)
class Plan:
    """rotation_plan.csv, one row a mirror's picture, N of them; angles in degrees.

    Attributes:
        order: (N,) from 1.
        turn: (N,) of the object about z.
        stop: (N,) number, from 1.
        angle: (N,) of the base.
        ball: (N,) number, from 1.
        mirror: N ids.
        errors: (N, 3) of polar angle, of azimuth, and of direction, as recorded.
    """

    order: Ints
    turn: Floats
    stop: Ints
    angle: Floats
    ball: Ints
    mirror: tuple[str, ...]
    errors: Floats

    def __len__(self) -> int:
        """How many pictures."""
        return len(self.mirror)


@dataclass(frozen=True)
class Stops:
    """stops.csv, one row a stop, S of them; angles in degrees.

    Attributes:
        stop: (S,) number, from 1.
        angle: (S,) of the base.
        mirrors: (S,) how many are shown.
        balls: S tuples of the numbers of the balls that show them.
        errors: (S, 2) largest error of azimuth and of direction, as recorded.
    """

    stop: Ints
    angle: Floats
    mirrors: Ints
    balls: tuple[tuple[int, ...], ...]
    errors: Floats

    def __len__(self) -> int:
        """How many stops."""
        return len(self.stop)


def cells(blob: FileBytes, columns: Sequence[str]) -> list[list[str]]:
    """The fields of a CSV file below its head.

    Raises:
        BadExport: broken, of other columns, ragged, empty, or absurdly long.
    """
    try:
        lines = list(csv.reader(io.StringIO(blob.text()), strict=True))
    except csv.Error as error:
        raise BadExport(f"{blob.name}: broken CSV ({error}); {AGAIN}") from error
    if not lines or tuple(lines[0]) != tuple(columns):
        raise BadExport(f"{blob.name}: the first line must be {','.join(columns[:4])}...; {AGAIN}")
    for number, line in enumerate(lines[1:], 2):
        if len(line) != len(columns):
            raise BadExport(
                f"{blob.name}: line {number} has {len(line)} fields, not {len(columns)}: "
                f"truncated or foreign; {AGAIN}"
            )
    if not 1 < len(lines) <= MOST_ROWS + 1:
        raise BadExport(f"{blob.name}: {len(lines) - 1} rows; allowed are 1 to {MOST_ROWS}")
    return lines[1:]


def read_plan(blob: FileBytes) -> Plan:
    """The plan of rotation.

    Raises:
        BadExport: as `cells`, numbers that are none, or names that are none.
    """
    rows, of = _columns(blob, PLAN_COLUMNS), blob.name
    for number, name in enumerate(rows["mirror"], 2):
        if not NAME.fullmatch(name):
            raise BadExport(f"{of}: line {number}: mirror {name!r:.80} is no name; {AGAIN}")
    return Plan(
        _whole(of, rows, "order"),
        _numbers(of, rows, "object_turn_deg", 360),
        _whole(of, rows, "stop"),
        _numbers(of, rows, "base_angle_deg", 360),
        _whole(of, rows, "ball"),
        tuple(rows["mirror"]),
        np.stack([_numbers(of, rows, key, 360) for key in PLAN_COLUMNS[6:]], axis=1),
    )


def read_stops(blob: FileBytes) -> Stops:
    """The stops of the base.

    Raises:
        BadExport: as `cells`, or numbers that are none.
    """
    rows, of = _columns(blob, STOP_COLUMNS), blob.name
    return Stops(
        _whole(of, rows, "stop"),
        _numbers(of, rows, "base_angle_deg", 360),
        _whole(of, rows, "mirrors"),
        tuple(
            tuple(_integer(f"{of}: line {line}: balls", word) for word in words.split())
            for line, words in enumerate(rows["balls"], 2)
        ),
        np.stack([_numbers(of, rows, key, 360) for key in STOP_COLUMNS[4:]], axis=1),
    )


def _columns(blob: FileBytes, columns: Sequence[str]) -> dict[str, list[str]]:
    rows = cells(blob, columns)
    return {key: [row[k] for row in rows] for k, key in enumerate(columns)}


def _numbers(of: str, rows: dict[str, list[str]], key: str, most: float) -> Floats:
    return np.array(
        [
            limited(f"{of}: line {line}: {key}", number_in(word), -most, most)
            for line, word in enumerate(rows[key], 2)
        ]
    )


def number_in(word: str) -> float | str:
    """The number that a word is, or else the word."""
    try:
        value = float(word)
    except ValueError:
        return word
    return value if math.isfinite(value) else word


def _whole(of: str, rows: dict[str, list[str]], key: str) -> Ints:
    found = [_integer(f"{of}: line {n}: {key}", word) for n, word in enumerate(rows[key], 2)]
    return np.array(found, dtype=np.int64)


def _integer(what: str, word: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 10):
        raise BadExport(f"{what} must be a whole number, not {word!r:.40}; {AGAIN}")
    return int(word)
