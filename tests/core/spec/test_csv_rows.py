from itertools import product
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.core.spec.csv_rows import Row, positive_number, read_rows
from tbcad.core.spec.errors import SpecError


def read(folder: Path, content: bytes) -> list[tuple[str, Row]]:
    path = folder / "list.csv"
    path.write_bytes(content)
    return list(read_rows(path, "list.csv", ("part", "mass_g"), ("mass_g",)))


ROWS = [{"part": "a b", "mass_g": "1.5"}, {"part": "c", "mass_g": "1588"}]
TABLES = {
    "commas": "part,mass_g\na b,1.5\nc,1588\n",
    "semicolons": "part;mass_g\na b;1.5\nc;1588\n",
    "decimal commas": "part;mass_g\na b;1,5\nc;1588\n",
    "quoted decimal commas": 'part,mass_g\na b,"1,5"\nc,1588\n',
    "tabs": "part\tmass_g\na b\t1,5\nc\t1588\n",
    "bars": "part|mass_g\na b|1.5\nc|1588\n",
    "said": "sep=;\npart;mass_g\na b;1,5\nc;1588\n",
    "blanks": ' part , "mass_g" \n  a b ,1.5 \n c, 1588\n'.replace('" \n', '"\n'),
    "empty": "\n,\npart,mass_g,,\n\n,,\na b,1.5,,\n , \nc,1588,\n\n",
    "order and case": "Mass_G,PART\n1.5,a b\n1588,c\n",
    "comments": "# list, of mine\npart,mass_g\n# it's \"5\na b,1.5\n  #x,2\nc,1588",
}


@pytest.mark.parametrize("text", TABLES.values(), ids=TABLES)
def test_what_spreadsheets_write(tmp_path: Path, text: str) -> None:
    encodings, ends = ("utf-8", "utf-8-sig", "utf-16", "utf-32"), ("\n", "\r\n", "\r")
    for encoding, end in product(encodings, ends):
        rows = read(tmp_path, text.replace("\n", end).encode(encoding))
        assert [row for _, row in rows] == ROWS, (encoding, end)


def test_other_columns_where_they_are_allowed(tmp_path: Path) -> None:
    (tmp_path / "list.csv").write_text("x,part,,y\n1,a,,\n")
    rows = read_rows(tmp_path / "list.csv", "list.csv", ("part",), others=True)
    assert list(rows) == [("list.csv, line 2", {"part": "a"})]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "list.csv, line 1: the columns must be part,mass_g"),
        (b"#\n\npart\n", "list.csv, line 3: the columns must be part,mass_g (missing 'mass_g'"),
        (b"part,mass_g,x\n", "list.csv, line 1: the columns must be part,mass_g (unknown 'x'"),
        (b"part,part,mass_g\n", "list.csv, line 1: the columns must be part,mass_g (twice 'part'"),
        (b"sep=x\npart,mass_g\n", "list.csv, line 1: sep=x, allowed is sep="),
        (b"part;mass_g\n\na;1;2\n", "list.csv, line 3: 3 columns, not 2"),
        (b"part,mass_g\r\rb\r", "list.csv, line 3: 1 columns, not 2"),
        (b'part,mass_g\n"a\nb",1\n"c,2\n', "list.csv, line 4: "),
        (b"part,mass_g\n#8,1\n", "list.csv, line 2: '#8' may be a comment or a name"),
        (b"part;mass_g\na;1,234\n", "list.csv, line 2, column mass_g: '1,234', but it may be"),
        (b"part;mass_g\na;1.234\nb;1,2\n", "list.csv, line 3, column mass_g: '1,2', but others"),
        (b"part,mass_g\na,1 234\n", "list.csv, line 2, column mass_g: '1 234': write numbers"),
        (b"\xff\xfep\x00\xd8\xd8", "list.csv: not UTF-16 text (line 1): save it as UTF-8"),
        (b"p\x00a\x00", "list.csv: no text, it has null characters: save it as UTF-8"),
        (b"\xff", "list.csv: not UTF-8 text (line 1)"),
        (b"a" * 1_000_001, "list.csv: over 1 MB"),
    ],
)
def test_no_such_table(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(SpecError) as caught:
        read(tmp_path, content)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "1e400", "1_0", "5 mm", "", "100.1"])
def test_numbers_out_of_range(text: str) -> None:
    with pytest.raises(SpecError, match=r"^here, column m: .*, allowed is a number above 0 to 100"):
        positive_number("here", {"m": text}, "m", 100)


@settings(max_examples=40)
@given(text=st.text(max_size=80) | st.text('0123456789,.;\t"#\n -e', max_size=80))
def test_any_file_is_a_table_or_a_message_of_one_line(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    content = f"part,mass_g\n{text}".encode("utf-8", "replace")
    try:
        read(tmp_path_factory.getbasetemp(), content)
    except SpecError as error:
        assert str(error).isprintable()  # noqa: PT017
