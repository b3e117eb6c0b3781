import json
from dataclasses import replace

import numpy as np
import pytest

from tbcad.formats.csv_table import write_table
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import ball_masses, cap_volume, sum_masses
from tbcad.prototype.drive.drive import Drive, choose_drive, load_drives
from tbcad.prototype.files.bom_csv import (
    COLUMNS,
    PrintedItem,
    bom_rows,
    drive_record,
)
from tbcad.prototype.purchased.parts import load_parts
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import MotionSpec
from tests.exported_files import Rows, read_csv

PARTS = load_parts()
DRIVES = load_drives(PARTS)
PURCHASED = {
    **{"M3x10": 8, "INSERT-M3": 8, "608-2Z": 2, "DOWEL-4x20": 0, "LED-3": 5, "RELAY": 2},
    **{"MAGNET-4x3": 2, "MAGNET-8x3": 3},
}
PRINTED = (PrintedItem("base", "carrier", 5e5), PrintedItem("foot", "below the plate", 1e3))
NEEDED = PURCHASED, PRINTED, 1.27, PARTS


@pytest.fixture(scope="module")
def drive() -> Drive:
    return choose_drive("nema17-belt", 1000, DRIVES)


@pytest.fixture(scope="module")
def read(layout: PrototypeLayout, drive: Drive, tmp_path_factory: pytest.TempPathFactory) -> Rows:
    path = tmp_path_factory.mktemp("bom") / "bom.csv"
    write_table(path, COLUMNS, bom_rows(layout, drive, *NEEDED))
    return read_csv(path)


def of(read: Rows, part: str) -> dict[str, str]:
    (row,) = (row for row in read if row["part"] == part)
    return row


def test_rows(read: Rows) -> None:
    assert tuple(read[0]) == COLUMNS
    assert [int(row["item"]) for row in read] == list(range(1, len(read) + 1))
    assert len({row["part"] for row in read}) == len(read)
    for row in read:
        total = int(row["quantity"]) * float(row["mass_g"])
        assert float(row["total_mass_g"]) == pytest.approx(total)
        assert row["from"] in ("bought", "printed")
        assert (row["print_volume_mm3"] != "") == (row["from"] == "printed")


def test_totals_are_the_sum_of_the_parts(layout: PrototypeLayout, drive: Drive, read: Rows) -> None:
    balls = layout.mass_g + 1.27e-3 * cap_volume(layout.balls).sum()
    bought = sum(count * PARTS[name].mass_g for name, count in PURCHASED.items())
    electronics = sum(
        PARTS[name].mass_g for name in ("GLUE-EPOXY", "GRBL-BOARD", "RELAY", "SUPPLY-24V")
    )
    expected = balls + bought + electronics + 1.27e-3 * (5e5 + 1e3)
    expected += sum(part.mass_g for part in drive.parts)
    assert sum(float(row["total_mass_g"]) for row in read) == pytest.approx(expected)


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
    first, *others = bom_rows(alike, drive, {}, (), 1.27, PARTS)
    assert first["quantity"] == len(layout)
    assert not any(str(row["part"]).startswith("ball ") for row in others)


def test_counts_add_up(read: Rows) -> None:
    assert of(read, "M3x10")["quantity"] == "8"
    assert "ISO 4762" in of(read, "M3x10")["what"]
    assert of(read, "RELAY")["quantity"] == "3"  # one for the camera, two asked for
    assert of(read, "MAGNET-4x3")["quantity"] == "2"
    assert of(read, "MAGNET-8x3")["quantity"] == "3"
    assert of(read, "foot")["quantity"] == "1"
    assert not [row for row in read if row["part"] == "DOWEL-4x20"]


def test_magnets_weigh_what_the_list_says(read: Rows) -> None:
    for name in ("MAGNET-4x3", "MAGNET-8x3"):
        assert float(of(read, name)["mass_g"]) == pytest.approx(PARTS[name].mass_g, rel=1e-3)
        disc = np.pi / 4 * PARTS[name]["diameter_mm"] ** 2 * PARTS[name]["height_mm"]
        assert float(of(read, name)["mass_g"]) == pytest.approx(7.5e-3 * disc, rel=1e-3)


def test_drive_is_in_it(drive: Drive, read: Rows) -> None:
    for part in drive.parts:
        assert of(read, part.name)["quantity"] == "1"


def test_unknown_part(layout: PrototypeLayout, drive: Drive) -> None:
    with pytest.raises(SpecError, match="'M3x11' is in no list of purchased parts"):
        bom_rows(layout, drive, {"M3x11": 1}, (), 1.27, PARTS)


def test_record_of_the_drive(layout: PrototypeLayout) -> None:
    summed = sum_masses(layout.array.ellipsoid.frame(), ball_masses(layout, 1.27))
    low, high = (float(layout.stops.angle[i]) for i in (0, -1))
    motion = MotionSpec()
    needed = summed.required_torque(
        low, high, np.radians(motion.acceleration_deg_s2), motion.safety
    )
    drive = choose_drive("nema17-belt", needed, DRIVES)
    record = json.loads(json.dumps(drive_record(summed, drive, motion, (low, high), 120.0)))
    assert record["required_torque_nmm"] <= record["holding_torque_nmm"]
    assert record["required_torque_nmm"] >= 2 * record["worst_torque_nmm"]
    assert record["mass_g"] == summed.mass_g
    assert record["counterweight_g"] * 120 == pytest.approx(record["moment_g_mm"])
    assert record["motor"] == drive.motor.name
