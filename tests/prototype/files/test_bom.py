"""The list of parts as a file: figures, kinds of rows, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.spec.design import spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.caps import cap_item
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.files.bom import PrintedItem, bom_rows, tool_rows, totals
from tbcad.prototype.purchased.parts import load_parts, load_prices

PARTS = load_parts()
DRIVES = load_drives(PARTS)
PRICES = load_prices(["estimates"])
PRINTED = (
    PrintedItem("base", "carrier", 5e5, (4.2e5, 41.26)),
    PrintedItem("foot", "below the plate", 1e3, (800.0, 0.0834)),
)


def test_figures_are_rounded_and_equal_balls_share_a_row(layout: PrototypeLayout) -> None:
    """Masses to 0.01 g, or two digits below 0.1 g; estimates to two digits."""
    alike = replace(layout.balls, stock=np.full_like(layout.balls.stock, 10))
    caps = [cap_item(layout, j, 2e3, (1e3, 0.2)) for j in np.flatnonzero(layout.balls.cap).tolist()]
    printed = [*PRINTED, *caps]
    same = replace(layout, balls=alike)
    first, *others, base, foot = bom_rows(same, DRIVES[0], {}, PRINTED, 1.27, PARTS, PRICES)
    assert first["quantity"] == len(layout)
    assert not any(str(row["part"]).startswith("ball ") for row in others)
    told = tuple(base[key] for key in ("print_volume_mm3", "filament_g", "print_hours"))
    assert told == (500000, 530.0, 41.0)
    assert foot["print_hours"] == 0.083
    rows = bom_rows(layout, DRIVES[0], {"MAGNET-4x3": 2}, printed, 1.27, PARTS, PRICES)
    assert [row["material"] for row in rows[-len(caps) :]] == ["aluminium EN AW-6061"] * len(caps)
    for row in rows:
        assert round(row["mass_g"], 2) == row["mass_g"] or row["mass_g"] < 0.1


def test_unknown_part(layout: PrototypeLayout) -> None:
    with pytest.raises(SpecError, match="'M3x11' is in no list of purchased parts"):
        bom_rows(layout, DRIVES[0], {"M3x11": 1}, (), 1.27, PARTS, PRICES)


def test_tools_are_paid_but_are_no_parts(layout: PrototypeLayout) -> None:
    """They count in the price, and not in the mass."""
    gauge = PrintedItem("gauge", "of a length", 1e3, (800.0, 0.08), tool=True)
    parts = bom_rows(layout, DRIVES[0], {}, (*PRINTED, gauge), 1.27, PARTS, PRICES)
    tools = tool_rows(len(parts) + 1, PRICES)
    assert [row["item"] for row in tools] == [*range(len(parts) + 1, len(parts) + len(tools) + 1)]
    before, after = totals(parts), totals([*parts, *tools])
    paid = sum(row["total_price"] for row in tools)
    assert after == before | {"tools_price": {"EUR": pytest.approx(paid)}}
    assert paid > 50
    assert after["parts_printed"] == len(PRINTED)


@pytest.mark.parametrize(
    ("caps", "mass", "price", "source"),
    [("printed", 2.36, 60.05, "printed"), ("turned", 5.4, 180, "bought")],
)
def test_a_cap_has_the_mass_of_its_material_and_the_price_of_its_finish(
    layout: PrototypeLayout, caps: str, mass: float, price: float, source: str
) -> None:
    """Of 2 cm^3; 1 cm^3 of resin goes into the print."""
    spec = spec_with(layout.spec, prototype={"caps": caps})
    item = cap_item(
        replace(layout, spec=spec), int(np.flatnonzero(layout.balls.cap)[0]), 2e3, (1e3, 0.2)
    )
    (row,) = bom_rows(layout, DRIVES[0], {}, [item], 1.27, PARTS, PRICES)[-1:]
    assert row["mass_g"] == pytest.approx(mass)
    assert row["unit_price"] == pytest.approx(price, abs=0.01)
    assert row["from"] == source
