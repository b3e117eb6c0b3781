"""Photographs of a run and what is made of them: python benchmarks/runs.py EXPORT.

Whole commands, a process each: a simulated run of all stops, its calibration, and captures by
ideal and real optics.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from builds import Build, run
from circumstances import asked, show_and_write
from timing import Figure, Row, at_most, measured

RUN_S, CALIBRATION_S, REAL_TO_IDEAL, OF_LIMITS = 480, 60, 4, 18  # the first two for that n


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
    n = json.loads((export / "design.json").read_bytes())["spec"]["optics"]["n"]
    limits = {"simulate-run": RUN_S, "calibrate": CALIBRATION_S} if n == OF_LIMITS else {}
    return [
        Row(
            f"simulate-run, n = {n}, of all cores",
            (simulated.cpu,),
            "s",
            limits.get("simulate-run"),
        ),
        measured("- on the clock", _of(simulated.seconds), "s"),
        measured("- most memory", _of(simulated.memory), "GB"),
        Row("calibrate of it, of all cores", (calibrated.cpu,), "s", limits.get("calibrate")),
        measured("- on the clock", _of(calibrated.seconds), "s"),
        measured("- most memory", _of(calibrated.memory), "GB"),
        measured("capture, of all cores", _of(ideal.cpu), "s"),
        measured("capture --optics real, of all cores", _of(real.cpu), "s"),
        at_most("- to ideal", _of(real.cpu / ideal.cpu), REAL_TO_IDEAL, "times"),
    ]


def _of(value: float) -> Figure:
    return Figure((value,))


if __name__ == "__main__":
    given = asked(__doc__ or "", "runs", ("export", {"type": Path}))
    with tempfile.TemporaryDirectory() as name:
        show_and_write(given.out, given.about, rows(given.export.resolve(), Path(name)))
