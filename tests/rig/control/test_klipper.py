"""A run with Klipper: what it sends, and what it does when Klipper or people interfere."""

import re
from itertools import pairwise
from typing import Any

import pytest

from tbcad.app.cli import run as tbcad
from tbcad.rig.control.klipper_base import PIECE_S
from tests.rig.control.conftest import Told
from tests.rig.control.rig import ALL, Rig, at, check_every_photograph, check_goes_on, events, until


@pytest.fixture(autouse=True)
def never_let_fall(klipper_rig: Rig) -> Any:
    """An emergency stop would let the base fall; an unknown command would be no error."""
    yield
    assert klipper_rig.controller.emergency_stops == 0
    assert not klipper_rig.controller.unknown
    assert not klipper_rig.controller.machine.lights


def moves(rig: Rig) -> list[float]:
    """Where motions after homing end."""
    lines = [line for line in rig.controller.lines if "STOP_ON" not in line]
    return [float(found[1]) for line in lines if (found := re.search(r"MOVE=(\S+)", line))]


def test_what_klipper_is_sent(klipper_rig: Rig) -> None:
    assert tbcad(klipper_rig.words("--phases", "dark,lit", "--runs", "a", stops="2,5")) == 0
    lines = klipper_rig.controller.lines
    begin = lines.index("MANUAL_STEPPER STEPPER=base ENABLE=1 SET_POSITION=0")
    assert begin < lines.index("SET_PIN PIN=lamp VALUE=1")
    assert lines.count("SET_PIN PIN=lamp VALUE=1") == 2
    moved = [index for index, line in enumerate(lines) if "MOVE=" in line]
    assert all(lines[index + 1] == "M400" for index in moved)
    to = moves(klipper_rig)
    up = to[: to.index(max(to)) + 1]
    assert up[1:] == sorted(up[1:])  # from below, after the pull-off
    assert klipper_rig.controller.machine.angle == pytest.approx(0, abs=0.01)
    assert klipper_rig.controller.motor_on


def test_motions_come_in_short_pieces(klipper_rig: Rig) -> None:
    """At 15 degrees a second and 50 degrees/s^2 a piece is 18 degrees at most; homing at 6, 8.3."""
    assert tbcad(klipper_rig.words("--phases", "dark", "--runs", "a", stops="1,30")) == 0
    to = moves(klipper_rig)
    assert max(abs(a - b) for a, b in pairwise(to)) <= 15 * (PIECE_S - 15 / 50) + 1e-3
    search = re.findall(
        r"MOVE=(\S+) SPEED=6 STOP_ON_ENDSTOP=2", "\n".join(klipper_rig.controller.lines)
    )
    assert max(float(a) - float(b) for a, b in pairwise(["0", *search])) <= 8.3


LED = "SET_PIN PIN=led_3 VALUE=1"


OFF = "SET_PIN PIN=lamp VALUE=0"
BY_HAND = "hold the base by hand and put the zero pin in first"
STOPS = {
    "shutdown": (
        LED,
        "stopped: Klipper is in state shutdown: Shutdown due to webhooks request",
        f"the base falls: {BY_HAND}",
    ),
    "disconnected": (
        LED,
        "stopped: Klipper is in state disconnected",
        "goes off when Klipper starts, and the base falls: hold the base by hand",
    ),
    # While an LED is on, which must not stay so.
    "error": ("G4 P0", "stopped: Klipper refuses 'G4 P0': Timer too close", ""),
    # By M84 or RESTART in another window: the next motion would switch the motor on again.
    "let_go": (LED, "stopped: Klipper has let the motor go", "put the zero pin in first"),
    "restart": (OFF, "stopped: Klipper has let the motor go", "put the zero pin in first"),
    "go_away": (
        LED,
        "stopped: Moonraker: ",
        f"lights may be on: Moonraker: .*before any supply is cut, {BY_HAND}",
    ),
}
"""What happens, at which line, and what is told."""


@pytest.mark.parametrize("what", STOPS)
def test_what_stops_a_run(klipper_rig: Rig, what: str, stopped: Told) -> None:
    controller, (line, says, look) = klipper_rig.controller, STOPS[what]
    act = getattr(controller, what, lambda: None)
    fault = "drop" if what == "go_away" else None if hasattr(controller, what) else what
    controller.fault = at(line, fault, act)
    out = stopped(klipper_rig.words())
    assert says in out
    assert ("LOOK AT THE MACHINE" in out) == bool(look)
    assert re.search(look, out)
    assert events(klipper_rig.out)[-1] == "stopped"
    last = controller.lines[::-1].index(line)
    assert not any("MOVE=" in one for one in controller.lines[len(controller.lines) - last :])
    controller.away = False
    if controller.state != "ready":
        controller.restart()
    check_goes_on(klipper_rig, ALL)


@pytest.mark.parametrize("before", ["MOVE=", "G4 P0"])
def test_shutdown_while_something_is_waited_for(
    klipper_rig: Rig, before: str, stopped: Told
) -> None:
    """M400 ends without an error then: nothing may be photographed after it."""
    controller = klipper_rig.controller

    def fault(number: int, line: str) -> str | None:
        later = "SET_PIN PIN=lamp VALUE=1" in controller.lines
        return "shutdown" if later and line == "M400" and before in controller.lines[-2] else None

    controller.fault = fault
    assert "stopped: Klipper is in state shutdown" in stopped(klipper_rig.words())
    controller.restart()
    check_goes_on(klipper_rig, ALL)


def test_connection_that_breaks_once(klipper_rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    klipper_rig.controller.fault = at("M400", "drop")
    assert tbcad(klipper_rig.words()) == 0
    check_every_photograph(klipper_rig.out, ALL)
    assert capsys.readouterr().err.count("once more") == 1


@pytest.mark.parametrize("seen", [0, 1])
def test_moonraker_that_begins_anew(klipper_rig: Rig, seen: int) -> None:
    """It finds Klipper after it listens again, whichever connection tells of it first."""
    controller = klipper_rig.controller

    def restart() -> None:
        controller.searching = 3
        until(lambda: controller.searching <= 3 - seen)

    controller.fault = at("M400", "drop", restart)
    assert tbcad(klipper_rig.words("--phases", "dark")) == 0
    assert controller.searching == 0


def test_other_programs_motion_is_waited_for(
    klipper_rig: Rig, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tbcad.rig.control.klipper.LATE_S", -1000.0)
    controller = klipper_rig.controller

    def busy() -> None:
        before = controller.asked
        until(lambda: controller.asked > before + 2)

    controller.fault = at("M400", None, busy)
    assert tbcad(klipper_rig.words("--phases", "dark", stops="1")) == 0
    assert "does another program give it G-code?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("attribute", "value", "says"),
    [
        ("stuck_switch", True, "the pull-off did not release the switch"),
        ("switch_deg", -1000.0, "the switch was not found within"),
    ],
)
def test_homing_that_fails(
    klipper_rig: Rig, attribute: str, value: object, says: str, stopped: Told
) -> None:
    setattr(klipper_rig.controller, attribute, value)
    assert says in stopped(klipper_rig.words())
