"""Prices: which line of which list counts, rounding, and what is refused."""

from pathlib import Path

import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.purchased.parts import PRICE_FIELDS, load_parts, load_prices

HEADER = ",".join(PRICE_FIELDS)


def listed(folder: Path, *lines: str) -> str:
    path = folder / "mine.csv"
    path.write_text("\n".join([HEADER, *lines]) + "\n")
    return str(path)


def test_every_part_of_the_lists_has_an_estimate() -> None:
    prices = load_prices(["estimates"])
    for part in load_parts().values():
        assert prices.of(part.name, part.mass_g), part.name
    assert prices.of("ball 10 mm", 4.1)
    assert prices.of("PETG", 1000.0)


def test_the_first_list_that_has_a_part_counts(tmp_path: Path) -> None:
    mine = listed(tmp_path, "608-2Z,0.99,,CHF,2026-10-02,my shop")
    found = load_prices([mine, "estimates"]).of("608-2Z", 12)
    assert found is not None
    assert (found.amount, found.currency, found.date, found.source) == (
        *(0.99, "CHF", "2026-10-02", "my shop"),
    )
    assert load_prices([mine]).of("M3x10", 1) is None


def test_prices_by_mass_have_two_digits(tmp_path: Path) -> None:
    """0.5 + 40 * 0.5361 = 21.944; a price for a piece stays as it is written."""
    mine = listed(tmp_path, "ball *,0.5,40,EUR,2026-11,s", "M?x*,0.123,,EUR,2026-11,s")
    prices = load_prices([mine])
    ball, screw = prices.of("ball 2 in", 536.1), prices.of("M3x10", 0.9)
    assert ball is not None
    assert screw is not None
    assert (ball.amount, screw.amount) == (22.0, 0.12)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("A,1,,EUR,2026-13,s", "line 2, column date: '2026-13', allowed is a month or day"),
        ("A,1,,euro,2026-11,s", "column currency: 'euro', allowed is three letters such as EUR"),
        ("A,x,,EUR,2026-11,s", "column each: 'x', allowed is a number above 0"),
        ("A,,-1,EUR,2026-11,s", "column per_kg: '-1', allowed is a number above 0"),
        ("A,,,EUR,2026-11,s", "line 2: no price: fill in column each, per_kg or both"),
        ("A,1,,EUR,2026-11,", "column source: empty"),
        (",1,,EUR,2026-11,s", "column part: empty"),
        ("A,1,EUR", "line 2: 3 columns, not 6"),
    ],
)
def test_wrong_lines_are_named(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(SpecError) as caught:
        load_prices([listed(tmp_path, line)])
    assert message in str(caught.value)


def test_a_list_that_is_not_there() -> None:
    with pytest.raises(SpecError, match=r"prototype.prices: 'no.csv' is neither estimates nor"):
        load_prices(["no.csv"])
