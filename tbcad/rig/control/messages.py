"""The serial line to a controller, and the lines that GRBL and grblHAL send, as records.

Source: doc/markdown/interface.md of GRBL 1.1h; report.c of grblHAL core.
"""

import errno
import re
import tomllib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.resources import files
from typing import TYPE_CHECKING, Literal, TypeVar

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
CODES = tomllib.loads(files(__package__).joinpath("grbl_codes.toml").read_text("utf-8"))
STATES: dict[str, str] = CODES["resting"]
UNKNOWN = "its meaning is in the manual of the controller's firmware"


class SerialPort:
    """Port to a controller: pyserial's, whose errors are a machine's."""

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
    """Meaning of a line."""
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


def told(line: str, message: Message) -> str:
    """An error or alarm that answers a line, with its meaning."""
    return f"{line!r}: {message.text}: {CODES[message.kind].get(str(message.code), UNKNOWN)}"
