"""The table of docs/every-n.md: what every subdivision gives, and which were built and verified.

    python docs/every_n.py                    # figures of n = 2 to 40, without solids: minutes
    python docs/every_n.py --build 3 5 31     # builds and verifies these, and adds the verdicts

Results are kept in docs/every-n.json; a run renews the rows it is asked for.
"""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import tbcad
from tbcad.output.overview import overview

DOCS = Path(__file__).parent
RESULTS, PAGE = DOCS / "every-n.json", DOCS / "every-n.md"
SUBDIVISIONS = range(2, 41)
COLUMNS = ("n", "mirrors", "lens, degrees", "balls+caps", "pixels kept")
EVERY_TO = 13  # beyond, every other n, and those that were built
BEGIN, END = "<!-- table -->\n", "<!-- end -->\n"


def figures(design: tbcad.Design) -> dict[str, Any]:
    """Figures of a design; of one that was built, with the arrangement that was."""
    found = overview(design, optional_prototype=True)
    row: dict[str, Any] = {
        "mirrors": found.mirrors,
        "view_angle_deg": found.view_angle_deg,
        "minimum_coverage_mm": round(found.minimum_coverage_mm, 2),
        "note": found.note,
    }
    if (prototype := found.prototype) is not None:
        row |= {
            "balls": prototype.balls,
            "caps": prototype.caps,
            "prototype_coverage_mm": round(prototype.minimum_coverage_mm, 2),
            "kept_share": round(prototype.kept_share, 3),
            "turning_mass_g": round(prototype.turning_mass_g),
        }
    return row


def figures_as_built(n: int) -> dict[str, Any]:
    """Figures and verdict of a build with both parts."""
    with tempfile.TemporaryDirectory() as folder:
        built = tbcad.build(tbcad.load_spec(None, [f"n={n}"]), Path(folder) / "exports")
    assert built.report is not None
    verdict = f"{built.report.verdict}, {' and '.join(built.parts)}"
    return {**figures(built.design), "verdict": verdict}


def page_row(n: str, row: dict[str, Any]) -> str:
    """A row of the table; of a design that was built and passed n is bold."""
    cells = [f"**{n}**" if row.get("verdict", "").startswith("PASS") else n, row["mirrors"]]
    cells.append(f"{row['view_angle_deg']:.0f}")
    if "balls" in row:
        cells.append(f"{row['balls']}+{row['caps']}")
        cells.append(f"{row['kept_share']:.0%}")
    else:
        cells += ["none", ""]
    return "| " + " | ".join(map(str, cells)) + " |"


def write_page(results: dict[str, dict[str, Any]]) -> None:
    """Renew the table in the page."""
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    shown = [n for n in results if int(n) <= EVERY_TO or not int(n) % 2 or "verdict" in results[n]]
    lines += [page_row(n, results[n]) for n in sorted(shown, key=int)]
    head, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    tail = rest.split(END)[1]
    text = head + BEGIN + "\n" + "\n".join(lines) + "\n\n" + END + tail
    PAGE.write_text(text, encoding="utf-8")


def main() -> None:
    """Renew rows, keep the others."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=int, nargs="+", default=[], metavar="N")
    wanted = parser.parse_args().build
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for n in wanted or SUBDIVISIONS:
        row = figures_as_built(n) if n in wanted else figures(tbcad.design(n=n))
        results[str(n)] = row
        RESULTS.write_text(json.dumps(results, indent=1, sort_keys=True) + "\n")
        write_page(results)
        print(n, row, flush=True)


if __name__ == "__main__":
    main()
