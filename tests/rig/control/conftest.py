"""A small export with what a run reads, and a rig that answers as its machine."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import home_angles
from tbcad.prototype.drive.drive import BaseTorques, Drive, choose_drive, load_drives
from tbcad.prototype.electronics import phases
from tbcad.prototype.files.controllers import controller_files
from tbcad.prototype.purchased.parts import load_parts
from tests.exported_files import edit_json
from tests.prototype_exports import write_export, write_stops
from tests.rig.control.impatient import WAITS_S
from tests.rig.control.rig import Rig, connected_rig, klipper_rig_of

LEDS = 4
WIND_UP_DEG = 0.1  # at every stop
Told = Callable[[list[str]], str]


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands in this process wait for the double as long as it needs, not as a board may."""
    for name, seconds in WAITS_S.items():
        monkeypatch.setattr(f"tbcad.rig.control.{name}", seconds)


@pytest.fixture(scope="session")
def drive() -> Drive:
    return choose_drive("nema17-belt", BaseTorques(450.0, 500.0, 1000.0), load_drives(load_parts()))


def export(
    folder: Path, design: MirrorDesign, layout: PrototypeLayout, drive: Drive, motion: MotionSpec
) -> Path:
    """What a run reads, by the export's own writers."""
    folder.mkdir()
    write_export(folder, design, layout)
    angles = np.degrees(layout.stops.angle).tolist()
    write_stops(folder, angles, [WIND_UP_DEG] * len(angles))
    for name, text in controller_files(layout, drive, motion, LEDS, "a design").items():
        (folder / name).write_text(text)
    lit = [{"name": one.name, "output": one.output} for one in phases(LEDS, motion)]
    controller = {
        "firmware": motion.controller,
        "board": "UNO-CNC-SHIELD",
        "axis": motion.axis,
        "phases": lit,
    }
    edit_json(folder / "prototype.json", lambda value: value.update(controller=controller))
    quick = json.loads(motion.model_dump_json()) | {"light_s": 0.0}
    edit_json(folder / "design.json", lambda value: value["spec"]["prototype"].update(motion=quick))
    return folder


@pytest.fixture(scope="session")
def exported(
    tmp_path_factory: pytest.TempPathFactory,
    low_resolution_design: MirrorDesign,
    layout: PrototypeLayout,
    drive: Drive,
) -> Callable[[MotionSpec], Path]:
    folder = tmp_path_factory.mktemp("control")
    return lambda motion: export(
        folder / motion.controller, low_resolution_design, layout, drive, motion
    )


@pytest.fixture(scope="session")
def control_export(exported: Callable[[MotionSpec], Path]) -> Path:
    return exported(MotionSpec())


@pytest.fixture(scope="session")
def plain_export(exported: Callable[[MotionSpec], Path]) -> Path:
    """For GRBL 1.1, which has no outputs and does not home."""
    return exported(MotionSpec(controller="grbl"))


@pytest.fixture(scope="session")
def klipper_export(exported: Callable[[MotionSpec], Path]) -> Path:
    return exported(MotionSpec(controller="klipper"))


@pytest.fixture(scope="session")
def switch_deg(layout: PrototypeLayout) -> float:
    return home_angles(layout, MotionSpec()).switch


def closed(rig: Rig) -> Iterator[Rig]:
    """A rig whose controller is closed after the test."""
    yield rig
    rig.controller.close()


@pytest.fixture
def rig(control_export: Path, tmp_path: Path, switch_deg: float) -> Iterator[Rig]:
    yield from closed(connected_rig(control_export, tmp_path, switch_deg))


@pytest.fixture
def plain_rig(plain_export: Path, tmp_path: Path, switch_deg: float) -> Iterator[Rig]:
    yield from closed(connected_rig(plain_export, tmp_path, switch_deg, "grbl", angle=0.0))


@pytest.fixture
def klipper_rig(klipper_export: Path, tmp_path: Path, switch_deg: float) -> Iterator[Rig]:
    yield from closed(klipper_rig_of(klipper_export, tmp_path, switch_deg))


@pytest.fixture(params=["rig", "klipper_rig"])
def either_rig(request: pytest.FixtureRequest) -> Rig:
    """With grblHAL, and with Klipper."""
    found = request.getfixturevalue(request.param)
    assert isinstance(found, Rig)
    return found


@pytest.fixture
def refused(cli: Callable[..., Any]) -> Told:
    """The line that a command ends with that is refused."""

    def line_of(words: list[str]) -> str:
        *_, line = cli(*words, code=2).err.splitlines()
        assert line.startswith("tbcad: ")
        return str(line)

    return line_of


@pytest.fixture
def stopped(cli: Callable[..., Any]) -> Told:
    """What a command says at the end of a run that is not complete."""
    return lambda words: str(cli(*words, code=1).out)
