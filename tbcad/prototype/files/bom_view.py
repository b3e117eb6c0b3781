"""The parts list of an export, read back and shown: totals first, then rows."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tbcad.cad.formats.checked_files import Row
from tbcad.core.spec.csv_rows import read_rows
from tbcad.core.spec.errors import SpecError
from tbcad.errors import InputError
from tbcad.prototype.files.bom_csv import (
    BOUGHT,
    COLUMNS,
    NAME,
    NUMBERS,
    PRINT_MATERIAL,
    PRINTED,
    WHOLE,
    price_columns,
    totals,
)
from tbcad.prototype.purchased.prices import Prices

SHOWN = 6  # rows without --full
WIDTH = 80  # columns of a terminal
WHAT = 34  # of them for what a part is
PART = 17
DAY_H, KG_G = 24.0, 1000.0


@dataclass(frozen=True)
class PartsList:
    """Rows of bom.csv, and their sums."""

    rows: tuple[Row, ...]

    def record(self) -> dict[str, Any]:
        """For other programs: the sums, then all rows by the columns of bom.csv."""
        return {"totals": totals(self.rows), "rows": [*self.rows]}

    def lines(self, *, full: bool) -> list[str]:
        """At most 80 columns: the sums, and all rows or the dearest."""
        return [*_sums(self.rows), *_table(self.rows if full else _dearest(self.rows))]


def read_parts_list(folder: Path, prices: Prices | None = None) -> PartsList:
    """The parts list of an export.

    Args:
        folder: written by a build.
        prices: in place of those of the build; parts without one keep theirs.

    Raises:
        InputError: no such list, or a broken one; it names the line.
    """
    path = folder / NAME
    if not path.is_file():
        raise InputError(f"{path} is not there: name a folder with a prototype by tbcad build")
    rows = [_row(where, cells) for where, cells in read_rows(path, NAME, COLUMNS, NUMBERS)]
    return PartsList(tuple(_priced(row, prices) for row in rows) if prices else tuple(rows))


def _row(where: str, cells: Mapping[str, str]) -> Row:
    row: Row = {**cells}
    for column in NUMBERS:
        try:
            number = float(cells[column]) if cells[column] else None
        except ValueError:
            raise SpecError(f"{where}, column {column}: no number: build again") from None
        row[column] = int(number) if number is not None and column in WHOLE else number
    if cells["from"] not in (BOUGHT, PRINTED):
        raise SpecError(f"{where}, column from: allowed is bought or printed: build again")
    return row


def _priced(row: Row, prices: Prices) -> Row:
    printed = row["from"] == PRINTED
    part = PRINT_MATERIAL if printed else str(row["part"])
    mass = float(row["filament_g" if printed else "mass_g"] or 0)
    found = prices.of(part, mass)
    return {**row, **price_columns(int(row["quantity"] or 0), found)} if found else row


def _sums(rows: Sequence[Row]) -> Iterator[str]:
    sums = totals(rows)
    bought = [row for row in rows if row["from"] == BOUGHT]
    without = sums["without_price"]
    unknown = f", {without} of them without a price" if without else ""
    yield f"{len(bought)} kinds of parts to buy: {_money(sums['bought_price'])}{unknown}"
    kg, hours = sums["filament_g"] / KG_G, sums["print_hours"]
    yield (
        f"{len(rows) - len(bought)} parts to print: {kg:.1f} kg of filament, "
        f"{_money(sums['filament_price'])}, {hours:.0f} h ({hours / DAY_H:.1f} days)"
    )
    yield f"{sums['mass_g'] / KG_G:.1f} kg in all, printed parts as solids; prices are estimates"
    yield "not in the list: camera, lens, computer, tools, paint"


def _money(prices: Mapping[str, float]) -> str:
    return " + ".join(f"{amount:.0f} {name}" for name, amount in prices.items()) or "no prices"


def _dearest(rows: Sequence[Row]) -> list[Row]:
    """The rows that cost most; what has no price is last."""
    return sorted(rows, key=lambda row: -float(row["total_price"] or 0))[:SHOWN]


def _table(rows: Sequence[Row]) -> Iterator[str]:
    yield f"{'item':>4} {'qty':>3} {'part':<{PART}} {'what':<{WHAT}} {'price':>8}"
    for row in rows:
        part, what = _cut(str(row["part"]), PART), _cut(str(row["what"]), WHAT)
        price = "-" if row["total_price"] is None else f"{float(row['total_price']):.2f}"
        yield (
            f"{row['item']:>4} {row['quantity']:>3} {part:<{PART}} {what:<{WHAT}} {price:>8}  "
            f"{row['currency'] or ''}"
        ).rstrip()


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else f"{text[: width - 3]}..."
