"""Write the tables of benchmarks/README.md from the JSON files of runs: python benchmarks/table.py.

A table stands between `<!-- table: NAME -->` and `<!-- end -->`; NAME is results/NAME.json. That of
commands has the state before beside it, results/before.json.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from commands import COMMANDS, Limit
from timing import Row as TableRow
from timing import shown

Row = dict[str, Any]

KEYS = ("seconds", "cpu", "memory")
HERE = Path(__file__).parent
HEAD = "| what | median (minimum ... maximum) | limit | holds |\n|---|---|---|---|"
BLOCK = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


BESIDE = (
    "| command | seconds | of all cores | GB | before: seconds | of all cores | GB "
    "| limits hold |\n"
    "|---|---|---|---|---|---|---|---|"
)


def table(name: str) -> str:
    """Circumstances of a run, and its rows in markdown."""
    if not _file(name).exists():
        return "Not measured yet."
    record = _record(name)
    return beside(record, _record("before")) if "commands" in record else rows_of(record)


def _file(name: str) -> Path:
    return HERE / "results" / f"{name}.json"


def _record(name: str) -> dict[str, Any]:
    return dict(json.loads(_file(name).read_text(encoding="utf-8")))


def beside(record: dict[str, Any], before: dict[str, Any]) -> str:
    """Commands, each with the state before, as far as it was measured."""
    rows = []
    for command in COMMANDS:
        now, then = (one["commands"].get(command.name, {}) for one in (record, before))
        figures = [_shown(one.get(key)) for one in (now, then) for key in KEYS]
        rows.append(f"| {' | '.join([command.name, *figures, holds(command.limit, now, then)])} |")
    about = (
        f"tbcad {record['tbcad']}, {record['cores']} cores ({record['processor']}), Python "
        f"{record['python']}, load before the first: {record['load_before']}."
    )
    lines = [*_growth(record["commands"]), *_answers(record["commands"])]
    return "\n".join([about, "", BESIDE, *rows, *lines])


def _growth(commands: dict[str, Row]) -> list[str]:
    """How much longer n = 36, four times the mirrors, takes than n = 18."""
    lines = []
    for what in ("", ", shells"):
        small, large = (commands.get(f"build, n = {n}{what}") for n in (18, 36))
        if small and large:
            times = " and ".join(f"{large[key] / small[key]:.2f}" for key in KEYS[:2])
            lines.append(f"\nn = 36 to n = 18{what}: {times} times, at most 4.")
    return lines


def _answers(commands: dict[str, Row]) -> list[str]:
    """When the first answers came."""
    return [
        f"\n{command.name}: first answer after {shown(seconds)} s,"
        f" at most {command.limit.answer:g} s."
        for command in COMMANDS
        if (seconds := commands.get(command.name, {}).get("answer"))
    ]


def _shown(value: float | None) -> str:
    return "" if value is None else shown(value)


def holds(limit: Limit, now: Row, then: Row) -> str:
    """Whether the limits hold; nothing where there is none, or a figure is missing."""
    if "fails" in now.get("verdict", ""):
        return "verification fails"
    seconds, cpu = KEYS[:2]
    pairs = [
        (now.get(seconds), limit.seconds),
        (now.get("answer"), limit.answer),
        (_over(now, then, seconds), limit.wall_share),
        (_over(now, then, cpu), limit.cpu_share),
    ]
    known = [one <= most for one, most in pairs if one is not None and most is not None]
    return "" if not known else "yes" if all(known) else "NO"


def _over(now: Row, then: Row, key: str) -> float | None:
    return now[key] / then[key] if now and then.get(key) else None


def rows_of(record: dict[str, Any]) -> str:
    """All rows of a run with limits."""
    rows = [TableRow(**{**row, "values": tuple(row["values"])}) for row in record["rows"]]
    about = (
        f"tbcad {record['tbcad']}, {record['cores']} cores ({record['processor']}), Python "
        f"{record['python']}, {record['rounds']} rounds, load before the first: "
        f"{record['load_before']}."
    )
    return "\n".join([about, "", HEAD, *map(str, rows)])


def filled(text: str) -> str:
    """A page with all of its tables as the JSON files have them."""
    return BLOCK.sub(lambda match: f"{match[1]}{table(match[2])}\n{match[3]}", text)


if __name__ == "__main__":
    page = HERE / "README.md"
    page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")
