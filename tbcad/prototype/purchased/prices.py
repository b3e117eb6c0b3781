"""Prices of what is bought: tbcad's estimates in a CSV list, and lists of users before it."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from importlib.resources.abc import Traversable
from pathlib import Path

from tbcad.core.spec.csv_rows import Row, check_unique, positive_number, read_rows, required_text
from tbcad.core.spec.errors import SpecError, short_text
from tbcad.prototype.purchased.parts import package_lists

COLUMNS = ("part", "each", "per_kg", "currency", "date", "source")
ESTIMATES = "estimates"  # tbcad's own list
MAX_PRICE = 1e6
CURRENCY = re.compile("[A-Z]{3}")  # ISO 4217
DATE = re.compile(r"\d{4}-(0[1-9]|1[0-2])(-(0[1-9]|[12]\d|3[01]))?")  # ISO 8601
CENTS = 2
WEIGHED_DIGITS = 2  # a price by mass is an estimate whatever the list says


@dataclass(frozen=True)
class Price:
    """What one piece costs."""

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
        for rule in self.rules:
            if fnmatchcase(part, rule.pattern):
                return rule.price(mass_g)
        return None


def load_prices(names: Iterable[str]) -> Prices:
    """The rules of several lists, those of the first list first.

    Args:
        names: "estimates", or paths of CSV files (from the current folder) with the columns of
            COLUMNS.

    Raises:
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
    for where, row in read_rows(file, name, COLUMNS, ("each", "per_kg")):
        pattern = required_text(where, row, "part")
        check_unique(where, row, "part", patterns)
        each, per_kg = (_amount(where, row, column) for column in ("each", "per_kg"))
        if not each and not per_kg:
            raise SpecError(f"{where}: no price: fill in column each, per_kg or both")
        currency = _matching(where, row, "currency", CURRENCY, "three letters such as EUR")
        date = _matching(where, row, "date", DATE, "a month or day such as 2026-11")
        source = required_text(where, row, "source")
        yield PriceRule(pattern, each, per_kg, currency, date, source)


def _amount(where: str, row: Row, column: str) -> float:
    return positive_number(where, row, column, MAX_PRICE) if row[column] else 0.0


def _matching(where: str, row: Row, column: str, form: re.Pattern[str], allowed: str) -> str:
    if not form.fullmatch(row[column]):
        raise SpecError(
            f"{where}, column {column}: {short_text(row[column])}, allowed is {allowed}: change it"
        )
    return row[column]
