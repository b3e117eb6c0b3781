"""What an export says of a run: stops, lights, times, the controller's settings."""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tbcad.cad.formats.checked_files import REBUILD
from tbcad.core.spec.prototype import MotionSpec
from tbcad.errors import InputError
from tbcad.records.design import NAME as DESIGN_FILE
from tbcad.records.design import DesignRecord
from tbcad.records.exposure import Frame
from tbcad.records.prototype import NAME as RECORD
from tbcad.records.prototype import Prototype
from tbcad.records.prototype_drive import Phase
from tbcad.records.tables import BallRow, MirrorRow, PictureRow, StopRow
from tbcad.rig.control.program import PROGRAM, Program, read_program

SETTINGS = "grbl_settings.txt"
FILES = (
    DESIGN_FILE,
    MirrorRow.FILE,
    RECORD,
    BallRow.FILE,
    PictureRow.FILE,
    StopRow.FILE,
    PROGRAM,
    SETTINGS,
)
"""What a run depends on."""
TURNS: tuple[Literal[0, 180], ...] = (0, 180)
ANGLE_DEG = 1e-3  # a program's angles are truncated to 1e-4
DIRECTION = 3  # the setting that is changed where the base turns against its arrow
_SETTING = re.compile(r"\$(\d+)=(-?\d+(?:\.\d+)?)$")


@dataclass(frozen=True)
class ControlPlan:
    """All that a run needs of an export."""

    sha256: dict[str, str]  # of each file that it depends on, by name
    size_px: tuple[int, int]  # columns and rows of the design's camera
    firmware: Literal["grblhal", "grbl"]  # of the controller, "grblhal" or "grbl"
    axis: str
    phases: tuple[Phase, ...]  # of a stop, in order
    motion: MotionSpec
    settings: dict[int, float]  # of the controller, by number
    program: Program
    frames: tuple[Frame, ...]  # of both runs, in order

    @property
    def outputs(self) -> tuple[int, ...]:
        """Digital outputs of all lights."""
        return tuple(phase.output for phase in self.phases if phase.output is not None)


def read_control_plan(folder: Path) -> ControlPlan:
    """Read what a run needs of a folder that `tbcad build` wrote with a prototype.

    Raises:
        InputError: something is missing or does not fit; it says what.
    """
    design = DesignRecord.read(folder / DESIGN_FILE)
    controller = Prototype.read(folder / RECORD).controller
    program = read_program(folder)
    angles = _angles(folder, program)
    return ControlPlan(
        sha256={name: _sha256(folder / name) for name in FILES},
        size_px=(design.cameras[0].width_px, design.cameras[0].height_px),
        firmware=controller.firmware,
        axis=controller.axis,
        phases=controller.phases,
        motion=design.spec.prototype.motion,
        settings=read_settings(folder / SETTINGS),
        program=program,
        frames=tuple(
            Frame(object_turn_deg=turn, stop=stop, base_angle_deg=angle)
            for turn in TURNS
            for stop, angle in angles.items()
        ),
    )


def read_settings(path: Path) -> dict[int, float]:
    """Settings of the controller by number, without the direction, which is found by trying."""
    settings: dict[int, float] = {}
    for number, line in enumerate(_text(path).splitlines(), 1):
        if line.startswith("("):
            continue
        match = _SETTING.match(line)
        if match is None:
            raise InputError(f"{path}: line {number} is no setting such as $1=255: {REBUILD}")
        settings[int(match[1])] = float(match[2])
    settings.pop(DIRECTION, None)
    return settings


def _angles(folder: Path, program: Program) -> dict[int, float]:
    """Base angle of each stop, which the program must drive to."""
    path = folder / StopRow.FILE
    angles = {row.stop: row.base_angle_deg for row in StopRow.read(folder)}
    for stop, angle in angles.items():
        move = program.stops.get(stop)
        if move is None or abs(move.angle_deg - angle) > ANGLE_DEG:
            raise InputError(f"{path}: {PROGRAM} does not drive to stop {stop}: {REBUILD}")
    if len(angles) != len(program.stops):
        raise InputError(f"{path} has another number of stops than {PROGRAM}: {REBUILD}")
    return angles


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii")
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}: {REBUILD}") from None


def _sha256(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError:
        raise InputError(f"{path} is not there: {Prototype.MISSING}") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}: {REBUILD}") from None
