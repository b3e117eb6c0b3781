"""A build after one changed key beside the same build from nothing, in turns.

python benchmarks/edits.py            n = 18
python benchmarks/edits.py --n 6
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

from builds import run
from circumstances import RESULTS, circumstances, show_and_write

EDITS = {
    "stage": "prototype.stage.led_ma=12",
    "light": "prototype.light.segments=2",
    "camera": "prototype.frame.camera_travel_mm=25",
    "balls": "prototype.ball_margin_mm=0.1",
    "shells": "mirrors.margin_mm=0.6",
}
LIMIT = 0.35  # of a build from nothing, for stage, light and camera


@dataclass(frozen=True)
class Edit:
    """Seconds on the clock and of all cores: of the edit, and of the same build from nothing."""

    name: str
    seconds: float
    cpu: float
    fresh_seconds: float
    fresh_cpu: float
    share: float  # of the cores' seconds


def edit(folder: Path, name: str, n: str) -> Edit:
    """Build, change a key and build again with what was kept, then from nothing."""
    words = "build", "--n", n, "--out", str(folder / "out")
    kept = {"TBCAD_CACHE": str(folder / name)}
    run(folder, *words, environment=kept)
    after = run(folder, *words, "--set", EDITS[name], environment=kept)
    fresh = run(folder, *words, "--set", EDITS[name])
    share = after.cpu / fresh.cpu
    return Edit(name, after.seconds, after.cpu, fresh.seconds, fresh.cpu, round(share, 3))


def main() -> None:
    """Measure all edits, print them and write edits.json."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", default="18")
    n = parser.parse_args().n
    about = {**circumstances(), "n": n, "limit": LIMIT}
    with tempfile.TemporaryDirectory() as name:
        rows = [edit(Path(name), one, n) for one in EDITS]
    show_and_write(RESULTS / "edits.json", about, rows)


if __name__ == "__main__":
    main()
