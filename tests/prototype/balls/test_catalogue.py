from fractions import Fraction
from pathlib import Path

import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.balls.catalogue import (
    COLUMNS,
    Catalogue,
    load_catalogue,
    load_grades,
    steel_mass_g,
)

HEADER = ",".join(COLUMNS)
ROW = "5 mm,5,ISO 3290-1,G10 G40,,mine"


def mine(folder: Path, *lines: str) -> Catalogue:
    path = folder / "mine.csv"
    path.write_text("\n".join([HEADER, *lines]) + "\n")
    return load_catalogue([str(path)])


def refusal(folder: Path, *lines: str) -> str:
    with pytest.raises(SpecError) as caught:
        mine(folder, *lines)
    assert str(caught.value).isprintable()
    return str(caught.value).replace(str(folder / "mine.csv"), "mine.csv")


class TestBuiltIn:
    def test_metric(self) -> None:
        stock = load_catalogue(["metric"])
        assert len(stock) == 3 + 22 + 14 + 12
        assert stock.diameter[[0, 1, 2, 3, -1]].tolist() == [1, 1.2, 1.5, 2, 60]
        assert 25.4 not in stock.diameter

    def test_inch(self) -> None:
        stock = load_catalogue(["inch"])
        assert len(stock) == 29 + 16 + 16
        assert stock.diameter[[0, -1]].tolist() == [1.5875, 50.8]
        assert stock.balls[-1].size == "2 in"

    def test_both_by_rising_diameter_without_doubles(self) -> None:
        both = load_catalogue(["metric", "inch"])
        assert (both.diameter[1:] > both.diameter[:-1]).all()
        separate = [load_catalogue([name]).balls for name in ("metric", "inch")]
        assert len(both) == len({ball.size for balls in separate for ball in balls})

    @pytest.mark.parametrize("name", ["metric", "inch"])
    def test_masses_are_those_of_steel(self, name: str) -> None:
        stock = load_catalogue([name])
        expected = [steel_mass_g(diameter) for diameter in stock.diameter]
        assert stock.mass_g == pytest.approx(expected, rel=1e-3)
        assert steel_mass_g(60) == pytest.approx(883.3, abs=0.1)

    @pytest.mark.parametrize("name", ["metric", "inch"])
    def test_sizes_name_their_diameters(self, name: str) -> None:
        """In millimetres, or in whole inches and a fraction: what is ordered is what is built."""
        for ball in load_catalogue([name]).balls:
            number, unit = ball.size.rsplit(" ", 1)
            inches = float(sum(Fraction(part) for part in number.split()))
            assert ball.diameter_mm == pytest.approx(inches * {"in": 25.4, "mm": 1.0}[unit])

    def test_grades_are_those_of_iso_3290_1(self) -> None:
        grades = load_grades()
        assert list(grades) == [f"G{i}" for i in (3, 5, 10, 16, 20, 24, 28, 40, 60, 100, 200)]
        g28 = grades["G28"]
        assert (g28.sphericity_um, g28.diameter_variation_um) == (0.7, 0.7)
        assert (g28.roughness_ra_um, g28.lot_variation_um) == (0.05, 1.4)

    def test_fine_grades_end_at_smaller_sizes(self) -> None:
        stock = load_catalogue(["metric", "inch"])
        largest = [stock.available(grade, 60).diameter[-1] for grade in ("G5", "G10", "G28", "G40")]
        assert largest == [12.7, 25.4, 50.8, 60]

    def test_nothing_left(self) -> None:
        with pytest.raises(SpecError, match=r"no ball of grade G40 up to 0\.5 mm"):
            load_catalogue(["metric"]).available("G40", 0.5)


class TestOwn:
    def test_without_mass_is_steel(self, tmp_path: Path) -> None:
        stock = mine(tmp_path, ROW, "", "ZrO2 4,4,ISO 3290-2,G5,0.2,mine")
        assert stock.diameter.tolist() == [4, 5]
        assert stock.mass_g == pytest.approx([0.2, steel_mass_g(5)])
        assert stock.balls[1].grades == {"G10", "G40"}

    def test_empty(self, tmp_path: Path) -> None:
        assert "mine.csv: an empty catalogue" in refusal(tmp_path)

    @pytest.mark.parametrize(
        ("row", "message"),
        [
            (",5,s,G10,,x", "line 3, column size: empty"),
            ("a,0,s,G10,,x", "line 3, column diameter_mm: '0', allowed is a number above 0 to"),
            ("a,5,s,G10,-1,x", "column mass_g: '-1'"),
            ("a,5,s,G11,,x", "column grades: 'G11', allowed are G3 G5"),
            ("a,5,s,,,x", "column grades: ''"),
            ("5 mm,6,s,G10,,x", "column size: '5 mm' twice"),
        ],
    )
    def test_wrong_cells_are_named(self, tmp_path: Path, row: str, message: str) -> None:
        assert message in refusal(tmp_path, ROW, row)

    @pytest.mark.parametrize("name", ["imperial", "", "a\0b"])
    def test_unknown(self, name: str) -> None:
        with pytest.raises(SpecError, match=r"neither metric nor inch nor a file|cannot be read"):
            load_catalogue([name])

    def test_none(self) -> None:
        with pytest.raises(SpecError, match="names no catalogue"):
            load_catalogue([])
