"""Photographs of a run and what is made of them: python benchmarks/runs.py EXPORT.

Whole commands, a process each: a simulated run of all stops, its calibration, and captures by
ideal and real optics.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

from builds import Build, run
from circumstances import RESULTS, circumstances, show_and_write
from timing import Figure, Row, at_most, measured

RUN_S, CALIBRATION_S, REAL_TO_IDEAL = 480, 60, 4


def rows(export: Path, folder: Path) -> list[Row]:
    """Processor time and memory of each command."""
    photographs, out = folder / "run", ("--out", str(folder / "out"))

    def timed(*arguments: str) -> Build:
        return run(folder, *arguments)

    simulated = timed("simulate-run", str(export), "--out", str(photographs))
    calibrated = timed("calibrate", str(photographs), "--exports", str(export), *out)
    ideal, real = (
        timed("capture", str(export), "--optics", kind, "--out", str(folder / kind))
        for kind in ("ideal", "real")
    )
    return [
        at_most("simulate-run of n = 18, of all cores", _of(simulated.cpu), RUN_S, "s"),
        measured("- most memory", _of(simulated.memory), "GB"),
        at_most("calibrate of it, of all cores", _of(calibrated.cpu), CALIBRATION_S, "s"),
        measured("- most memory", _of(calibrated.memory), "GB"),
        measured("capture, of all cores", _of(ideal.cpu), "s"),
        measured("capture --optics real, of all cores", _of(real.cpu), "s"),
        at_most("- to ideal", _of(real.cpu / ideal.cpu), REAL_TO_IDEAL, "times"),
    ]


def _of(value: float) -> Figure:
    return Figure((value,))


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and write results/runs.json."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("export", type=Path)
    parser.add_argument("--out", type=Path, default=RESULTS / "runs.json")
    asked = parser.parse_args(arguments)
    about = {**circumstances(), "rounds": 1}
    with tempfile.TemporaryDirectory() as name:
        show_and_write(asked.out, about, rows(asked.export.resolve(), Path(name)))


if __name__ == "__main__":
    main()
