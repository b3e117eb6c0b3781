"""Measure how fast tbcad is: one JSON file a run. `python benchmarks/run.py --help`."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import builds
import captures
from timing import Row

from tbcad.version import __version__

RESULTS = Path(__file__).parent / "results"


def rows(folder: Path, rounds: int, largest: bool, subject: Path | None) -> Iterator[list[Row]]:
    """All lines of the table, part by part."""
    # First of all, while this process is small: see builds.build.
    yield builds.small_and_large(folder, rounds)
    yield builds.whole(folder, rounds)
    if largest:
        yield builds.largest(folder)
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
    yield captures.captures(export, folder, rounds, subject)
    yield captures.sharper(export, folder, subject)
    from simulation import photographs, views

    yield photographs(export, folder, rounds, subject)
    yield views(folder / captures.FOLDER, rounds)


def circumstances(rounds: int) -> dict[str, object]:
    """What one must know to read the figures."""
    return {
        "tbcad": __version__,
        "cores": os.cpu_count(),
        "processor": processor(),
        "python": platform.python_version(),
        "rounds": rounds,
        "load_before": round(os.getloadavg()[0], 1),
    }


def processor() -> str:
    """The processor's name, where the system tells it."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def main() -> None:
    parser = argparse.ArgumentParser(description="Measure tbcad and write a JSON file.")
    parser.add_argument("--rounds", type=int, default=3, help="how often each is run (default: 3)")
    parser.add_argument("--skip-largest", action="store_true", help="leave out the build of n = 60")
    parser.add_argument("--object", type=Path, help="mesh to photograph (default: built-in knot)")
    parser.add_argument("--export", type=Path, help="measure the simulation alone, of this export")
    parser.add_argument("--out", type=Path, help="file to write (default: results/NAME.json)")
    options = parser.parse_args()
    out = options.out or RESULTS / ("simulation.json" if options.export else "all.json")
    about, finished = circumstances(options.rounds), list[dict[str, object]]()
    out.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.export:
            parts = simulated(options.export, folder, options.rounds, options.object)
        else:
            parts = rows(folder, options.rounds, not options.skip_largest, options.object)
        for part in parts:
            sys.stdout.writelines(f"{row}\n" for row in part)
            sys.stdout.flush()
            finished += [asdict(row) for row in part]
            # After each part: a run that is stopped keeps what it has measured.
            text = json.dumps({**about, "rows": finished}, indent=1) + "\n"
            out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
