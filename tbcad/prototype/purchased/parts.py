"""Purchased parts, one CSV file for each kind in this folder, and their prices.

Prices are tbcad's estimates in a CSV list, and lists of users before it.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from tbcad.core.spec.csv_rows import Row, check_unique, positive_number, read_rows, required_text
from tbcad.core.spec.errors import SpecError, short_text

COMMON_COLUMNS = ("part", "what", "material", "mass_g")
KINDS = (
    *("motors", "stages", "wheels", "belts", "couplings", "shafts", "bearings", "screws"),
    *("setscrews", "inserts", "dowels", "magnets", "leds", "strips", "stars", "sheets"),
    *("resistors", "wires", "connectors", "boards", "electronics", "extrusions", "tnuts", "nuts"),
    *("washers", "collars", "spacers", "brakes", "plates", "brackets", "tubes", "clamps", "rods"),
)
"""Lists of parts, in the order in which they are listed. Their own columns are sizes above zero.

shaft_length_mm is the length of a motor's shaft from the face that its screws pull on the plate.
radial_n is the load at the end of a motor's shaft that its bearings bear for 30,000 h.
hole_square_mm is the side of a square of holes, hole_circle_mm the diameter of a circle of holes.
Of a clamp length_mm and width_mm are those of its flange and its collar, flange_mm and height_mm
their heights; two holes of hole_mm are holes_mm apart. Of a corner bracket leg_mm is the length of
both legs, base_mm and side_mm are thicknesses of a leg and of a side, hole_mm is from the corner to
the middle of the slots, slot_mm their length.
"""
MAX_VALUE = 1e6  # of any size or mass
SAME_SIZE_MM = 1e-6  # sizes are equal up to rounding
PRICE_FIELDS = ("part", "each", "per_kg", "currency", "date", "source")
ESTIMATES = "estimates"  # tbcad's own list
MAX_PRICE = 1e6
CURRENCY = re.compile("[A-Z]{3}")  # ISO 4217
DATE = re.compile(r"\d{4}-(0[1-9]|1[0-2])(-(0[1-9]|[12]\d|3[01]))?")  # ISO 8601
CENTS = 2
EXAMPLE = re.compile(r" \(such as [^)]*\)")  # a maker's number, which nothing depends on
WEIGHED_DIGITS = 2  # a price by mass is an estimate whatever the list says


@dataclass(frozen=True)
class PurchasedPart:
    """A purchased part."""

    kind: str  # its list, one of KINDS
    name: str  # unique in all lists
    what: str  # description with standard
    material: str  # of it
    mass_g: float  # grams
    sizes: tuple[float, ...]  # numbers in the order of its list's columns, units in their names
    source: str  # where they come from

    def __getitem__(self, size: str) -> float:
        """One of the sizes, by the name of its column."""
        return self.sizes[sizes_of(self.kind).index(size)]


def without_example(what: str) -> str:
    """A description by standards and sizes, without the number of a supplier."""
    return EXAMPLE.sub("", what)


Parts = dict[str, PurchasedPart]
"""Purchased parts by name."""


def package_lists() -> Traversable:
    """The folder of tbcad's own lists."""
    return files("tbcad.prototype.purchased")


@cache
def sizes_of(kind: str) -> tuple[str, ...]:
    """Columns that describe a kind of part, by the header of tbcad's own list."""
    header = (package_lists() / f"{kind}.csv").read_text(encoding="utf-8").partition("\n")[0]
    return tuple(one for one in header.split(",") if one not in (*COMMON_COLUMNS, "source"))


def load_parts(folder: Traversable | None = None) -> Parts:
    """All purchased parts by name, from a folder with a CSV file for each kind, or tbcad's own.

    SpecError when a file is wrong; it names line and column.
    """
    folder, names, parts = folder or package_lists(), set[str](), []
    for kind in KINDS:
        name, columns = f"{kind}.csv", (*COMMON_COLUMNS, *sizes_of(kind), "source")
        for where, row in read_rows(folder / name, name, columns):
            check_unique(where, row, "part", names)
            parts.append(_part(where, kind, row))
    return {part.name: part for part in parts}


def _part(where: str, kind: str, row: Row) -> PurchasedPart:
    name, what, material, source = (
        required_text(where, row, column) for column in ("part", "what", "material", "source")
    )
    mass, *sizes = (
        positive_number(where, row, column, MAX_VALUE) for column in ("mass_g", *sizes_of(kind))
    )
    return PurchasedPart(kind, name, what, material, mass, tuple(sizes), source)


