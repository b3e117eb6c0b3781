"""Balls on sale: catalogues of sizes and the grades of ISO 3290-1, from CSV files."""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from tbcad.errors import InputError
from tbcad.spec.errors import SpecError, shown
from tbcad.types import Floats

Row = dict[str, str]

DENSITY_G_CM3 = 7.81  # 100Cr6 (AISI 52100), the usual steel of bearing balls
BUILT_IN = ("metric", "inch")
COLUMNS = ("size", "diameter_mm", "standard", "grades", "mass_g", "source")
GRADE_COLUMNS = (
    *("grade", "sphericity_um", "diameter_variation_um", "roughness_ra_um", "lot_variation_um"),
    "standard",
)
_LARGEST_FILE = 1_000_000  # characters; a catalogue is a few thousand


@dataclass(frozen=True)
class Catalogue:
    """Balls on sale by rising diameter, over s of them.

    Attributes:
        size: names of the sizes.
        diameter: mm, (s,).
        mass_g: grams, (s,).
        grades: grades each is sold in.
        standard: standard that names those grades.
        source: where each row comes from.
    """

    size: tuple[str, ...]
    diameter: Floats
    mass_g: Floats
    grades: tuple[frozenset[str], ...]
    standard: tuple[str, ...]
    source: tuple[str, ...]

    def __len__(self) -> int:
        """Number of sizes."""
        return len(self.size)

    def only(self, grade: str, largest: float) -> "Catalogue":
        """The sizes sold in a grade and no larger than a diameter (mm).

        Raises:
            SpecError: when none is left.
        """
        kept = [i for i in range(len(self)) if grade in self.grades[i]]
        kept = [i for i in kept if self.diameter[i] <= largest]
        if not kept:
            raise SpecError(
                f"no ball of grade {grade} up to {largest:g} mm is in prototype.catalogues: change "
                "prototype.grade, prototype.largest_ball_mm or the catalogues"
            )
        return self._at(kept)

    def _at(self, kept: Sequence[int]) -> "Catalogue":
        return Catalogue(
            tuple(self.size[i] for i in kept),
            self.diameter[list(kept)],
            self.mass_g[list(kept)],
            tuple(self.grades[i] for i in kept),
            tuple(self.standard[i] for i in kept),
            tuple(self.source[i] for i in kept),
        )


@dataclass(frozen=True)
class Grade:
    """What a grade promises, micrometres, largest values (ISO 3290-1)."""

    grade: str
    sphericity_um: float
    diameter_variation_um: float
    roughness_ra_um: float
    lot_variation_um: float
    standard: str


def load_grades() -> dict[str, Grade]:
    """All grades by name, the best first."""
    text = _built_in("grades")
    return {row["grade"]: _grade(row) for _, row in table_rows("grades", text, GRADE_COLUMNS)}


def _grade(row: Row) -> Grade:
    form, size, roughness, lot = (float(row[key]) for key in GRADE_COLUMNS[1:5])
    return Grade(row["grade"], form, size, roughness, lot, row["standard"])


def load_catalogue(names: Iterable[str]) -> Catalogue:
    """Return the balls of several catalogues as one, by rising diameter.

    Args:
        names: "metric", "inch", or paths of CSV files (from the current folder) with the columns
            of COLUMNS; an empty mass is that of steel. Of equal diameters the first one counts.

    Raises:
        SpecError: a catalogue that cannot be read, is empty or wrong, with line and column.
    """
    rows = [row for name in names for row in _checked(name)]
    if not rows:
        raise SpecError("prototype.catalogues names no catalogue: add metric or inch")
    unique = {float(row["diameter_mm"]): row for row in reversed(rows)}
    ordered = [unique[diameter] for diameter in sorted(unique)]
    return Catalogue(
        tuple(row["size"] for row in ordered),
        np.array([float(row["diameter_mm"]) for row in ordered]),
        np.array([_mass(row) for row in ordered]),
        tuple(frozenset(row["grades"].split()) for row in ordered),
        tuple(row["standard"] for row in ordered),
        tuple(row["source"] for row in ordered),
    )


def steel_mass_g(diameter: float) -> float:
    """Mass of a steel ball of a diameter in mm, grams."""
    return DENSITY_G_CM3 * 1e-3 * math.pi / 6 * diameter**3


def _mass(row: Row) -> float:
    return float(row["mass_g"]) if row["mass_g"] else steel_mass_g(float(row["diameter_mm"]))


def _built_in(name: str) -> str:
    return (
        files("tbcad.prototype.balls")
        .joinpath("catalogues", f"{name}.csv")
        .read_text(encoding="utf-8")
    )


def _checked(name: str) -> list[Row]:
    text = _built_in(name) if name in BUILT_IN else _read(Path(name), name)
    known, sizes, rows = set(load_grades()), set[str](), []
    for where, row in table_rows(name, text, COLUMNS):
        _check(where, row, known)
        if row["size"] in sizes:
            raise SpecError(f"{where}, column size: {shown(row['size'])} twice: remove one")
        sizes.add(row["size"])
        rows.append(row)
    if not rows:
        raise SpecError(f"{name}: an empty catalogue: add a line for each ball")
    return rows


def _check(where: str, row: Row, known: set[str]) -> None:
    if not row["size"]:
        raise SpecError(f"{where}, column size: empty: name the size")
    check_number(where, "diameter_mm", row["diameter_mm"], 1000)
    if row["mass_g"]:
        check_number(where, "mass_g", row["mass_g"], 1e7)
    grades = row["grades"].split()
    if not grades or not known.issuperset(grades):
        raise SpecError(
            f"{where}, column grades: {shown(row['grades'])}, allowed are "
            f"{' '.join(load_grades())} with spaces between: change it"
        )


def check_number(where: str, column: str, text: str, most: float) -> None:
    """Refuse a text that is no number above 0 to most.

    Raises:
        SpecError: it names the place, the column and what is allowed.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value <= most:
        raise SpecError(
            f"{where}, column {column}: {shown(text)}, allowed is a number above 0 to {most:g}: "
            "change it"
        )


def _read(path: Path, name: str) -> str:
    try:
        if not path.is_file():
            raise SpecError(
                f"prototype.catalogues: {name} is neither {' nor '.join(BUILT_IN)} nor a file: "
                "name one of these"
            )
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise SpecError(f"{name}: cannot be read: {reason}: check the file") from None
    if len(text) > _LARGEST_FILE:
        raise SpecError(f"{name}: over 1 MB, no catalogue: name another file")
    return text


def table_rows(name: str, text: str, columns: Sequence[str]) -> Iterator[tuple[str, Row]]:
    """Each row with its place in words; the header must be exactly the columns.

    Raises:
        SpecError: when the text is no such table; it names the line.
    """
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        header = [cell.strip() for cell in next(reader, [])]
        if header != list(columns):
            raise SpecError(f"{name}, line 1: the columns must be {','.join(columns)}: change it")
        for cells in reader:
            where = f"{name}, line {reader.line_num}"
            if len(cells) not in (0, len(columns)):
                raise SpecError(f"{where}: {len(cells)} columns, not {len(columns)}: correct it")
            if cells:
                stripped = (cell.strip() for cell in cells)
                yield where, dict(zip(columns, stripped, strict=True))
    except csv.Error as error:
        raise SpecError(f"{name}, line {reader.line_num}: {error}: correct it") from None
