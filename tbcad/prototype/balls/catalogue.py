"""Balls on sale: catalogues of sizes and the grades of ISO 3290-1, from CSV files."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from functools import cache, cached_property
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING

from tbcad.core.spec.csv_rows import Row, check_unique, positive_number, read_rows, required_text
from tbcad.core.spec.errors import SpecError, short_text

if TYPE_CHECKING:
    from tbcad.types import Floats

STEEL_DENSITY_G_CM3 = 7.81  # 100Cr6 (AISI 52100), the usual steel of bearing balls
BUILT_IN = ("metric", "inch")
FINEST = "G10"  # that shops stock in all sizes it is sold in; finer ones are made to order
MAX_DIAMETER_MM = 1000.0
MAX_MASS_G = 1e7

RQ_OVER_RA = 1.25  # of normally distributed heights


@dataclass(frozen=True)
class StockBall:
    """A ball on sale."""

    size: str  # name of the size
    diameter_mm: float  # nominal diameter
    standard: str  # standard that names the grades
    grades: frozenset[str]  # grades it is sold in
    mass_g: float  # mass of one ball
    source: str  # where these figures come from

    def bought_grade(self, coarsest: str) -> str | None:
        """The best grade from FINEST to the coarsest that it is sold in, or else a finer one.

        None when it is sold in coarser ones only. ISO 3290-1 limits the roughness of a grade, and
        with it the light that a ball scatters.
        """
        names = [*load_grades()]
        last = names.index(coarsest)
        first = min(names.index(FINEST), last)
        wanted = (*names[first : last + 1], *reversed(names[:first]))
        return next((grade for grade in wanted if grade in self.grades), None)


COLUMNS = tuple(field.name for field in fields(StockBall))


@dataclass(frozen=True)
class Catalogue:
    """Balls on sale by rising diameter, s of them."""

    balls: tuple[StockBall, ...]

    def __len__(self) -> int:
        return len(self.balls)

    @cached_property
    def diameter(self) -> "Floats":
        """Diameters, mm, (s,)."""
        import numpy as np  # only here: grades are read before anything takes long

        return np.array([ball.diameter_mm for ball in self.balls])

    @cached_property
    def mass_g(self) -> "Floats":
        """Masses, grams, (s,)."""
        import numpy as np

        return np.array([ball.mass_g for ball in self.balls])

    def available(self, grade: str, max_diameter: float) -> "Catalogue":
        """The sizes sold in a grade, or a better one, up to a diameter (mm).

        SpecError when there are none.
        """
        balls = tuple(
            ball
            for ball in self.balls
            if ball.bought_grade(grade) and ball.diameter_mm <= max_diameter
        )
        if not balls:
            raise SpecError(
                f"no ball of grade {grade} up to {max_diameter:g} mm is in prototype.catalogues: "
                "change prototype.grade, prototype.largest_ball_mm or the catalogues"
            )
        return Catalogue(balls)


@dataclass(frozen=True)
class Grade:
    """Maximum deviations that a grade allows, micrometres (ISO 3290-1)."""

    grade: str
    sphericity_um: float
    diameter_variation_um: float
    roughness_ra_um: float
    lot_variation_um: float
    standard: str


GRADE_COLUMNS = tuple(field.name for field in fields(Grade))


@cache
def load_grades() -> dict[str, Grade]:
    """All grades by name, the best first."""
    grades = {}
    for _, row in read_rows(_built_in("grades"), "grades", GRADE_COLUMNS):
        grade, *deviations, standard = row.values()
        sphericity, diameter, roughness, lot = map(float, deviations)
        grades[grade] = Grade(grade, sphericity, diameter, roughness, lot, standard)
    return grades


def roughness_rq_nm(grade: str | None) -> float:
    """RMS roughness at the limit of a grade, nm; of a cap, which has none, what it is polished to.

    Rq is 1.25 Ra, as of normally distributed heights.
    """
    if grade is None:
        from tbcad.core.optics.reflection import roughness_nm  # numpy: not for help and bad input

        return roughness_nm()
    return 1000 * RQ_OVER_RA * load_grades()[grade].roughness_ra_um


def recorded_roughness_nm(exports: Path) -> list[float]:
    """RMS roughness of each ball of a build, nm; InputError: its table of balls is broken."""
    from tbcad.records.tables import BallRow

    return [roughness_rq_nm(ball.grade) for ball in BallRow.read(exports)]


def load_catalogue(names: Iterable[str]) -> Catalogue:
    """The balls of several catalogues as one by rising diameter; of equal ones the first counts.

    Names are "metric", "inch", or paths of CSV files (from the current folder) with the columns of
    COLUMNS; an empty mass is that of steel. SpecError names line and column of what is wrong.
    """
    by_diameter: dict[float, StockBall] = {}
    for name in names:
        for ball in _load(name):
            by_diameter.setdefault(ball.diameter_mm, ball)
    if not by_diameter:
        raise SpecError("prototype.catalogues names no catalogue: add metric or inch")
    return Catalogue(tuple(by_diameter[diameter] for diameter in sorted(by_diameter)))


def steel_mass_g(diameter: float) -> float:
    """Mass of a steel ball of a diameter in mm, grams."""
    return STEEL_DENSITY_G_CM3 * 1e-3 * math.pi / 6 * diameter**3


def _built_in(name: str) -> Traversable:
    return files("tbcad.prototype.balls") / "catalogues" / f"{name}.csv"


def _load(name: str) -> list[StockBall]:
    file = _built_in(name) if name in BUILT_IN else Path(name)
    if not file.is_file():
        raise SpecError(
            f"prototype.catalogues: {short_text(name)} is neither {' nor '.join(BUILT_IN)} nor a "
            "file: name one of these"
        )
    balls = list(_balls(file, name))
    if not balls:
        raise SpecError(f"{name}: an empty catalogue: add a line for each ball")
    return balls


def _balls(file: Path | Traversable, name: str) -> Iterator[StockBall]:
    known_grades, sizes = frozenset(load_grades()), set[str]()
    for where, row in read_rows(file, name, COLUMNS, ("diameter_mm", "mass_g")):
        size = required_text(where, row, "size")
        check_unique(where, row, "size", sizes)
        diameter = positive_number(where, row, "diameter_mm", MAX_DIAMETER_MM)
        grades = _grades(where, row, known_grades)
        mass = steel_mass_g(diameter)
        if row["mass_g"]:
            mass = positive_number(where, row, "mass_g", MAX_MASS_G)
        yield StockBall(size, diameter, row["standard"], grades, mass, row["source"])


def _grades(where: str, row: Row, known_grades: frozenset[str]) -> frozenset[str]:
    grades = frozenset(row["grades"].split())
    if not grades or not grades <= known_grades:
        raise SpecError(
            f"{where}, column grades: {short_text(row['grades'])}, allowed are "
            f"{' '.join(load_grades())} with spaces between: change it"
        )
    return grades
