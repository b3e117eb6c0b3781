"""The controller's side of the protocol and ours, line by line."""

from collections.abc import Iterator

import pytest

from tbcad.errors import InputError
from tbcad.rig.control.grbl import Grbl
from tbcad.rig.control.messages import SerialPort, Status, parse
from tbcad.rig.control.plan import MachineFault
from tests.rig.control.grbl_double import GrblDouble

SETTINGS = {1: 255.0, 20: 0.0, 22: 1.0, 25: 360.0, 27: 2.0, 110: 900.0, 120: 50.0, 130: 200.0}


@pytest.fixture
def double() -> Iterator[GrblDouble]:
    controller = GrblDouble(SETTINGS, switch_deg=-100.0)
    controller.start()
    yield controller
    controller.close()


@pytest.fixture
def grbl(double: GrblDouble) -> Iterator[Grbl]:
    port = SerialPort(double.port)
    found = Grbl(port, lambda _: None)
    found.connect()
    yield found
    port.close()


@pytest.fixture
def homed(grbl: Grbl) -> Grbl:
    grbl.command("$H", silent_s=5)
    grbl.command("G21 G90 G94 G54 (modes)")
    grbl.command("G92 X-98")
    return grbl


def test_lines_that_are_refused_or_not_sent(homed: Grbl, double: GrblDouble) -> None:
    for line, says in (
        ("G1 X1", "error:22: no feed is set"),
        ("G2 X1 F1", "error:20: the command is not supported"),
        ("M64 P9", "error:39: the value is out of range"),
        ("$Q", r"error:3: the \$ command is not known"),
        ("G4 P" + "0" * 80, "longer than 79 characters"),
    ):
        with pytest.raises(MachineFault, match=says):
            homed.command(line)
    assert double.lines[-1] == "$Q"


def test_rest_of_a_line_of_a_killed_program_is_forgotten(double: GrblDouble) -> None:
    port = SerialPort(double.port)
    port.write(b"G1 X-1")
    port.close()
    port = SerialPort(double.port)
    again = Grbl(port, lambda _: None)
    again.connect()
    again.command("$H", silent_s=5)
    assert double.lines == ["$H"]
    port.close()


def test_port_is_ours_alone_and_its_line_stays_up_when_closed(double: GrblDouble) -> None:
    """Else the next start would reset the board, and the motor would let the base go."""
    termios = pytest.importorskip("termios")
    with open(double.port, "rb", buffering=0) as line:
        modes = termios.tcgetattr(line)
        modes[2] |= termios.HUPCL
        termios.tcsetattr(line, termios.TCSANOW, modes)
        port = SerialPort(double.port)
        with pytest.raises(InputError, match="another program uses it"):
            SerialPort(double.port)
        port.close()
        assert not termios.tcgetattr(line)[2] & termios.HUPCL


@pytest.mark.parametrize("line", ["[MSG:'$H'|'$X' to unlock]", ">G54G20:ok", "okay", "<broken"])
def test_lines_that_tell_nothing(line: str) -> None:
    assert (parse(line).kind, parse(line).code) == ("other", 0)
    assert parse("GrblHAL 1.1f ['$' or '$HELP' for help]").kind == "banner"


def test_status_reports() -> None:
    found = parse("<Hold:0|MPos:5.000,2.000,0.000|FS:500,8000|WCO:1.500,0.000,0.000>").status
    assert found is not None
    assert (found.state, found.substate) == ("Hold", 0)
    assert (found.place("MPos", "X"), found.place("WCO", "X")) == (5, 1.5)
    assert found.place("WPos", "X") is found.place("MPos", "A") is None
    assert parse("<Idle|MPos:5.0,x>").status == Status("Idle", None, {"MPos": ()})
