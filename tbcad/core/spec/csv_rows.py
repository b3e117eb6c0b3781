"""Files that users write: text, TOML, and CSV as spreadsheets save it; errors name the line.

Read are commas, semicolons, tabs or bars between the cells, columns in any order and case, decimal
points or decimal commas, empty rows, comments and every encoding of `read_text`. What may mean two
things is refused.
"""

import codecs
import csv
import math
import re
import tomllib
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeAlias

from tbcad.core.spec.errors import SpecError, short_text

MAX_BYTES = 1_000_000  # designs, processes and lists have a few thousand
# Byte order marks; that of UTF-32 begins with that of UTF-16.
ENCODINGS = {
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
    codecs.BOM_UTF8: "utf-8-sig",
}
# A key of very many parts: the time that tomllib takes grows with their number squared.
DOTTED = re.compile(
    r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){20}""", re.ASCII
)

Table: TypeAlias = dict[str, Any]
Row = dict[str, str]  # cells by column
Record = tuple[str, list[str]]
"""File and line that a row begins in, for error messages, and its cells."""
SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar"}
SAID = re.compile(r'\s*"?sep=(.)"?[;,\t]*\s*', re.IGNORECASE)  # by spreadsheets, in line 1
NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)(e[+-]?[0-9]+)?", re.IGNORECASE)
# 1,234 may be 1.234 or 1234; 0,234 and 1234,567 are never numbers of thousands.
EITHER = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}([.,'\s][0-9]{3})+([.,][0-9]*)?")
WRITE_POINT = "write numbers with a decimal point and nothing between thousands"


def read_toml(file: Path | Traversable, name: str, kind: str) -> Table:
    """Return a TOML file as a table; names and kinds are for errors, as of `read_text`."""
    text = read_text(file, name, kind)
    if found := DOTTED.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise SpecError(f"{name}: line {line}: tables nested too deeply: flatten them")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SpecError(f"{name}: tables nested too deeply: flatten them") from None
    except ValueError as error:
        reason = str(error).partition(" for integer string conversion")[0]
        raise SpecError(f"{name}: not valid TOML: {reason}: correct that line") from None


def read_text(file: Path | Traversable, name: str, kind: str, max_bytes: int = MAX_BYTES) -> str:
    """Return a text without byte order mark, its lines ended by line feeds alone; or SpecError.

    It is UTF-8, or UTF-16 or UTF-32 with a byte order mark; lines end as on any system.
    """
    if isinstance(file, Path) and file.exists() and not file.is_file():
        raise SpecError(f"{name}: not a file: name a {kind} file")
    try:
        with file.open("rb") as stream:
            data: bytes = stream.read(max_bytes + 1)
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SpecError(f"{name}: cannot be read: {reason}: check the path") from None
    if len(data) > max_bytes:
        size = max_bytes // 1_000_000
        raise SpecError(f"{name}: over {size} MB, too large for a {kind}: name a {kind} file")
    return _decoded(data, name).replace("\r\n", "\n").replace("\r", "\n")


def _decoded(data: bytes, name: str) -> str:
    encoding = next((code for mark, code in ENCODINGS.items() if data.startswith(mark)), "utf-8")
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        before = data[: error.start].decode(encoding, "replace")
        line = len(before.replace("\r\n", "\n").replace("\r", "\n").split("\n"))
        kind = encoding.upper().removesuffix("-SIG")
        raise SpecError(f"{name}: not {kind} text (line {line}): save it as UTF-8") from None
    if "\0" in text:
        raise SpecError(f"{name}: no text, it has null characters: save it as UTF-8")
    return text


def toml_value(text: str) -> object:
    """Return the value of an option: TOML, or else text."""
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text


def read_rows(
    file: Path | Traversable,
    name: str,
    columns: Sequence[str],
    numbers: Collection[str] = (),
    *,
    others: bool = False,
) -> Iterator[tuple[str, Row]]:
    """Yield each row that is not empty, with its place as text for error messages.

    Numbers are yielded with decimal points; columns beside the named ones are refused, or left out.
    SpecError names the line if the file cannot be read or is not such a table.
    """
    lines = read_text(file, name, "list").split("\n")
    said = SAID.fullmatch(lines[0])
    if said:
        lines[0] = ""
    separator = _separator(lines, columns, said[1] if said else None, name)
    records = _records(lines, separator, name)
    where, header = next(records, (f"{name}, line 1", []))
    while header and not header[-1]:
        header.pop()
    places = _places(header, columns, where, separator, others)
    rows = [(where, _row(cells, places, len(header), where, separator)) for where, cells in records]
    _write_points(rows, numbers)
    yield from rows


def _separator(lines: list[str], columns: Sequence[str], said: str | None, name: str) -> str:
    """What stands between cells: what line 1 says, or what splits the header best."""
    if said is not None and said not in SEPARATORS:
        raise SpecError(
            f"{name}, line 1: sep={said}, allowed is sep=, with a comma, semicolon, tab or bar: "
            "change it"
        )
    if said is not None:
        return said
    header = next((line for line in lines if line.strip() and not _is_comment(line)), "")
    found = {
        separator: len({*columns} & {*_names(header.split(separator))}) for separator in SEPARATORS
    }
    return max(found, key=lambda separator: found[separator])


def _records(lines: list[str], separator: str, name: str) -> Iterator[Record]:
    """Rows that have a cell which is not empty; cells are trimmed."""
    taken: list[str] = []

    def source() -> Iterator[str]:
        for line in lines:
            comment = not taken and _is_comment(line)
            taken.append(line)
            yield "\n" if comment else line + "\n"

    reader = csv.reader(source(), delimiter=separator, strict=True, skipinitialspace=True)
    while True:
        where = f"{name}, line {reader.line_num + 1}"
        try:
            cells = [cell.strip() for cell in next(reader)]
        except StopIteration:
            return
        except csv.Error as error:
            raise SpecError(f"{where}: {error}: correct it") from None
        if any(cells):
            if re.match(r"#\d", taken[0].lstrip()):
                raise SpecError(
                    f"{where}: {short_text(cells[0])} may be a comment or a name: put "
                    "a blank after the #, or the name in quotes"
                )
            yield where, cells
        taken.clear()


def _is_comment(line: str) -> bool:
    """Whether a line is a comment; #8 may be a name."""
    return re.match(r"\s*#(?!\d)", line) is not None


