from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbcad.spec.csv_rows import Row, check_unique, positive_number, read_rows, required_text
from tbcad.spec.errors import SpecError


def read(folder: Path, content: bytes) -> list[tuple[str, Row]]:
    path = folder / "list.csv"
    path.write_bytes(content)
    return list(read_rows(path, "list.csv", ("part", "mass_g")))


def test_rows_with_their_places(tmp_path: Path) -> None:
    rows = read(tmp_path, b'\xef\xbb\xbfpart, mass_g\n a ,1\n\n\'"b",\n')
    assert rows == [
        ("list.csv, line 2", {"part": "a", "mass_g": "1"}),
        ("list.csv, line 4", {"part": '\'"b"', "mass_g": ""}),
    ]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "list.csv, line 1: the columns must be part,mass_g"),
        (b"mass_g,part\n", "list.csv, line 1: the columns must be part,mass_g"),
        (b"part,mass_g\na,1\nb\n", "list.csv, line 3: 1 columns, not 2"),
        (b'part,mass_g\n"a"b,1\n', "list.csv, line 2: "),
        (b"\xff", "list.csv: not UTF-8 text (line 1)"),
        (b"a" * 1_000_001, "list.csv: over 1 MB"),
    ],
)
def test_no_such_table(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(SpecError) as caught:
        read(tmp_path, content)
    assert str(caught.value).startswith(message)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"list\.csv: cannot be read: No such file"):
        list(read_rows(tmp_path / "list.csv", "list.csv", ("part",)))


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "5 mm", "", "100.1"])
def test_numbers_out_of_range(text: str) -> None:
    with pytest.raises(SpecError, match=r"^here, column m: .*, allowed is a number above 0 to 100"):
        positive_number("here", {"m": text}, "m", 100)


def test_cells() -> None:
    row, known = {"part": "a", "m": "100", "none": ""}, set[str]()
    assert positive_number("here", row, "m", 100) == 100
    assert required_text("here", row, "part") == "a"
    with pytest.raises(SpecError, match=r"^here, column none: empty"):
        required_text("here", row, "none")
    check_unique("here", row, "part", known)
    with pytest.raises(SpecError, match=r"^here, column part: 'a' twice"):
        check_unique("here", row, "part", known)


@given(text=st.text(max_size=80))
def test_any_file_is_a_table_or_a_message_of_one_line(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    content = f"part,mass_g\n{text}".encode("utf-8", "replace")
    try:
        read(tmp_path_factory.getbasetemp(), content)
    except SpecError as error:
        assert str(error).isprintable()  # noqa: PT017
