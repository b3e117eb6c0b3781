"""Measure how fast tbcad is: one JSON file a run. `python benchmarks/run.py --help`."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import builds
import captures
from circumstances import RESULTS, circumstances
from timing import Row


def rows(folder: Path, rounds: int, subject: Path | None) -> Iterator[list[Row]]:
    """All lines of the table, part by part."""
    # Commands first of all, while this process is small: see builds.run.
    builds.run(folder, "build", "--out", str(folder / "18"), "--n", "18", "--parts", "shell")
    yield builds.step_sizes(folder / "18")
    yield from simulated(folder / "18", folder, rounds, subject)
    from solids import radii, solids
    from tracing import tracing

    yield solids(rounds)
    yield radii(rounds)
    yield tracing(folder / "18", rounds)
    from tolerance import tolerance

    yield tolerance(folder / "tolerance", rounds)


def simulated(export: Path, folder: Path, rounds: int, subject: Path | None) -> Iterator[list[Row]]:
    """Lines of the simulation: commands first, while this process is small."""
    capture = folder / "capture"
    builds.run(folder, *captures.arguments(export, capture, subject))
    yield captures.sharper(export, folder, subject)
    yield captures.real(export, folder, subject, rounds)
    from simulation import photographs, views

    yield photographs(export, folder, rounds, subject)
    yield views(capture, rounds)
    from reconstruction import reconstruction

    yield reconstruction(export, capture, folder, rounds)


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure tbcad and write a JSON file.")
    parser.add_argument("--rounds", type=int, default=3, help="how often each is run (default: 3)")
    parser.add_argument("--object", type=Path, help="mesh to photograph (default: built-in knot)")
    parser.add_argument("--export", type=Path, help="measure the simulation alone, of this export")
    parser.add_argument("--out", type=Path, help="file to write (default: results/NAME.json)")
    options = parser.parse_args()
    out = options.out or RESULTS / ("simulation.json" if options.export else "all.json")
    about = {**circumstances(), "rounds": options.rounds}
    finished = list[dict[str, object]]()
    out.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.export:
            parts = simulated(options.export, folder, options.rounds, options.object)
        else:
            parts = rows(folder, options.rounds, options.object)
        for part in parts:
            sys.stdout.writelines(f"{row}\n" for row in part)
            sys.stdout.flush()
            finished += [asdict(row) for row in part]
            # After each part: a run that is stopped keeps what it has measured.
            text = json.dumps({**about, "rows": finished}, indent=1) + "\n"
            out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