def _names(cells: Sequence[str]) -> list[str]:
    return [cell.strip().strip('"').strip().lower() for cell in cells]


def _places(
    header: list[str], columns: Sequence[str], where: str, separator: str, others: bool
) -> dict[str, int]:
    found = _names(header)
    count = Counter(found)
    missing = [column for column in columns if column not in count]
    unknown = [] if others else [name for name in count if name not in columns]
    twice = [name for name in columns if count[name] > 1]
    faults = (("missing", missing), ("unknown", unknown), ("twice", twice))
    if fault := "; ".join(f"{what} {short_text(names[0])}" for what, names in faults if names):
        raise SpecError(
            f"{where}: the columns must be {','.join(columns)} ({fault}; cells are parted by a "
            f"{SEPARATORS[separator]}): change it"
        )
    return {column: found.index(column) for column in columns}


def _row(cells: list[str], places: dict[str, int], width: int, where: str, separator: str) -> Row:
    """Cells by column; what is right of the header must be empty."""
    if len(cells) < width or any(cells[width:]):
        raise SpecError(
            f"{where}: {len(cells)} columns, not {width}, parted by a {SEPARATORS[separator]}: put "
            f"each cell with a {SEPARATORS[separator]} in it in quotes"
            + (", also as a decimal comma" if separator == "," else "; decimal commas are read")
        )
    return {column: cells[place] for column, place in places.items()}


def _write_points(rows: list[tuple[str, Row]], numbers: Collection[str]) -> None:
    """Put decimal points in the place of decimal commas, if all numbers of a table have these."""
    cells = [(where, row, column) for where, row in rows for column in numbers if row[column]]
    for where, row, column in cells:
        if not NUMBER.fullmatch(row[column]) and THOUSANDS.fullmatch(row[column]):
            raise SpecError(f"{where}, column {column}: {row[column]!r:.60}: {WRITE_POINT}")
    cells = [cell for cell in cells if NUMBER.fullmatch(cell[1][cell[2]])]
    commas = [cell for cell in cells if "," in cell[1][cell[2]]]
    points = [cell for cell in cells if "." in cell[1][cell[2]]]
    sure = [cell for cell in commas if not EITHER.fullmatch(cell[1][cell[2]])]
    if commas and (points or not sure):
        where, row, column = commas[0]
        why = "others have decimal points" if points else "it may be a number of thousands"
        raise SpecError(f"{where}, column {column}: {row[column]!r:.60}, but {why}: {WRITE_POINT}")
    for _, row, column in commas:
        row[column] = row[column].replace(",", ".")


def required_text(where: str, row: Row, column: str) -> str:
    """Return a cell that must not be empty."""
    if not row[column]:
        raise SpecError(f"{where}, column {column}: empty: fill it in")
    return row[column]


def positive_number(where: str, row: Row, column: str, maximum: float) -> float:
    """Return a cell that must be a number above 0 and at most a maximum."""
    value = _value(row[column])
    if not 0 < value <= maximum:
        raise _no_number(where, row, column, f"above 0 to {maximum:g}")
    return value


def number(where: str, row: Row, column: str, maximum: float) -> float:
    """Return a cell that must be a number whose size is at most a maximum."""
    value = _value(row[column])
    if not abs(value) <= maximum:
        raise _no_number(where, row, column, f"from {-maximum:g} to {maximum:g}")
    return value


def _value(text: str) -> float:
    """The number that a text is, or not a number."""
    return float(text) if NUMBER.fullmatch(text) and "," not in text else math.nan


def _no_number(where: str, row: Row, column: str, allowed: str) -> SpecError:
    return SpecError(
        f"{where}, column {column}: {short_text(row[column])}, allowed is a number {allowed}: "
        "change it"
    )


def check_unique(where: str, row: Row, column: str, known: set[str]) -> None:
    """Add a cell to the values that a column already has, and refuse it if it is one of them."""
    if row[column] in known:
        raise SpecError(f"{where}, column {column}: {short_text(row[column])} twice: remove one")
    known.add(row[column])
