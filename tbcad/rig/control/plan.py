"""What a build says of a run: stops, lights, times, settings, and the motions of its program.

Pauses of the controller's program become questions to the operator, and what it does for each
photograph is done by the run: a light, the camera, the light off again.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from tbcad.cad.formats.checked_files import REBUILD
from tbcad.core.spec.prototype import Firmware, MotionSpec
from tbcad.errors import InputError, one_line
from tbcad.records.design import NAME as DESIGN_FILE
from tbcad.records.design import DesignRecord
from tbcad.records.prototype import NAME as RECORD
from tbcad.records.prototype import Prototype
from tbcad.records.prototype_drive import Phase
from tbcad.records.run import Frame
from tbcad.records.tables import BallRow, MirrorRow, PictureRow, SagRow, StopRow
from tbcad.rig.runs import export_digests

SETTINGS, STEPPER = "grbl_settings.txt", "MANUAL_STEPPER STEPPER=base"
KLIPPER = "klipper"


@dataclass(frozen=True)
class _Words:
    """How the program of a firmware is called, and what it has for what a run takes from it."""

    file: str
    move: re.Pattern[str]  # to an angle, in degrees
    stop: re.Pattern[str]  # its number, and that of the last
    pause: re.Pattern[str]  # what it asks for
    known: re.Pattern[str]  # the angle that the base is at when it is homed
    home: re.Pattern[str]  # the search for the switch


_GRBL = _Words(
    "rotation_plan.nc",
    re.compile(r"G1 [XA](-?\d+\.\d+)(?: F\d+(?:\.\d+)?)?$"),
    re.compile(r"\(stop (\d+) of (\d+): "),
    re.compile(r"M0 \(MSG, (.*)\)$"),
    re.compile(r"G92 [XA](-?\d+\.\d+)$"),
    re.compile(r"\$H$"),
)
_MOVE = re.compile(rf"{STEPPER} MOVE=(-?\d+(?:\.\d+)?) SPEED=\d+(?:\.\d+)?$")
_KLIPPER = _Words(
    "rotation_plan_klipper.gcode",
    _MOVE,
    re.compile(r"; stop (\d+) of (\d+): "),
    re.compile(r'RESPOND MSG="(.*)"$'),
    _MOVE,  # off the switch
    re.compile(rf"{STEPPER} MOVE=.* STOP_ON_ENDSTOP="),
)
_TURN = "turn the object"
FILES = (DESIGN_FILE, MirrorRow.FILE, RECORD, BallRow.FILE, PictureRow.FILE, StopRow.FILE)
"""What a run depends on, besides the program, and settings that can be sent."""
TURNS: tuple[Literal[0, 180], ...] = (0, 180)
ANGLE_DEG = 1e-3  # a program's angles are truncated to 1e-4
DIRECTION = 3  # the setting that is changed where the base turns against its arrow
_SETTING = re.compile(r"\$(\d+)=(-?\d+(?:\.\d+)?)$")
PIN_FIRST = (
    "leave the supply on, for only the motor holds the base: zero pin in first, or the base falls"
)
"""What is safe when a machine does not do what it is told."""


@dataclass(frozen=True)
class Move:
    """A motion of the base."""

    line: str
    angle_deg: float  # base angle that it ends at


@dataclass(frozen=True)
class Program:
    """The motions of the controller's program."""

    ready: str  # what a person must have done before the start
    known_angle: tuple[str, ...]  # lines that bring the base to a known angle and set it
    known_deg: float  # that angle
    homes: bool  # whether the controller finds that angle by its switch
    start: Move  # below the first stop: stops are reached from there, from one side
    stops: dict[int, Move]  # by their numbers
    turn: str  # what a person must do between both runs
    end: Move  # where the base is left


def read_program(folder: Path, firmware: Firmware) -> Program:
    """The program of a build that tbcad build wrote for a firmware."""
    words = _words(firmware)
    path = folder / words.file
    if not path.is_file():
        raise InputError(f"{path} is not there: build the prototype too, tbcad build")
    try:
        return _program(path.read_text(encoding="ascii").splitlines(), words)
    except (ValueError, IndexError, StopIteration, OSError) as error:
        raise InputError(f"{path} is no program of tbcad: {error}: {REBUILD}") from None


