"""Tables one below another in a column of a sheet, and what is left of them in further columns."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from tbcad.drafting.tables import ROW_MM, table
from tbcad.formats.entities import Entity, Point

BETWEEN_ROWS, LEAST_ROWS = 1, 2  # empty ones between tables; of a table that is cut, with its head

Row = tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """A table of a column.

    Attributes:
        head: what the columns are.
        widths: of the columns, mm.
        rows: below the head.
    """

    head: Row
    widths: tuple[float, ...]
    rows: tuple[Row, ...]


def in_columns(tables: Sequence[Table], first: int, others: int) -> list[list[Table]]:
    """Tables in the first column and those that follow; one longer than a column is cut.

    Args:
        tables: in their order.
        first: rows that the first column has room for, heads too.
        others: rows of each other column.
    """
    columns: list[list[Table]] = [[]]
    room = first
    for one in tables:
        rest = one
        while rest.rows:
            whole = 1 + len(rest.rows)
            if room < LEAST_ROWS or (room < whole <= others and columns[-1]):
                columns.append([])
                room = others
            taken = rest.rows[: room - 1]
            columns[-1].append(replace(rest, rows=taken))
            rest = replace(rest, rows=rest.rows[len(taken) :])
            room -= 1 + len(taken) + BETWEEN_ROWS
    return columns


def drawn(corner: Point, tables: Sequence[Table]) -> Iterator[Entity]:
    """A column of tables below and right of a corner."""
    x, y = corner
    for one in tables:
        yield from table((x, y), one.widths, (one.head, *one.rows))
        y -= (1 + len(one.rows) + BETWEEN_ROWS) * ROW_MM
