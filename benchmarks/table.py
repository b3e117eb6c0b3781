"""Write the tables of benchmarks/README.md from the JSON files of runs: python benchmarks/table.py.

A table stands between `<!-- table: NAME -->` and `<!-- end -->`; NAME is results/NAME.json.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from timing import Row

HERE = Path(__file__).parent
HEAD = "| what | median (minimum ... maximum) | limit | holds |\n|---|---|---|---|"
BLOCK = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(name: str) -> str:
    """Circumstances of a run, and its rows in markdown."""
    record = json.loads((HERE / "results" / f"{name}.json").read_text(encoding="utf-8"))
    rows = [Row(**{**row, "values": tuple(row["values"])}) for row in record["rows"]]
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
