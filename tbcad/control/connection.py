"""The machine behind --port: a controller on a serial port, or Klipper behind Moonraker."""

from contextlib import ExitStack
from pathlib import Path

from tbcad.control.base import Base
from tbcad.control.grbl import Grbl
from tbcad.control.klipper.base import KlipperBase
from tbcad.control.klipper.files import read_klipper_files
from tbcad.control.klipper.host import Klipper
from tbcad.control.klipper.moonraker import PREFIX, Moonraker, read_address
from tbcad.control.machine import Machine
from tbcad.control.plan import Plan
from tbcad.control.port import SerialPort
from tbcad.errors import InputError
from tbcad.types import Progress


def machine_at(port: str, folder: Path, plan: Plan, note: Progress, stack: ExitStack) -> Machine:
    """Open a port.

    Args:
        port: name of a serial port, or "moonraker:" and a URL.
        folder: of the build.
        plan: of the build.
        note: called with what the operator should know.
        stack: closes the port.

    Raises:
        InputError: the port cannot be opened, or the build is for another controller.
    """
    if port.startswith(PREFIX):
        server = Moonraker(read_address(port.removeprefix(PREFIX)))
        return KlipperBase(Klipper(server, note), plan, read_klipper_files(folder))
    if "://" in port:
        raise InputError(f"--port is {port!r:.60}: for Klipper say {PREFIX}http://HOST")
    line = SerialPort(port)
    stack.callback(line.close)
    return Base(Grbl(line, note), plan)
