"""A build after one changed key beside the same build from nothing, in turns.

python benchmarks/edits.py                           n = 18
python benchmarks/edits.py --n 6 --only stage light
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from builds import run
from circumstances import asked, show_and_write
from timing import Row

EDITS = {
    "stage": "prototype.stage.led_ma=12",
    "light": "prototype.light.segments=2",
    "camera": "prototype.frame.camera_travel_mm=25",
    "balls": "prototype.ball_margin_mm=0.1",
    "shells": "mirrors.margin_mm=0.6",
}
LIMIT, LIMITED = 0.35, ("stage", "light", "camera")  # of a build from nothing


def edit(folder: Path, name: str, n: str) -> list[Row]:
    """Build, change a key and build again with what was kept, then from nothing."""
    words = "build", "--n", n, "--out", str(folder / "out")
    kept = {"TBCAD_CACHE": str(folder / name)}
    run(folder, *words, environment=kept)
    after = run(folder, *words, "--set", EDITS[name], environment=kept)
    fresh = run(folder, *words, "--set", EDITS[name])
    share = Row("- of it", (after.cpu / fresh.cpu,), "", LIMIT if name in LIMITED else None)
    return [
        Row(f"n = {n}, {EDITS[name]}, from nothing, of all cores", (fresh.cpu,), "s"),
        Row("- after a build without it", (after.cpu,), "s"),
        share,
        Row("- of its seconds on the clock", (after.seconds / fresh.seconds,)),
    ]


if __name__ == "__main__":
    given = asked(
        __doc__ or "",
        "edits",
        ("--n", {"default": "18"}),
        ("--only", {"nargs": "*", "default": [*EDITS], "choices": [*EDITS]}),
    )
    with tempfile.TemporaryDirectory() as name:
        found = [row for one in given.only for row in edit(Path(name), one, given.n)]
    show_and_write(given.out, given.about, found)
