"""The serial line to a controller, and the lines that GRBL and grblHAL send, as records.

Source: doc/markdown/interface.md of GRBL 1.1h; report.c of grblHAL core.
"""

import errno
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol, TypeVar

from tbcad.errors import InputError
from tbcad.rig.control.plan import MachineFault

if TYPE_CHECKING:
    from serial import Serial

BAUD = 115_200  # of GRBL 1.1 and grblHAL; boards with USB of their own take any
READ_S, WRITE_S = 0.02, 2.0
INSTALL = "pip install 'tbcad[machine]'"
Result = TypeVar("Result")
Kind = Literal["ok", "error", "alarm", "banner", "status", "setting", "other"]
AXES = "XYZABC"
RESTING = ("Idle", "Alarm", "Sleep", "Check")
_BANNER = re.compile(r"Grbl(HAL)? \d", re.IGNORECASE)
_FIRMWARES = {"grblhal": re.compile(r"grblhal", re.I), "grbl": re.compile(r"Grbl 1\.1\w? \['\$'")}
_CODE = re.compile(r"(error|ALARM):(\d+)")
_SETTING = re.compile(r"\$(\d+)=(-?\d+(?:\.\d+)?)")
_PLACES = ("MPos", "WPos", "WCO")
ERRORS = {
    1: "a word without its letter",
    2: "a number is missing or badly written",
    3: "the $ command is not known",
    4: "a negative value where none is allowed",
    5: "homing is not enabled: set $22=1",
    6: "the step pulse is too short",
    7: "the settings in the memory were damaged: defaults are in use, send grbl_settings.txt",
    8: "$ commands are for an idle controller only",
    9: "G-code is locked: the controller is in alarm",
    10: "soft limits need homing: set $22=1",
    11: "the line is too long",
    12: "steps and speed are more than the controller can do",
    13: "the safety door is open",
    14: "the line is too long to be stored",
    15: "the jog is beyond the travel",
    16: "the jog is no jog",
    17: "laser mode needs PWM",
    18: "reset is asserted",
    19: "the value must be above zero",
    20: "the command is not supported: is this the controller that the export was built for?",
    21: "two commands of one group",
    22: "no feed is set",
    23: "a whole number is needed",
    24: "two commands want the axis words",
    25: "a word is there twice",
    26: "no axis word",
    27: "the line number is not allowed",
    28: "a value is missing",
    29: "G59.x is not supported",
    30: "G53 goes with G0 and G1 only",
    31: "axis words that nothing uses",
    33: "the target is not allowed",
    36: "words that nothing uses",
    39: "the value is out of range: has the board so many outputs?",
    45: "a limit switch is pressed: only homing is allowed",
    46: "the controller must be homed",
    49: "the self test failed: zero pin in, then switch the controller off and on",
    50: "the emergency stop is pressed: zero pin in before it is released",
    51: "the motor's driver reports a fault and may let go: zero pin in before you touch it",
    52: "the setting is out of range",
    53: "the setting is not available on this board",
    58: "the board has no such output",
    79: "not allowed before the alarm is cleared",
    85: "the output cannot be used",
}
ALARMS = {
    1: "a limit switch was pressed in mid-motion: the angle is lost",
    2: "the target is beyond the soft limits",
    3: "reset in mid-motion: the angle is lost",
    4: "the probe was pressed before",
    5: "the probe was not pressed",
    6: "homing was interrupted by a reset",
    7: "homing was interrupted by the safety door",
    8: "homing: the pull-off did not release the switch; look at its wiring, or enlarge $27",
    9: "homing: the switch was not found; look at its wiring, $5 and $23",
    10: "the emergency stop is pressed: zero pin in before it is released",
    11: "the controller must be homed",
    12: "a limit switch is pressed",
    16: "the self test failed: zero pin in, then switch the controller off and on",
    17: "the motor's driver reports a fault and may let go: zero pin in before you touch it",
    18: "homing is set wrongly",
    20: "an output expander does not answer",
    21: "the memory of the settings failed",
    22: "a buffer overflowed",
}
STATES = {
    "Idle": "look at its cable",
    "Alarm": "it is locked, and takes $X or $H only",
    "Check": "it moves nothing in check mode: reset it",
    "Sleep": "its motor is off, and the base may have fallen: zero pin in, then start again",
}
"""What a controller that rests, and answers a line by nothing, wants."""
UNKNOWN = "its meaning is in the manual of the controller's firmware"


