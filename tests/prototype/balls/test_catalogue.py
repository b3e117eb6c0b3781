from fractions import Fraction
from pathlib import Path

import pytest

from tbcad.core.optics.reflection import roughness_nm
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.balls.catalogue import (
    COLUMNS,
    Catalogue,
    StockBall,
    load_catalogue,
    load_grades,
    roughness_rq_nm,
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
    @pytest.mark.parametrize(
        ("name", "count", "ends"), [("metric", 51, (1, 60)), ("inch", 61, (1.5875, 50.8))]
    )
    def test_lists(self, name: str, count: int, ends: tuple[float, float]) -> None:
        """Sizes in millimetres, or whole inches and a fraction: what is ordered is built."""
        stock = load_catalogue([name])
        assert len(stock) == count
        assert tuple(stock.diameter[[0, -1]]) == ends
        expected = [steel_mass_g(diameter) for diameter in stock.diameter]
        assert stock.mass_g == pytest.approx(expected, rel=1e-3)
        for ball in stock.balls:
            number, unit = ball.size.rsplit(" ", 1)
            inches = float(sum(Fraction(part) for part in number.split()))
            assert ball.diameter_mm == pytest.approx(inches * {"in": 25.4, "mm": 1.0}[unit])

    def test_both_by_rising_diameter_and_grade(self) -> None:
        both = load_catalogue(["metric", "inch"])
        assert (both.diameter[1:] > both.diameter[:-1]).all()
        separate = [load_catalogue([name]).balls for name in ("metric", "inch")]
        assert len(both) == len({ball.size for balls in separate for ball in balls})
        largest = [both.available(grade, 60).diameter[-1] for grade in ("G5", "G10", "G28", "G40")]
        assert largest == [12.7, 25.4, 50.8, 60]
        with pytest.raises(SpecError, match=r"no ball of grade G40 up to 0\.5 mm"):
            both.available("G40", 0.5)
        assert steel_mass_g(60) == pytest.approx(883.3, abs=0.1)

    def test_grades_are_those_of_iso_3290_1(self) -> None:
        grades = load_grades()
        assert list(grades) == [f"G{i}" for i in (3, 5, 10, 16, 20, 24, 28, 40, 60, 100, 200)]
        g28 = grades["G28"]
        assert (g28.sphericity_um, g28.diameter_variation_um) == (0.7, 0.7)
        assert (g28.roughness_ra_um, g28.lot_variation_um) == (0.05, 1.4)


class TestOwn:
    def test_without_mass_is_steel(self, tmp_path: Path) -> None:
        stock = mine(tmp_path, ROW, "", "ZrO2 4,4,ISO 3290-2,G5,0.2,mine")
        assert stock.diameter.tolist() == [4, 5]
        assert stock.mass_g == pytest.approx([0.2, steel_mass_g(5)])
        assert stock.balls[1].grades == {"G10", "G40"}

    def test_wrong_cells_are_named(self, tmp_path: Path) -> None:
        cases = {
            ",5,s,G10,,x": "line 3, column size: empty",
            "a,0,s,G10,,x": "line 3, column diameter_mm: '0', allowed is a number above 0 to",
            "a,5,s,G10,-1,x": "column mass_g: '-1'",
            "a,5,s,G11,,x": "column grades: 'G11', allowed are G3 G5",
            "a,5,s,,,x": "column grades: ''",
            "5 mm,6,s,G10,,x": "column size: '5 mm' twice",
        }
        for row, message in cases.items():
            assert message in refusal(tmp_path, ROW, row)
        assert "mine.csv: an empty catalogue" in refusal(tmp_path)

    def test_unknown_or_none(self) -> None:
        for name in ("imperial", "", "a\0b"):
            with pytest.raises(SpecError, match=r"neither metric nor inch|cannot be read"):
                load_catalogue([name])
        with pytest.raises(SpecError, match="names no catalogue"):
            load_catalogue([])


@pytest.mark.parametrize(
    ("coarsest", "grades", "bought"),
    [
        ("G20", "G3 G5 G10 G16 G20", "G10"),
        ("G20", "G20 G28", "G20"),
        ("G20", "G28 G40", None),
        ("G5", "G3 G5 G10", "G5"),
        ("G40", "G3", "G3"),
    ],
)
def test_a_ball_is_bought_in_the_best_grade_from_g10(
    coarsest: str, grades: str, bought: str | None
) -> None:
    ball = StockBall("10 mm", 10.0, "ISO 3290-1", frozenset(grades.split()), 4.09, "mine")
    assert ball.bought_grade(coarsest) == bought


def test_roughness_of_grades_and_of_caps() -> None:
    assert roughness_rq_nm("G10") == pytest.approx(25.0)
    assert roughness_rq_nm(None) == pytest.approx(roughness_nm())
