"""Which printers can make which parts, and why not, in a few lines for each printer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

Row = Mapping[str, Any]


def printer_lines(printing: Sequence[Row]) -> list[str]:
    """For each printer how many parts it can make; parts with the same problems share a line.

    Args:
        printing: a row for each part on each printer, as in verify.json.
    """
    printers = dict.fromkeys(row["profile"] for row in printing)
    return [
        line
        for name in printers
        for line in _lines(name, [row for row in printing if row["profile"] == name])
    ]


def _lines(name: str, rows: Sequence[Row]) -> Iterable[str]:
    good = [row for row in rows if not row["problems"]]
    yield f"{name} ({rows[0]['material']}): {len(good)} of {len(rows)} parts can be made"
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if row["problems"]:
            reasons.setdefault("; ".join(map(_short, row["problems"])), []).append(row["part"])
    for reason, parts in reasons.items():
        yield f"  not {', '.join(parts)}: {reason}"


def _short(problem: str) -> str:
    """The problem without what follows a colon, such as every size of the part and the bed."""
    return problem.partition(": ")[0]
