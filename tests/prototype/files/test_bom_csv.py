from dataclasses import replace

import numpy as np
import pytest

from tbcad.cad.formats.csv_table import write_table
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import ball_masses, sum_masses
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.drive.loads import BaseTorques, base_torques, choose_drive
from tbcad.prototype.files.bom import (
    COLUMNS,
    PrintedItem,
    bom_rows,
    cap_item,
    standard_in,
)
from tbcad.prototype.files.record import drive_record
from tbcad.prototype.purchased.parts import load_parts, load_prices
from tests.exported_files import Rows, read_csv


@pytest.mark.parametrize(
    ("what", "standard"),
    [
        ("socket head cap screw ISO 4762 M3 x 12", "ISO 4762"),
        ("steel ball 1 3/8 in ISO 3290-1 G40", "ISO 3290-1"),
        ("shaft collar DIN 705 A 8 with set screw", "DIN 705 A"),
        ("screw ASME B18.3 1/4-20 UNC for the camera's thread (ISO 1222)", "ASME B18.3"),
        ("deep groove ball bearing 608-2Z (ISO 15)", "ISO 15"),
        ("disc magnet 6 x 3 mm N42 nickel plated", ""),
        ("stepper NEMA 17 of 40 mm", ""),
    ],
)
def test_the_first_standard_named(what: str, standard: str) -> None:
    assert standard_in(what) == standard


PARTS = load_parts()
DRIVES = load_drives(PARTS)
PURCHASED = {
    **{"M3x10": 8, "INSERT-M3": 8, "608-2Z": 2, "DOWEL-4x20": 0, "LED-3": 5, "RELAY": 2},
    **{"MAGNET-4x3": 2, "MAGNET-8x3": 3},
}
DENSITY = 1.27
PRINTED = (
    PrintedItem("base", "carrier", 5e5, (4.2e5, 41.26)),
    PrintedItem("foot", "below the plate", 1e3, (800.0, 0.0834)),
)
PRICES = load_prices(["estimates"])


@pytest.fixture(scope="module")
def drive() -> Drive:
    return choose_drive("nema17-belt", BaseTorques(450.0, 500.0, 1000.0), DRIVES)


@pytest.fixture(scope="module")
def read(layout: PrototypeLayout, drive: Drive, tmp_path_factory: pytest.TempPathFactory) -> Rows:
    path = tmp_path_factory.mktemp("bom") / "bom.csv"
    caps = np.flatnonzero(layout.balls.cap).tolist()
    printed = [*PRINTED, *(cap_item(layout, j, 2e3, (1e3, 0.2)) for j in caps)]
    rows = bom_rows(layout, drive, PURCHASED, printed, DENSITY, PARTS, PRICES)
    write_table(path, COLUMNS, rows)
    return read_csv(path)


def of(read: Rows, part: str) -> dict[str, str]:
    (row,) = (row for row in read if row["part"] == part)
    return row


def test_figures_are_rounded(read: Rows) -> None:
    """Masses to 0.01 g, or two digits below 0.1 g; volumes to 1 mm^3; estimates to two digits."""
    base = of(read, "base")
    assert (base["print_volume_mm3"], base["filament_g"], base["print_hours"]) == (
        *("500000", "530.0", "41.0"),
    )
    assert of(read, "foot")["print_hours"] == "0.083"
    for row in read:
        assert len(row["mass_g"].partition(".")[2]) <= 2 or float(row["mass_g"]) < 0.1


def test_balls_by_size(layout: PrototypeLayout, read: Rows) -> None:
    balls = [row for row in read if row["part"].startswith("ball ")]
    assert sum(int(row["quantity"]) for row in balls) == (~layout.balls.cap).sum()
    for row in balls:
        size = row["part"].removeprefix("ball ")
        assert int(row["quantity"]) == layout.balls.size.count(size)
        assert row["what"] == f"steel ball {size} ISO 3290-1 G40"
    caps = [row for row in read if row["part"].startswith("cap ")]
    assert len(caps) == layout.balls.cap.sum() > 0


def test_equal_balls_share_a_row(layout: PrototypeLayout, drive: Drive) -> None:
    stock = layout.balls.stock.copy()
    stock[:] = 10
    alike = replace(layout, balls=replace(layout.balls, stock=stock))
    first, *others = bom_rows(alike, drive, {}, (), DENSITY, PARTS, PRICES)
    assert first["quantity"] == len(layout)
    assert not any(str(row["part"]).startswith("ball ") for row in others)


def test_magnets_weigh_what_the_list_says(read: Rows) -> None:
    for name in ("MAGNET-4x3", "MAGNET-8x3"):
        disc = np.pi / 4 * PARTS[name]["diameter_mm"] ** 2 * PARTS[name]["height_mm"]
        assert float(of(read, name)["mass_g"]) == pytest.approx(7.5e-3 * disc, abs=0.0051)


def test_unknown_part(layout: PrototypeLayout, drive: Drive) -> None:
    with pytest.raises(SpecError, match="'M3x11' is in no list of purchased parts"):
        bom_rows(layout, drive, {"M3x11": 1}, (), DENSITY, PARTS, PRICES)


def test_record_of_the_drive(layout: PrototypeLayout) -> None:
    summed = sum_masses(layout.array.ellipsoid.frame(), ball_masses(layout, 1.27))
    swing, motion = (float(layout.stops.angle[0]), float(layout.stops.angle[-1])), MotionSpec()
    drive = choose_drive("nema17-belt", base_torques(summed, swing, motion), DRIVES)
    record = drive_record(summed, drive, motion, swing)
    assert record.required_torque_nmm <= record.holding_torque_nmm
    assert record.required_torque_nmm == pytest.approx(2 * record.peak_torque_nmm)
    assert record.peak_torque_nmm > record.worst_torque_nmm
    assert record.mass_g == summed.mass_g
    assert record.belt_pull_n <= record.belt_rating_n
    assert record.motor == drive.motor.name
