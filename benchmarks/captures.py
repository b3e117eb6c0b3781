"""The commands `tbcad capture` and `tbcad view` with a sensor of 52 million pixels."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from builds import Build, run
from timing import Figure, Row, at_most, measured

FINER = 4  # 8320 x 6208 instead of 2080 x 1552
PLACE = ("--azimuth", "30", "--elevation", "30", "--distance", "640")


def sharper(export: Path, folder: Path, subject: Path | None) -> list[Row]:
    """The same machine with a finer sensor, once, and a view out of that light field."""
    record = folder / "finer"
    with_sensor(export, record, FINER)
    out = folder / "finer-capture"
    capture = run(folder, *arguments(record, out, subject))
    view = run(folder, "view", str(out), *PLACE, "--out", str(folder / "view.png"))
    return [
        measured("tbcad capture, 8320 x 6208", Figure((capture.seconds,)), "s"),
        *_beside([capture], 4),
        measured("tbcad view of it, 640 x 480, truth too", Figure((view.seconds,)), "s"),
        *_beside([view], 4),
    ]


def real(export: Path, folder: Path, subject: Path | None, rounds: int) -> list[Row]:
    """Both photographs with real optics against ideal ones, as whole commands, in turns."""
    taken: dict[str, list[float]] = {"ideal": [], "real": []}
    for k in range(rounds + 1):  # the first pays for what is compiled
        for optics, seconds in taken.items():
            out = folder / f"{optics}-{k}"
            words = [*arguments(export, out, subject), "--optics", optics]
            seconds.append(run(folder, *words).cpu)
            shutil.rmtree(out)
    ideal, ours = (Figure(tuple(seconds[1:])) for seconds in taken.values())
    return [
        measured("tbcad capture --optics real, seconds of both cores", ours, "s"),
        at_most("- over those of ideal", ours.over(ideal), 4),
    ]


def with_sensor(export: Path, folder: Path, times: int) -> None:
    """The record of an export, with so many times the pixels across and down."""
    document = json.loads((export / "design.json").read_bytes())
    for camera in (*document["cameras"], document["spec"]["camera"]):
        camera["width_px"] *= times
        camera["height_px"] *= times
    folder.mkdir()
    (folder / "design.json").write_text(json.dumps(document), encoding="utf-8")
    shutil.copy(export / "mirrors.csv", folder)


def arguments(export: Path, out: Path, subject: Path | None) -> list[str]:
    """Of the command that photographs a subject, or the built-in knot."""
    chosen = ["--object", str(subject)] if subject else []
    return ["capture", str(export), "--out", str(out), *chosen]


def _beside(runs: list[Build], memory: float | None = None) -> list[Row]:
    most = Figure(tuple(one.memory for one in runs))
    cpu = measured("- seconds of both cores together", Figure(tuple(one.cpu for one in runs)), "s")
    name = "- most memory"
    return [
        cpu,
        measured(name, most, "GB") if memory is None else at_most(name, most, memory, "GB"),
    ]
