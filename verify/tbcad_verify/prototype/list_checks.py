"""Figures of the parts list: standards named, prices, estimates of prints, and their sums.

Whether a price is right, no file can tell. What is verified is arithmetic, and that each price has
a currency, a date and a source.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import PARTS_LIST
from tbcad_verify.record.prototype_sections import ListTotals
from tbcad_verify.record.prototype_tables import PartsList
from tbcad_verify.report.checks import Check, CheckName, at_most, require, short_list
from tbcad_verify.types import Bools

CHECKS = {"list figures": "faults"}
STANDARDS = {  # of parts whose names begin so
    r"ball ": r"ISO 3290-1",
    r"M\d": r"ISO 4762",
    r"UNC": r"ASME B18\.3",
    r"SET-": r"ISO 4026",
    r"WASHER-": r"ISO 7089",
    r"DOWEL-": r"ISO 8734",
    r"COLLAR-": r"DIN 705 A",
    r"(?:SHAFT|ROD)-": r"ISO 286-2",
    r"\d+-2Z": r"ISO 15",
}
NAMED = re.compile(r"\b(?:ISO|DIN|EN|IEC|ASME|ANSI) [A-Z]?\d")
CURRENCY = re.compile(r"[A-Z]{3}")
DATE = re.compile(r"\d{4}-(?:0[1-9]|1[0-2])(?:-(?:0[1-9]|[12]\d|3[01]))?")
CENT = 0.005 + 1e-9  # half of one: prices are rounded to cents
SUM_ERROR = 0.006  # of a sum that is rounded to 0.01
# What a print cannot fall below: a quarter of its volume is filled, at most this much in a second.
FILLED, FLOW_MM3_S = 0.25, 80 * 0.45 * 0.2
ROUNDED = 0.95  # an estimate has two digits
HOUR_S = 3600.0

Row = dict[str, object]


def checks(names: list[CheckName], context: PrototypeContext) -> list[Check]:
    """The one check, over all rows and the record's sums."""
    (name,) = names
    bill = require(context.prototype.parts_list, f"there is no {PARTS_LIST}")
    density = context.export.spec.printer.density_g_cm3
    found = [*_standard_faults(bill), *_price_faults(bill), *_print_faults(bill, density)]
    found += _total_faults(bill, context.prototype.totals)
    return [at_most(name, len(found), 0, short_list(found))]


def _standard_faults(bill: PartsList) -> Iterator[str]:
    rows = zip(bill.part.tolist(), bill.what.tolist(), bill.standard.tolist(), strict=True)
    for part, what, standard in rows:
        for beginning, wanted in STANDARDS.items():
            if re.match(beginning, part) and not re.fullmatch(wanted, standard):
                yield f"{part}: its standard"
        if standard not in what or bool(standard) != bool(NAMED.search(what)):
            yield f"{part}: its description names another standard"


def _price_faults(bill: PartsList) -> Iterator[str]:
    rows = zip(
        bill.part.tolist(),
        bill.quantity.tolist(),
        bill.unit_price.tolist(),
        bill.total_price.tolist(),
        bill.currency.tolist(),
        bill.price_date.tolist(),
        bill.price_source.tolist(),
        strict=True,
    )
    for part, quantity, unit, total, currency, date, source in rows:
        if math.isnan(unit):
            if currency or date or source or not math.isnan(total):
                yield f"{part}: no price, but what belongs to one"
            continue
        if not abs(total - quantity * unit) <= CENT:
            yield f"{part}: its total price"
        if not (CURRENCY.fullmatch(currency) and DATE.fullmatch(date) and source):
            yield f"{part}: currency, date or source of its price"


def _print_faults(bill: PartsList, density: float) -> Iterator[str]:
    """Estimates of prints, which only a slicer can verify, against what is possible at all."""
    rows = zip(
        bill.part.tolist(),
        bill.mass_g.tolist(),
        bill.filament_g.tolist(),
        bill.print_hours.tolist(),
        bill.origin.tolist(),
        strict=True,
    )
    for part, mass, filament, hours, origin in rows:
        if origin == "bought":
            if not (math.isnan(filament) and math.isnan(hours)):
                yield f"{part}: a print of what is bought"
        elif not filament >= FILLED * ROUNDED * mass:
            yield f"{part}: {filament:g} g of filament do not fill it"
        elif not hours * HOUR_S >= ROUNDED * filament / density * 1000 / FLOW_MM3_S:
            yield f"{part}: {hours:g} h for {filament:g} g of filament"


def _total_faults(bill: PartsList, totals: ListTotals) -> Iterator[str]:
    bought = np.asarray(bill.origin == "bought")
    for name, recorded, column in (
        ("mass_g", totals.mass_g, bill.total_mass_g),
        ("filament_g", totals.filament_g, bill.filament_g[~bought]),
        ("print_hours", totals.print_hours, bill.print_hours[~bought]),
    ):
        if not abs(recorded - np.nansum(column)) <= SUM_ERROR:
            yield f"totals: {name} is {recorded:g}, the rows have {np.nansum(column):g}"
    if totals.without_price != int(np.isnan(bill.unit_price[bought]).sum()):
        yield "totals: without_price"
    for name, prices, which in (
        ("bought_price", totals.bought_price, bought),
        ("filament_price", totals.filament_price, ~bought),
    ):
        sums = _by_currency(bill, which)
        wrong = prices.keys() ^ sums.keys()
        wrong |= {one for one in sums if abs(prices.get(one, 0) - sums[one]) > SUM_ERROR}
        if wrong:
            yield f"totals: {name} in {short_list(sorted(wrong))}"


def _by_currency(bill: PartsList, which: Bools) -> dict[str, float]:
    sums = defaultdict[str, float](float)
    for total, currency in zip(bill.total_price[which], bill.currency[which], strict=True):
        if currency:
            sums[str(currency)] += float(total)
    return sums
