"""bom.csv: everything to buy and to print."""

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from tbcad.cad.formats.checked_files import Row
from tbcad.core.spec.errors import SpecError, short_text
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.printing.estimate import PrintEstimate
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.prototype.purchased.prices import Price, Prices

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
ALWAYS = {"FUSE-2A": 1, "GLUE-EPOXY": 1, "GRBL-BOARD": 1, "RELAY": 1, "SUPPLY-24V": 1}
PRINT_MATERIAL, CAP_MATERIAL = "PETG", "resin"
GRAM_DECIMALS, CENTS = 2, 2
ESTIMATE_DIGITS = 2  # of what a model says of a print, and of masses below 0.1 g
LIGHT_G = 0.1
KINDS = BOUGHT, PRINTED = "bought", "printed"
MM3_PER_CM3 = 1000.0


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
    estimate: PrintEstimate  # of its print
    material: str = PRINT_MATERIAL  # of it


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

    Balls come first, by size, then the drive, other purchased parts, and last what is printed.

    Args:
        prototype: with its balls.
        drive: of the base.
        purchased: quantity of each other purchased part, by its name in the lists.
        printed: parts to print.
        density: of their material, g/cm^3.
        parts: the lists.
        prices: of the parts.

    Raises:
        SpecError: when a part is in no list.
    """
    rows = [
        *ball_rows(prototype, prices),
        *(_purchased(part, 1, prices) for part in drive.parts),
        *_other_purchased(purchased, parts, prices),
        *(_printed(item, density, prices) for item in printed),
    ]
    return [{"item": item, **row} for item, row in enumerate(rows, 1)]


def cap_item(
    prototype: PrototypeLayout, j: int, volume: float, estimate: PrintEstimate
) -> PrintedItem:
    """A cap of a volume (mm^3), by the number of its ball from 0: no two are alike."""
    balls = prototype.balls
    front, body = balls.radius[j], 2 * balls.body_radius[j]
    what = (
        f"front of radius {front:.1f} mm on a ball of {body:.3f} mm, polished and coated as drawn"
    )
    return PrintedItem(f"cap {j + 1}", what, volume, estimate, CAP_MATERIAL)


def totals(rows: Iterable[Row]) -> dict[str, Any]:
    """Sums of a list, for prototype.json; prices by currency, of parts that have one."""
    rows = list(rows)
    bought, printed = ([row for row in rows if row["from"] == kind] for kind in KINDS)
    return {
        "mass_g": _sum(rows, "total_mass_g"),
        "bought_price": by_currency(bought),
        "without_price": sum(row["unit_price"] is None for row in bought),
        "filament_g": _sum(printed, "filament_g"),
        "filament_price": by_currency(printed),
        "print_hours": _sum(printed, "print_hours"),
    }


def _row(part: str, what: str, quantity: int, material: str, mass: float) -> Row:
    """What all rows have; mass is that of one, grams."""
    rounded = _grams(mass)
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


def _purchased(part: PurchasedPart, quantity: int, prices: Prices) -> Row:
    return _bought(part.name, part.what, quantity, part.material, part.mass_g, prices)


def _printed(item: PrintedItem, density: float, prices: Prices) -> Row:
    """Its mass is that of a solid print, and its price that of its filament."""
    filament = item.estimate.filament_mm3 / MM3_PER_CM3 * density
    mass = item.volume / MM3_PER_CM3 * density
    return {
        **_row(item.name, item.what, 1, item.material, mass),
        "print_volume_mm3": round(item.volume),
        "filament_g": _estimate(filament),
        "print_hours": _estimate(item.estimate.hours),
        **price_columns(1, prices.of(item.material, filament)),
        "from": PRINTED,
    }


def ball_rows(prototype: PrototypeLayout, prices: Prices) -> Iterator[Row]:
    """Purchased balls by rising diameter."""
    balls, grade = prototype.balls, prototype.grade.grade
    for k, count in sorted(Counter(balls.stock[~balls.cap].tolist()).items()):
        ball = balls.catalogue.balls[k]
        what = f"steel ball {ball.size} {ball.standard} {grade}"
        yield _bought(f"ball {ball.size}", what, count, "steel", ball.mass_g, prices)


def _other_purchased(purchased: Mapping[str, int], parts: Parts, prices: Prices) -> list[Row]:
    """Parts by name, in the order of the lists; those of none are left out."""
    counts = Counter(ALWAYS) + Counter(purchased)
    if unknown := [name for name in counts if name not in parts]:
        raise SpecError(f"{short_text(unknown[0])} is in no list of purchased parts: add it to one")
    return [_purchased(part, counts[name], prices) for name, part in parts.items() if counts[name]]


def _grams(mass: float) -> float:
    return round(mass, GRAM_DECIMALS) if mass >= LIGHT_G else _estimate(mass)


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