def of_kind(parts: Parts, kind: str, **sizes: float) -> list[PurchasedPart]:
    """Parts of one kind, of those only the ones with the sizes given by name, such as thread_mm."""
    return [
        part
        for part in parts.values()
        if part.kind == kind
        and all(abs(part[name] - value) < SAME_SIZE_MM for name, value in sizes.items())
    ]


def choose_part(
    parts: Parts, kind: str, key: str, hint: str, order: str = "length_mm", **sizes: float
) -> PurchasedPart:
    """The smallest purchased part of a kind that has all sizes, and at least the size in order.

    SpecError when the list has none; it names the key of the spec that asks for it, and the hint
    what to change.
    """
    exact = {size: value for size, value in sizes.items() if size != order}
    candidates = [
        part for part in of_kind(parts, kind, **exact) if part[order] >= sizes.get(order, 0.0)
    ]
    if not candidates:
        required = ", ".join(f"{size} {value:.4g}" for size, value in sizes.items())
        raise SpecError(f"no part with {required} in {kind}.csv, which {key} needs: {hint}")
    return min(candidates, key=lambda part: part[order])


def choose_screw(parts: Parts, thread: float, length: float) -> PurchasedPart:
    """The shortest socket head screw of a thread that is at least so long, mm."""
    hint = "make prototype.frame.flange_mm smaller"
    key = "prototype.frame.flange_mm"
    return choose_part(parts, "screws", key, hint, thread_mm=thread, length_mm=length)


@dataclass(frozen=True)
class Price:
    """Price of one piece."""

    amount: float  # in the currency
    currency: str  # by ISO 4217
    date: str  # year and month, or day, at which it held
    source: str  # where it comes from


@dataclass(frozen=True)
class PriceRule:
    """A line of a list."""

    pattern: str  # name of a part, `*` for any characters
    each: float  # price of a piece without what follows from its mass
    per_kg: float  # price of a kilogram
    currency: str  # of both
    date: str  # at which they held
    source: str  # where they come from

    def price(self, mass_g: float) -> Price:
        """Of a piece of a mass (g); by mass it is rounded to two digits."""
        amount = self.each + self.per_kg * mass_g / 1000
        if self.per_kg:
            amount = float(f"{amount:.{WEIGHED_DIGITS}g}")
        return Price(round(amount, CENTS), self.currency, self.date, self.source)


@dataclass(frozen=True)
class Prices:
    """Rules in the order in which they are asked."""

    rules: tuple[PriceRule, ...]

    def of(self, part: str, mass_g: float) -> Price | None:
        """The price of one piece by the first rule that fits its name; None without any."""
        fitting = (rule for rule in self.rules if fnmatchcase(part, rule.pattern))
        return next((rule.price(mass_g) for rule in fitting), None)


def load_prices(names: Iterable[str]) -> Prices:
    """The rules of several lists, those of the first list first.

    A list is "estimates", or the path of a CSV file (from the current folder) with PRICE_FIELDS.

    SpecError: a list that cannot be read, or is wrong; it names line and column.
    """
    return Prices(tuple(rule for name in names for rule in _rules(_file(name), name)))


def _file(name: str) -> Path | Traversable:
    if name == ESTIMATES:
        return package_lists() / "prices.csv"
    if not Path(name).is_file():
        raise SpecError(
            f"prototype.prices: {short_text(name)} is neither {ESTIMATES} nor a file: name one of "
            "these"
        )
    return Path(name)


def _rules(file: Path | Traversable, name: str) -> Iterator[PriceRule]:
    patterns = set[str]()
    for where, row in read_rows(file, name, PRICE_FIELDS, ("each", "per_kg")):
        pattern = required_text(where, row, "part")
        check_unique(where, row, "part", patterns)
        each, per_kg = (
            positive_number(where, row, column, MAX_PRICE) if row[column] else 0.0
            for column in ("each", "per_kg")
        )
        if not each and not per_kg:
            raise SpecError(f"{where}: no price: fill in column each, per_kg or both")
        currency = _matching(where, row, "currency", CURRENCY, "three letters such as EUR")
        date = _matching(where, row, "date", DATE, "a month or day such as 2026-11")
        source = required_text(where, row, "source")
        yield PriceRule(pattern, each, per_kg, currency, date, source)


def _matching(where: str, row: Row, column: str, form: re.Pattern[str], allowed: str) -> str:
    if not form.fullmatch(row[column]):
        raise SpecError(
            f"{where}, column {column}: {short_text(row[column])}, allowed is {allowed}: change it"
        )
    return row[column]
