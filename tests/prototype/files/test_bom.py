"""The list of parts as a file: figures, kinds of rows, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.caps import cap_item
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.files.bom import PrintedItem, bom_rows
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
    assert [row["material"] for row in rows[-len(caps) :]] == ["resin"] * len(caps)
    for row in rows:
        assert round(row["mass_g"], 2) == row["mass_g"] or row["mass_g"] < 0.1


def test_unknown_part(layout: PrototypeLayout) -> None:
    with pytest.raises(SpecError, match="'M3x11' is in no list of purchased parts"):
        bom_rows(layout, DRIVES[0], {"M3x11": 1}, (), 1.27, PARTS, PRICES)
