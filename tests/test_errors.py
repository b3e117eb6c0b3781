import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbcad.errors import InputError, one_line


@given(st.text())
def test_errors_are_one_printable_line(text: str) -> None:
    assert str(InputError(text)).isprintable()


@pytest.mark.parametrize("text", ["plain  text, two spaces", "ünïcode ∅", r"C:\new"])
def test_what_can_be_shown_is_left_alone(text: str) -> None:
    assert one_line(text) == text


def test_line_breaks_and_undecodable_bytes_are_shown() -> None:
    assert one_line("a\nb\x1b[31m\udcff") == r"a\nb\x1b[31m\udcff"
