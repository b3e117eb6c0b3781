"""Lists of purchased parts and prices: what is in them, which line counts, what is refused."""

import math
from itertools import pairwise
from pathlib import Path

import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.purchased.parts import (
    COMMON_COLUMNS,
    KINDS,
    PRICE_FIELDS,
    load_parts,
    load_prices,
    of_kind,
    package_lists,
    sizes_of,
)

PARTS = load_parts()


def package_copy(folder: Path) -> Path:
    for path in Path(str(package_lists())).glob("*.csv"):
        (folder / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    return folder


def listed(folder: Path, *lines: str) -> str:
    path = folder / "mine.csv"
    path.write_text("\n".join([",".join(PRICE_FIELDS), *lines]) + "\n")
    return str(path)


def test_parts_have_the_sizes_of_their_standards() -> None:
    for name in ("NEMA17-40", "NEMA17-48", "NEMA17-60"):
        sizes = ("hole_square_mm", "thread_mm", "pilot_mm", "shaft_mm")
        assert [PARTS[name][size] for size in sizes] == [31, 3, 22, 5]
    assert [PARTS["608-2Z"][size] for size in ("bore_mm", "outer_mm", "width_mm")] == [8, 22, 7]
    assert {part.kind for part in PARTS.values()} == set(KINDS)


@pytest.mark.parametrize(
    ("kind", "density", "size"),
    [("magnets", 7.5, "height_mm"), ("dowels", 7.85, "length_mm"), ("shafts", 7.85, "length_mm")],
)
def test_masses_of_rods(kind: str, density: float, size: str) -> None:
    for part in of_kind(PARTS, kind):
        volume = math.pi / 4 * part["diameter_mm"] ** 2 * part[size]
        assert part.mass_g == pytest.approx(density * 1e-3 * volume, rel=1e-3)


def test_longer_screws_are_heavier() -> None:
    for thread in {one["thread_mm"] for one in of_kind(PARTS, "screws")}:
        screws = sorted(
            of_kind(PARTS, "screws", thread_mm=thread), key=lambda one: one["length_mm"]
        )
        assert all(one.mass_g < longer.mass_g for one, longer in pairwise(screws))


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (",w,m,1,3,3,s", "magnets.csv, line 3, column part: empty"),
        ("A,w,m,0,3,3,s", "line 3, column mass_g: '0', allowed is a number above 0 to"),
        ("A,w,m,1,3,1e9,s", "column height_mm: '1e9'"),
        ("608-2Z,w,m,1,3,3,s", "column part: '608-2Z' twice"),
    ],
)
def test_wrong_cells_are_named(tmp_path: Path, row: str, message: str) -> None:
    path = package_copy(tmp_path) / "magnets.csv"
    header = ",".join([*COMMON_COLUMNS, *sizes_of("magnets"), "source"])
    path.write_text(f"{header}\nOK,w,m,1,3,3,s\n{row}\n")
    with pytest.raises(SpecError) as caught:
        load_parts(tmp_path)
    assert message in str(caught.value)


def test_the_first_list_that_has_a_part_counts(tmp_path: Path) -> None:
    mine = listed(tmp_path, "608-2Z,0.99,,CHF,2026-10-02,my shop")
    found = load_prices([mine, "estimates"]).of("608-2Z", 12)
    assert found is not None
    told = (found.amount, found.currency, found.date, found.source)
    assert told == (0.99, "CHF", "2026-10-02", "my shop")
    assert load_prices([mine]).of("M3x10", 1) is None
    estimates = load_prices(["estimates"])
    assert all(estimates.of(part.name, part.mass_g) for part in PARTS.values())
    assert estimates.of("ball 10 mm", 4.1)
    assert estimates.of("PETG", 1000.0)


def test_prices_by_mass_have_two_digits(tmp_path: Path) -> None:
    """0.5 + 40 * 0.5361 = 21.944; a price for a piece stays as it is written."""
    mine = listed(tmp_path, "ball *,0.5,40,EUR,2026-11,s", "M?x*,0.123,,EUR,2026-11,s")
    found = [load_prices([mine]).of(*one) for one in (("ball 2 in", 536.1), ("M3x10", 0.9))]
    assert [one.amount for one in found if one] == [22.0, 0.12]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("A,1,,EUR,2026-13,s", "line 2, column date: '2026-13', allowed is a month or day"),
        ("A,1,,euro,2026-11,s", "column currency: 'euro', allowed is three letters such as EUR"),
        ("A,,-1,EUR,2026-11,s", "column per_kg: '-1', allowed is a number above 0"),
        ("A,,,EUR,2026-11,s", "line 2: no price: fill in column each, per_kg or both"),
        ("A,1,EUR", "line 2: 3 columns, not 6"),
    ],
)
def test_wrong_lines_are_named(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(SpecError) as caught:
        load_prices([listed(tmp_path, line)])
    assert message in str(caught.value)


def test_lists_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"prototype.prices: 'no.csv' is neither estimates nor"):
        load_prices(["no.csv"])
    (package_copy(tmp_path) / "leds.csv").unlink()
    with pytest.raises(SpecError, match=r"leds\.csv: cannot be read"):
        load_parts(tmp_path)


def test_wheels_have_one_thickness() -> None:
    """Mass as a disc of aluminium (2.7 g/cm^3) of the pitch circle, less the bore, over the width.

    The list tells the same width, and two rims of 1 mm are beside belt and play.
    """
    for wheel in of_kind(PARTS, "wheels"):
        pitch = wheel["teeth"] * wheel["pitch_mm"] / math.pi
        area = math.pi / 4 * (pitch**2 - wheel["bore_mm"] ** 2)
        assert wheel.mass_g == pytest.approx(area * wheel["width_mm"] * 2.7e-3, rel=2e-3)
        assert f"and {wheel['width_mm']:g} mm " in wheel.what
        belt = 15 if "15 mm belt" in wheel.what else 6
        assert wheel["width_mm"] >= belt + 3


def test_spacers_are_on_the_inner_ring_of_their_bearing() -> None:
    for spacer in of_kind(PARTS, "spacers"):
        (bearing,) = of_kind(PARTS, "bearings", bore_mm=spacer["bore_mm"])
        rim = bearing["bore_mm"] + 0.3 * (bearing["outer_mm"] - bearing["bore_mm"])
        assert spacer["bore_mm"] + 3 <= spacer["outer_mm"] <= rim
        ring = math.pi / 4 * (spacer["outer_mm"] ** 2 - spacer["bore_mm"] ** 2)
        assert spacer.mass_g == pytest.approx(ring * spacer["width_mm"] * 2.7e-3, rel=2e-3)