class Port(Protocol):
    """What a controller is spoken to through."""

    def write(self, data: bytes) -> None:
        """Send bytes."""

    def read(self, wait: bool) -> bytes:
        """Return the bytes that have come; wait for the first for a moment at most."""

    def close(self) -> None:
        """Give the port up."""


class SerialPort:
    """A port of pyserial's; its errors are those of a machine."""

    def __init__(self, name: str) -> None:
        """Open a port."""
        try:
            import serial
        except ImportError:
            raise InputError(f"pyserial is not installed: {INSTALL}") from None
        try:
            self._port = serial.Serial(
                name, BAUD, timeout=READ_S, write_timeout=WRITE_S, exclusive=True
            )
        except (OSError, ValueError) as error:
            raise InputError(f"{name} cannot be opened: {opening_reason(error)}") from None
        _keep_line_up(self._port)

    def write(self, data: bytes) -> None:
        """Send bytes."""
        _checked(lambda: self._port.write(data))

    def read(self, wait: bool) -> bytes:
        """Return the bytes that have come; wait for the first for READ_S at most."""
        return bytes(_checked(lambda: self._port.read(self._port.in_waiting or int(wait))))

    def close(self) -> None:
        """Give the port up."""
        self._port.close()


def _keep_line_up(port: "Serial") -> None:
    """Leave DTR up when the port is closed: boards that begin anew when it rises let the motor go.

    So only the first opening after the board was plugged in resets it. Source: termios(3), HUPCL.
    """
    with suppress(ImportError):
        import termios

        with suppress(OSError, termios.error):
            modes = termios.tcgetattr(port.fileno())
            modes[2] &= ~termios.HUPCL
            termios.tcsetattr(port.fileno(), termios.TCSANOW, modes)


def _checked(action: Callable[[], Result]) -> Result:
    try:
        return action()
    except (OSError, TypeError) as error:  # pyserial's are OSErrors; TypeError: closed meanwhile
        raise MachineFault(f"the controller's port is gone ({error}): is it plugged in?") from None


def opening_reason(error: OSError | ValueError) -> str:
    """Why a port cannot be opened, and what to do."""
    code = getattr(error, "errno", None)
    if code == errno.ENOENT:
        return "there is no such port: plug the controller in, and look at ls /dev/tty*"
    if code in (errno.EACCES, errno.EPERM):
        return (
            "no permission: add yourself to the group of serial ports, sudo usermod -aG dialout "
            "$USER, and log in again"
        )
    if code in (errno.EAGAIN, errno.EBUSY) or "lock" in str(error).lower():
        return "another program uses it: close that program"
    return f"{error}: name the port of the controller, for example /dev/ttyUSB0"


@dataclass(frozen=True)
class Status:
    """A status report."""

    state: str  # Idle, Run, Hold, Jog, Alarm, Door, Check, Home, Sleep or Tool
    # number behind the state's colon; 0 in Hold: at rest. None: not said.
    substate: int | None = None
    # MPos, WPos and WCO as far as they are reported, each by axis
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
    """A line of the controller."""

    kind: Kind
    text: str
    code: int = 0  # of an error or alarm, or the setting's number
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


def meaning(message: Message) -> str:
    """What an error or an alarm means."""
    return (ERRORS if message.kind == "error" else ALARMS).get(message.code, UNKNOWN)
