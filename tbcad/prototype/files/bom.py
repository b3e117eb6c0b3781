"""bom.csv: everything to buy and to print."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

from tbcad.cad.formats.checked_files import Row
from tbcad.core.spec.csv_rows import read_rows
from tbcad.core.spec.errors import SpecError, short_text
from tbcad.errors import InputError
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.purchased.parts import Parts, Price, Prices, PurchasedPart

# A body, a number with its part, and a letter of its form, such as "DIN 705 A" or "ISO 3290-1".
STANDARD = re.compile(r"\b(?:ISO|DIN|EN|IEC|ASME|ANSI) (?:[A-Z]+)?\d+(?:[.-]\d+)*(?: [A-Z](?= ))?")
NAME = "bom.csv"
PRICE_COLUMNS = ("unit_price", "total_price", "currency", "price_date", "price_source")
COLUMNS = (
    *("item", "quantity", "part", "what", "standard", "material", "mass_g", "total_mass_g"),
    *("print_volume_mm3", "filament_g", "print_hours"),
    *PRICE_COLUMNS,
    "from",
)
WHOLE = ("item", "quantity", "print_volume_mm3")
NUMBERS = (*WHOLE, "mass_g", "total_mass_g", "filament_g", "print_hours", *PRICE_COLUMNS[:2])
ALWAYS = {"DRIVER-2A": 1, "FUSE-2A": 1, "GLUE-EPOXY": 1, "SUPPLY-24V": 1}
# Magnetic and hardened, so that magnets hold it and it polishes; AISI 52100. 316 is not magnetic.
BALL_STEEL = "100Cr6"
PRINT_MATERIAL = "PETG"
GRAM_DECIMALS, CENTS = 2, 2
ESTIMATE_DIGITS = 2  # of what a model says of a print, and of masses below 0.1 g
LIGHT_G = 0.1
KINDS = BOUGHT, PRINTED = "bought", "printed"
TOOL = "tool"  # of rows that are no parts of the machine
TOOL_LIST = "tools.csv"
TOOL_MARK = "tool: "  # of what is printed to assemble the others
MM3_PER_CM3 = 1000.0
SHOWN = 6  # rows without --full
WHAT, PART = 34, 17  # columns, of the 80 of a terminal
DAY_H, KG_G = 24.0, 1000.0


def standard_in(what: str) -> str:
    """The first standard that a description names; empty without any."""
    found = STANDARD.search(what)
    return found[0] if found else ""


@dataclass(frozen=True)
class PrintedItem:
    """A part to be printed."""

    name: str  # of the part and of its files
    what: str  # it is for
    volume: float  # mm^3
    estimate: tuple[float, float]  # of its print: filament in mm^3, hours
    material: str = PRINT_MATERIAL  # of it
    tool: bool = False  # whether it is no part of the machine
    density: float | None = None  # g/cm^3; None: the printer's
    finish: str | None = None  # that has a price of its own beside the material's
    turned: bool = False  # made to order, not printed


def bom_rows(
    prototype: PrototypeLayout,
    drive: Drive,
    purchased: Mapping[str, int],
    printed: Iterable[PrintedItem],
    density: float,
    parts: Parts,
    prices: Prices,
) -> list[Row]:
    """One record for each kind of part, in the order of COLUMNS, items numbered from 1.

    Balls come first, by size, then the drive, other purchased parts by their quantity, and last
    what is printed of a material of a density (g/cm^3).

    SpecError when a part is in no list.
    """
    counts = Counter(ALWAYS) + Counter(purchased)
    if unknown := [name for name in counts if name not in parts]:
        raise SpecError(f"{short_text(unknown[0])} is in no list of purchased parts: add it to one")
    bought = [(part, 1) for part in drive.parts]
    bought += [(part, counts[name]) for name, part in parts.items() if counts[name]]
    once = ((item, 1) for item in printed)
    return list_rows(bought, once, density, prices, ball_rows(prototype, prices))


def tool_rows(first: int, prices: Prices) -> list[Row]:
    """Tools to pay for, items numbered from a first; plate and wheel are drilled with these."""
    file = files("tbcad.prototype.files") / TOOL_LIST
    rows: list[Row] = []
    for item, (_, cells) in enumerate(read_rows(file, TOOL_LIST, ("part", "what", "from")), first):
        row = dict.fromkeys(COLUMNS) | {**cells, "quantity": 1, "standard": "", "material": ""}
        rows.append({**row, **price_columns(1, prices.of(cells["part"], 0.0)), "item": item})
    return rows


def list_rows(
    bought: Iterable[tuple[PurchasedPart, int]],
    printed: Iterable[tuple[PrintedItem, int]],
    density: float,
    prices: Prices,
    first: Iterable[Row] = (),
) -> list[Row]:
    """Numbered rows: the first ones, what is bought, then what is printed of a density (g/cm^3)."""
    rows = [*first]
    rows += (
        _bought(part.name, part.what, quantity, part.material, part.mass_g, prices)
        for part, quantity in bought
    )
    rows += (_made(item, item.density or density, prices, quantity) for item, quantity in printed)
    return [{"item": item, **row} for item, row in enumerate(rows, 1)]


def totals(rows: Iterable[Row]) -> dict[str, Any]:
    """Sums of a list, for prototype.json; prices by currency, of parts that have one."""
    rows = list(rows)
    bought, printed = ([row for row in rows if row["from"] == kind] for kind in KINDS)
    tools = [row for row in rows if row["from"] == TOOL]
    return {
        "mass_g": _sum(rows, "total_mass_g"),
        "bought_price": by_currency(bought),
        "without_price": sum(row["unit_price"] is None for row in bought),
        "tools_price": by_currency(tools),
        "parts_printed": sum(not is_tool(row) for row in printed),
        "filament_g": _sum(printed, "filament_g"),
        "filament_price": by_currency(printed),
        "print_hours": _sum(printed, "print_hours"),
    }


def is_tool(row: Row) -> bool:
    """Whether a row is of what the machine is assembled with."""
    return row["from"] == TOOL or str(row["what"]).startswith(TOOL_MARK)


def _row(part: str, what: str, quantity: int, material: str, mass: float) -> Row:
    """Columns of all rows; mass is that of one piece, grams."""
    rounded = round(mass, GRAM_DECIMALS) if mass >= LIGHT_G else _estimate(mass)
    return {
        "quantity": quantity,
        "part": part,
        "what": what,
        "standard": standard_in(what),
        "material": material,
        "mass_g": rounded,
        "total_mass_g": round(quantity * rounded, GRAM_DECIMALS + ESTIMATE_DIGITS),
    }


def price_columns(quantity: int, price: Price | None) -> Row:
    """The columns of a price; empty without one."""
    if price is None:
        return dict.fromkeys(PRICE_COLUMNS)
    total = round(quantity * price.amount, CENTS)
    values = (price.amount, total, price.currency, price.date, price.source)
    return dict(zip(PRICE_COLUMNS, values, strict=True))


def _bought(part: str, what: str, quantity: int, material: str, mass: float, prices: Prices) -> Row:
    row = _row(part, what, quantity, material, mass)
    return {**row, **price_columns(quantity, prices.of(part, mass)), "from": BOUGHT}


def _made(item: PrintedItem, density: float, prices: Prices, quantity: int) -> Row:
    """A print: its mass is that of solid material, its price that of its filament.

    The price of a part that is turned to order is that of its finish.
    """
    filament_mm3, hours = item.estimate
    filament = filament_mm3 / MM3_PER_CM3 * density
    mass = item.volume / MM3_PER_CM3 * density
    row = _row(item.name, TOOL_MARK * item.tool + item.what, quantity, item.material, mass)
    if item.turned:
        price = prices.of(str(item.finish), mass)
        return {**row, **price_columns(quantity, price), "from": BOUGHT}
    return {
        **row,
        "print_volume_mm3": round(item.volume),
        "filament_g": _estimate(filament),
        "print_hours": _estimate(hours),
        **price_columns(quantity, _with_finish(prices.of(item.material, filament), item, prices)),
        "from": PRINTED,
    }


def _with_finish(price: Price | None, item: PrintedItem, prices: Prices) -> Price | None:
    """The price of a print with that of its finish; None where one has none."""
    if price is None or item.finish is None:
        return price
    finish = prices.of(item.finish, 0.0)
    if finish is None or finish.currency != price.currency:
        return None
    source = f"{price.source}; {finish.source}"
    return replace(price, amount=price.amount + finish.amount, source=source)


def ball_rows(prototype: PrototypeLayout, prices: Prices) -> Iterator[Row]:
    """Purchased balls by rising diameter."""
    balls = prototype.balls
    for k, count in sorted(Counter(balls.stock[~balls.cap].tolist()).items()):
        ball = balls.catalogue.balls[k]
        what = f"steel ball {ball.size} {ball.standard} {prototype.bought_grade(k)}"
        yield _bought(f"ball {ball.size}", what, count, BALL_STEEL, ball.mass_g, prices)


def _estimate(value: float) -> float:
    """A figure to as many digits as can be known."""
    return float(f"{value:.{ESTIMATE_DIGITS}g}")


def _sum(rows: Iterable[Row], column: str) -> float:
    return round(sum(float(row[column] or 0) for row in rows), GRAM_DECIMALS)


def by_currency(rows: Iterable[Row]) -> dict[str, float]:
    """Sums of the prices that there are, by currency."""
    sums = defaultdict[str, float](float)
    for row in rows:
        if row["currency"]:
            sums[str(row["currency"])] += float(row["total_price"] or 0)
    return {currency: round(amount, CENTS) for currency, amount in sorted(sums.items())}


@dataclass(frozen=True)
class PartsList:
    """Rows of bom.csv, and their sums."""

    rows: tuple[Row, ...]
    design: str = ""  # what drawings call it

    @cached_property
    def items(self) -> dict[str, int]:
        """Number of each part."""
        return {str(row["part"]): int(row["item"] or 0) for row in self._parts}

    @cached_property
    def quantities(self) -> dict[str, int]:
        """Quantity of each part."""
        return {str(row["part"]): int(row["quantity"] or 0) for row in self._parts}

    @property
    def _parts(self) -> list[Row]:
        return [row for row in self.rows if row["from"] in KINDS]

    def record(self) -> dict[str, Any]:
        """For other programs: the sums, then all rows by the columns of bom.csv."""
        return {"totals": totals(self.rows), "rows": [*self.rows]}

    def lines(self, *, full: bool) -> list[str]:
        """At most 80 columns: the sums, and all rows or the dearest."""
        dearest = sorted(self.rows, key=lambda row: -float(row["total_price"] or 0))
        return [*_sums(self.rows), *_table(self.rows if full else dearest[:SHOWN])]


def read_parts_list(folder: Path, prices: Prices | None = None) -> PartsList:
    """The parts list of a build, with other prices where these have one.

    InputError: no such list, or a broken one; it names the line.
    """
    path = folder / NAME
    if not path.is_file():
        raise InputError(f"{path} is not there: name a folder with a prototype by tbcad build")
    rows = [_read_row(where, cells) for where, cells in read_rows(path, NAME, COLUMNS, NUMBERS)]
    return PartsList(tuple(_priced(row, prices) for row in rows) if prices else tuple(rows))


def _read_row(where: str, cells: Mapping[str, str]) -> Row:
    row: Row = {**cells}
    for column in NUMBERS:
        try:
            number = float(cells[column]) if cells[column] else None
        except ValueError:
            raise SpecError(f"{where}, column {column}: no number: build again") from None
        row[column] = int(number) if number is not None and column in WHOLE else number
    if cells["from"] not in (*KINDS, TOOL):
        allowed = ", ".join((*KINDS, TOOL))
        raise SpecError(f"{where}, column from: allowed are {allowed}: build again")
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
    tools = sum(row["from"] == PRINTED for row in rows) - sums["parts_printed"]
    also = f" and {tools} tools" if tools else ""
    yield (
        f"{sums['parts_printed']} parts{also} to print: {kg:.1f} kg, "
        f"{_money(sums['filament_price'])}, {hours:.0f} h ({hours / DAY_H:.1f} days)"
    )
    if sums["tools_price"]:
        yield f"other tools: {_money(sums['tools_price'])}"
    yield f"in all {_money(by_currency(rows))}, as estimated and without shipping"
    yield f"{sums['mass_g'] / KG_G:.1f} kg in all, printed parts as solids"
    yield "not in the list: camera, lens, computer, drill, saw, soldering iron, paint"


def _money(prices: Mapping[str, float]) -> str:
    return " + ".join(f"{amount:.0f} {name}" for name, amount in prices.items()) or "no prices"


def _table(rows: Sequence[Row]) -> Iterator[str]:
    yield f"{'item':>4} {'qty':>3} {'part':<{PART}} {'what':<{WHAT}} {'price':>8}"
    for row in rows:
        columns = ("part", PART), ("what", WHAT)
        part, what = (_cut(str(row[column]), width) for column, width in columns)
        price = "-" if row["total_price"] is None else f"{float(row['total_price']):.2f}"
        yield (
            f"{row['item']:>4} {row['quantity']:>3} {part:<{PART}} {what:<{WHAT}} {price:>8}  "
            f"{row['currency'] or ''}"
        ).rstrip()


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else f"{text[: width - 3]}..."
