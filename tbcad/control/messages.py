"""Lines that GRBL and grblHAL send, as records.

Source: doc/markdown/interface.md of GRBL 1.1h; report.c of grblHAL core.
"""

import re
from dataclasses import dataclass, field
from typing import Literal

Kind = Literal["ok", "error", "alarm", "banner", "status", "setting", "other"]
AXES = "XYZABC"
RESTING = ("Idle", "Alarm", "Sleep", "Check")
_BANNER = re.compile(r"Grbl(HAL)? \d", re.IGNORECASE)
_FIRMWARES = {"grblhal": re.compile(r"grblhal", re.I), "grbl": re.compile(r"Grbl 1\.1\w? \['\$'")}
_CODE = re.compile(r"(error|ALARM):(\d+)")
_SETTING = re.compile(r"\$(\d+)=(-?\d+(?:\.\d+)?)")
_PLACES = ("MPos", "WPos", "WCO")


@dataclass(frozen=True)
class Status:
    """A status report.

    Attributes:
        state: Idle, Run, Hold, Jog, Alarm, Door, Check, Home, Sleep or Tool.
        substate: number behind the state's colon; 0 in Hold: at rest. None: not said.
        places: MPos, WPos and WCO as far as they are reported, each by axis.
    """

    state: str
    substate: int | None = None
    places: dict[str, tuple[float, ...]] = field(default_factory=dict)

    @property
    def resting(self) -> bool:
        """Whether nothing moves: Hold:1, Door:2 and Door:3 still do."""
        held = {"Hold": (0, None), "Door": (0, 1, None)}.get(self.state)
        return self.state in RESTING if held is None else self.substate in held

    def place(self, kind: str, axis: str) -> float | None:
        """Coordinate of an axis, if it is reported."""
        values, index = self.places.get(kind, ()), AXES.index(axis)
        return values[index] if index < len(values) else None


@dataclass(frozen=True)
class Message:
    """A line of the controller.

    Attributes:
        kind: of message.
        text: the line.
        code: of an error or alarm, or the setting's number.
        value: of a setting.
        status: of a status report.
    """

    kind: Kind
    text: str
    code: int = 0
    value: float = 0.0
    status: Status | None = None


def firmware_of(texts: list[str]) -> str:
    """Firmware that a greeting, and the answers to $I, tell: grblhal, grbl or "" (neither).

    A grblHAL that is built to be compatible greets as GRBL 1.1 does, and tells by $I.
    """
    return next((name for name, form in _FIRMWARES.items() if any(map(form.search, texts))), "")


def parse(line: str) -> Message:
    """What a line says."""
    if line == "ok":
        return Message("ok", line)
    if match := _CODE.match(line):
        return Message("error" if match[1] == "error" else "alarm", line, int(match[2]))
    if _BANNER.match(line):
        return Message("banner", line)
    if line.startswith("<") and line.endswith(">"):
        return Message("status", line, status=_status(line[1:-1]))
    if match := _SETTING.match(line):
        return Message("setting", line, int(match[1]), float(match[2]))
    return Message("other", line)


def _status(text: str) -> Status:
    first, *fields = text.split("|")
    state, _, substate = first.partition(":")
    named = dict(one.partition(":")[::2] for one in fields)
    places = {name: _numbers(named[name]) for name in _PLACES if name in named}
    return Status(state, int(substate) if substate.isdigit() else None, places)


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        return ()
