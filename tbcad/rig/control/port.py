"""The serial port that the controller is plugged into."""

import errno
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Protocol, TypeVar

from tbcad.errors import InputError
from tbcad.rig.control.machine import MachineFault

if TYPE_CHECKING:
    from serial import Serial

BAUD = 115_200  # of GRBL 1.1 and grblHAL; boards with USB of their own take any
READ_S, WRITE_S = 0.02, 2.0
INSTALL = "pip install 'tbcad[machine]'"
Result = TypeVar("Result")


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
