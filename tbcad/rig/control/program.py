"""rotation_plan.nc as it is driven by a run: the program's own motions, photographed one by one.

Pauses of the program become questions to the operator, and what it does for each photograph is done
by the run: a light, the camera, the light off again.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from tbcad.cad.formats.checked_files import REBUILD
from tbcad.errors import InputError

PROGRAM = "rotation_plan.nc"
_MOVE = re.compile(r"G1 ([XA])(-?\d+\.\d+)(?: F\d+(?:\.\d+)?)?$")
_STOP = re.compile(r"\(stop (\d+) of (\d+): ")
_PAUSE = re.compile(r"M0 \(MSG, (.*)\)$")
_SET = re.compile(r"G92 [XA](-?\d+\.\d+)$")
_TURN = "turn the object"
_HOME = "$H"


@dataclass(frozen=True)
class Move:
    """A motion of the base."""

    line: str
    angle_deg: float  # base angle that it ends at


@dataclass(frozen=True)
class Program:
    """The motions of rotation_plan.nc."""

    ready: str  # what a person must have done before the start
    known_angle: tuple[str, ...]  # lines that bring the base to a known angle and set it
    known_deg: float  # that angle
    homes: bool  # whether the controller finds that angle by its switch
    start: Move  # below the first stop: stops are reached from there, from one side
    stops: dict[int, Move]  # by their numbers
    turn: str  # what a person must do between both runs
    end: Move  # where the base is left


def read_program(folder: Path) -> Program:
    """The program of an export that tbcad build wrote."""
    path = folder / PROGRAM
    if not path.is_file():
        raise InputError(f"{path} is not there: build the prototype too, tbcad build")
    try:
        return _program(path.read_text(encoding="ascii").splitlines())
    except (ValueError, IndexError, StopIteration, OSError) as error:
        raise InputError(f"{path} is no program of tbcad: {error}: {REBUILD}") from None


def _program(lines: list[str]) -> Program:
    first = next(i for i, line in enumerate(lines) if _STOP.match(line))
    turn = next(i for i, line in enumerate(lines) if _TURN in line and _PAUSE.match(line))
    before = [line for line in lines[:first] if not line.startswith("(")]
    angle = [line for line in before[1:-1] if not line.startswith("M65")]
    known = [float(match[1]) for line in angle if (match := _SET.match(line))]
    if not known:
        raise ValueError("it sets no angle")
    return Program(
        ready=_message(before[0]),
        known_angle=tuple(angle),
        known_deg=known[0],
        homes=_HOME in angle,
        start=_move(before[-1]),
        stops=_stops(lines[:turn]),
        turn=_message(lines[turn]),
        end=_move([line for line in lines[turn:] if line.startswith("G1 ")][-1]),
    )


def _stops(lines: list[str]) -> dict[int, Move]:
    found = [
        (int(match[1]), int(match[2]), _move(lines[i + 1]))
        for i, line in enumerate(lines)
        if (match := _STOP.match(line))
    ]
    if [number for number, _, _ in found] != list(range(1, found[0][1] + 1)):
        raise ValueError("its stops are not numbered from 1 to the last")
    return {number: move for number, _, move in found}


def _move(line: str) -> Move:
    match = _MOVE.match(line)
    if match is None:
        raise ValueError(f"{line!r:.40} is no motion of the base")
    return Move(line, float(match[2]))


def _message(line: str) -> str:
    match = _PAUSE.match(line)
    if match is None:
        raise ValueError(f"{line!r:.40} is no pause with a message")
    return match[1]
