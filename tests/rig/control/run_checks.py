"""What must hold of a run's folder, whatever happened on the way."""

import json
from pathlib import Path
from typing import Any

from tbcad.app.cli import run as tbcad
from tbcad.rig.runs import read_photograph, read_run
from tests.rig.control.rig import SIZE, Rig, scene

OUTPUTS = {"dark": (), "led_1": (1,), "led_2": (2,), "led_3": (3,), "led_4": (4,), "lit": (0,)}
ALL = 2 * 2 * len(OUTPUTS)  # photographs at two stops
FAST = 2000.0  # of the controller's time
TIMES = {"taken", "seconds"}
NEIGHBOURS = (-1, 0, 1)  # tenths of a degree: the program's angles are truncated


def check_every_photograph(folder: Path, count: int) -> None:
    """Each is of its place under its light, byte for byte as the camera gave it."""
    run = read_run(folder)
    assert not run.faults
    assert len(run.exposures) == count
    for exposure in run.exposures.values():
        image = (folder / "photographs" / exposure.file).read_bytes()
        angle, lights = exposure.frame.base_angle_deg, frozenset(OUTPUTS[exposure.phase])
        assert image in {scene(round(angle + tenth / 10, 1), lights) for tenth in NEIGHBOURS}
        assert read_photograph(run, exposure).shape == (*SIZE[::-1], 3)
    names = {path.name for path in (folder / "photographs").iterdir()}
    assert names == {one.file for one in run.exposures.values()} | {
        f"{name}.json" for name in run.exposures
    }
    taken = [line["name"] for line in journal(folder) if line["event"] == "taken"]
    assert set(taken) == set(run.exposures)
    assert len(taken) == len(run.exposures)


def check_goes_on(rig: Rig, count: int) -> None:
    """Without faults the run that was stopped becomes complete."""
    rig.controller.fault = lambda number, line: None
    rig.controller.on_line = lambda number: None
    rig.controller.run_at(FAST)
    assert tbcad(rig.resume()) == 0
    check_every_photograph(rig.out, count)


def journal(folder: Path) -> list[dict[str, Any]]:
    lines = (folder / "journal.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def events(folder: Path) -> list[str]:
    return [line["event"] for line in journal(folder)]


def content(folder: Path) -> dict[str, Any]:
    """A run's folder but for times and journal."""
    found: dict[str, Any] = {}
    for path in (folder / "run.json", *(folder / "photographs").iterdir()):
        if path.suffix == ".json":
            value = json.loads(path.read_text())
            found[path.name] = {key: value[key] for key in value if key not in TIMES}
        else:
            found[path.name] = path.read_bytes()
    return found