def _words(firmware: Firmware) -> _Words:
    return _KLIPPER if firmware == KLIPPER else _GRBL


def _program(lines: list[str], words: _Words) -> Program:
    first = next(i for i, line in enumerate(lines) if words.stop.match(line))
    turn = next(i for i, line in enumerate(lines) if _TURN in line and words.pause.match(line))
    before = [line for line in lines[:first] if not line.startswith("(")]
    angle = [line for line in before[1:-1] if not line.startswith("M65")]
    known = [float(match[1]) for line in angle if (match := words.known.match(line))]
    if not known:
        raise ValueError("it sets no angle")
    pause = "pause with a message"
    return Program(
        ready=_matched(words.pause, before[0], pause)[1],
        known_angle=tuple(angle),
        known_deg=known[0],
        homes=any(map(words.home.match, angle)),
        start=_move(before[-1], words),
        stops=_stops(lines[:turn], words),
        turn=_matched(words.pause, lines[turn], pause)[1],
        end=_move([line for line in lines[turn:] if words.move.match(line)][-1], words),
    )


def _stops(lines: list[str], words: _Words) -> dict[int, Move]:
    found = [
        (int(match[1]), int(match[2]), _move(lines[i + 1], words))
        for i, line in enumerate(lines)
        if (match := words.stop.match(line))
    ]
    if [number for number, _, _ in found] != list(range(1, found[0][1] + 1)):
        raise ValueError("its stops are not numbered from 1 to the last")
    return {number: move for number, _, move in found}


def _move(line: str, words: _Words) -> Move:
    return Move(line, float(_matched(words.move, line, "motion of the base")[1]))


def _matched(form: re.Pattern[str], line: str, what: str) -> re.Match[str]:
    if (match := form.match(line)) is None:
        raise ValueError(f"{line!r:.40} is no {what}")
    return match


@dataclass(frozen=True)
class ControlPlan:
    """All that a run needs of a build."""

    sha256: dict[str, str]  # of each file that it depends on, by name
    size_px: tuple[int, int]  # columns and rows of the design's camera
    firmware: Firmware  # of the controller
    axis: str
    phases: tuple[Phase, ...]  # of a stop, in order
    motion: MotionSpec
    settings: dict[int, float]  # of the controller, by number; Klipper has none
    program: Program
    frames: tuple[Frame, ...]  # of both runs, in order

    @property
    def outputs(self) -> tuple[int, ...]:
        """Digital outputs of all lights."""
        return tuple(phase.output for phase in self.phases if phase.output is not None)


def read_control_plan(folder: Path) -> ControlPlan:
    """Read a build with a prototype; InputError: what is missing or does not fit."""
    design = DesignRecord.read(folder / DESIGN_FILE)
    controller = Prototype.read(folder / RECORD).controller
    firmware = controller.firmware
    program, settings = read_program(folder, firmware), () if firmware == KLIPPER else (SETTINGS,)
    angles = _angles(folder, program)
    return ControlPlan(
        sha256=export_digests(folder, (*FILES, _words(firmware).file, *settings), [SagRow.FILE]),
        size_px=(design.cameras[0].width_px, design.cameras[0].height_px),
        firmware=firmware,
        axis=controller.axis,
        phases=controller.phases,
        motion=design.spec.prototype.motion,
        settings={k: v for name in settings for k, v in read_settings(folder / name).items()},
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
    try:
        lines = path.read_text(encoding="ascii").splitlines()
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}: {REBUILD}") from None
    for number, line in enumerate(lines, 1):
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
            raise InputError(f"{path}: the program does not drive to stop {stop}: {REBUILD}")
    if len(angles) != len(program.stops):
        raise InputError(f"{path} has another number of stops than the program: {REBUILD}")
    return angles


class _Fault(Exception):
    def __init__(self, text: str) -> None:
        """Keep the text as one line: parts of it come from a controller or a camera."""
        super().__init__(one_line(text))


class MachineFault(_Fault):
    """The base cannot go on: the run stops here, and can be resumed."""


class ControllerReset(MachineFault):
    """The controller began anew in mid-run: it has forgotten its angle."""


class CameraFault(_Fault):
    """A photograph that was not taken, or cannot be used: the run goes on with the next."""
