"""tbcad parts: sums and rows of a parts list, prices of one's own, bad lists."""

import csv
import json
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.prototype.files.bom import COLUMNS
from tbcad.prototype.purchased.parts import PRICE_FIELDS as PRICE_FILE

ROWS = (
    *(["1", "2", "608-2Z", "bearing (ISO 15)", "ISO 15", "steel", "12.0", "24.0", "", "", ""],),
    *(["2", "1", "MOTOR", "stepper" * 9, "", "steel", "400.0", "400.0", "", "", ""],),
    *(["3", "1", "carrier", "carrier", "", "PETG", "300.0", "300.0", "236220", "250.0", "25.0"],),
)
PRICED = (
    *(["1.5", "3.0", "EUR", "2026-11", "me", "bought"],),
    *(["", "", "", "", "", "bought"],),
    *(["5.5", "5.5", "EUR", "2026-11", "me", "printed"],),
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    with (tmp_path / "bom.csv").open("w", newline="") as file:
        rows = [[*row, *price] for row, price in zip(ROWS, PRICED, strict=True)]
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
    return tmp_path


def test_sums_come_first(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["parts", str(folder)]) == 0
    first, second, third, fourth, _, *rows = lines = capsys.readouterr().out.splitlines()
    assert first == "2 kinds of parts to buy: 3 EUR, 1 of them without a price"
    assert second == "1 parts to print: 0.2 kg of filament, 6 EUR, 25 h (1.0 days)"
    assert third.startswith("0.7 kg in all")
    assert fourth.startswith("not in the list: camera, lens")
    assert [row.split()[2] for row in rows] == ["carrier", "608-2Z", "MOTOR"]  # the dearest first
    assert all(len(line) <= 80 for line in lines)


def test_all_rows_are_in_the_order_of_the_list(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["parts", str(folder), "--full"]) == 0
    rows = capsys.readouterr().out.splitlines()[5:]
    assert [row.split()[0] for row in rows] == ["1", "2", "3"]


def test_ones_own_prices(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = folder / "mine.csv"
    mine.write_text(",".join(PRICE_FILE) + "\nMOTOR,20,,USD,2026-10,shop\nPETG,,40,USD,2026-10,s\n")
    before = (folder / "bom.csv").read_bytes()
    assert run(["parts", str(folder), "--json", "--prices", str(mine)]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["totals"]["bought_price"] == {"EUR": 3.0, "USD": 20.0}
    assert record["totals"]["filament_price"] == {"USD": 10.0}
    assert record["totals"]["without_price"] == 0
    assert record["rows"][1]["price_source"] == "shop"
    assert (folder / "bom.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("608-2Z", "608-2Z,", "bom.csv, line 2: 18 columns, not 17"),
        ("400.0,400.0", "heavy,400.0", "bom.csv, line 3, column mass_g: no number"),
        ("printed", "found", "line 4, column from: allowed is bought or printed"),
        ("item", "number", "bom.csv, line 1: the columns must be item,quantity"),
    ],
)
def test_a_broken_list(
    folder: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str
) -> None:
    path = folder / "bom.csv"
    path.write_text(path.read_text().replace(old, new, 1))
    assert run(["parts", str(folder)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
