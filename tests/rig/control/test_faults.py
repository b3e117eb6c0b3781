"""Faults in mid-run: what can go on goes on, what cannot stops with lights off, nothing is lost."""

import errno
import re
import shutil
import signal
from pathlib import Path
from threading import Event
from unittest.mock import patch

import pytest

from tbcad.app.cli import run as tbcad
from tbcad.rig import runs
from tbcad.rig.control.base import Base
from tbcad.rig.control.plan import read_settings
from tests.rig.control.conftest import Told
from tests.rig.control.grbl_double import GrblDouble
from tests.rig.control.rig import (
    ALL,
    FAST,
    PER_STOP,
    Rig,
    at,
    check_every_photograph,
    check_goes_on,
    content,
    events,
    journal,
    killed_run,
    until,
)


@pytest.mark.parametrize("what", ["drop_ok", "drop_line"])
def test_lost_ok_or_line(rig: Rig, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    """One of each kind of line: a motion, a dwell, a light on, a light off."""
    faults = [at(start, what) for start in ("G1 ", "G4 ", "M64 ", "M65 ")]
    rig.controller.fault = lambda number, line: next(
        (found for fault in faults if (found := fault(number, line))), None
    )
    assert tbcad(rig.words("--phases", "dark,led_1,lit", "--runs", "a", stops="1-8")) == 0
    check_every_photograph(rig.out, 24)
    assert capsys.readouterr().err.count("no ok came; once more") == len(faults)


def test_no_ok_at_all_stops(rig: Rig, stopped: Told) -> None:
    rig.controller.fault = lambda number, line: "drop_ok" if line == "M64 P2" else None
    assert "'M64 P2': the controller is idle but sends no ok" in stopped(rig.words())
    assert not rig.controller.machine.lights


@pytest.mark.parametrize(
    ("what", "says"),
    [
        ("power", "the controller began anew at 'M64 P3'"),
        ("alarm", "stopped at 'M64 P3': ALARM:1: a limit switch was pressed in mid-motion"),
    ],
)
def test_controller_stops(rig: Rig, what: str, says: str, stopped: Told) -> None:
    rig.controller.fault = at("M64 P3", what)
    out = stopped(rig.words())
    assert out.startswith("NOT COMPLETE: ")
    assert says in out
    assert "LOOK AT THE MACHINE" not in out
    assert not rig.controller.machine.lights
    assert events(rig.out)[-1] == "stopped"
    check_goes_on(rig, ALL)
    assert rig.controller.lines.count("$H") == 2


def test_reset_in_mid_motion(rig: Rig, stopped: Told) -> None:
    """The program is told by alarm and banner, before its `ok` would come."""
    rig.controller.run_at(20.0)
    moves: list[str] = []

    def fault(number: int, line: str) -> str | None:
        moves.extend([line] if line.startswith("G1 ") else [])
        return "reset" if len(moves) == 2 and line.startswith("G4") else None

    rig.controller.fault = fault
    out = stopped(rig.words("--phases", "dark", "--runs", "a", stops="1,9"))
    assert "ALARM:3: reset in mid-motion: the angle is lost" in out
    check_goes_on(rig, 2)


@pytest.mark.slow
def test_unplugged(rig: Rig, stopped: Told) -> None:
    rig.controller.fault = at("M64 P3", "silence")
    out = stopped(rig.words())
    assert "stopped: 'M64 P3': the controller does not answer" in out
    assert "LOOK AT THE MACHINE: the controller does not answer: lights may be on; " in out
    assert "leave the supply on, for only the motor holds the base: zero pin in first" in out
    assert "switch" not in out.replace("is it plugged in and switched on?", "")
    assert len(out.splitlines()) <= 12
    rig.controller.plug_in()
    check_goes_on(rig, ALL)


def test_interrupt_holds_base_and_switches_lights_off(either_rig: Rig) -> None:
    """On the way to the second stop; with Klipper after the present piece of the motion."""
    controller = either_rig.controller
    grbl = isinstance(controller, GrblDouble)
    on, off = (
        ("M64 P0", "M65 P0") if grbl else ("SET_PIN PIN=lamp VALUE=1", "SET_PIN PIN=lamp VALUE=0")
    )

    def slow(number: int, line: str) -> None:
        if line == off and on in controller.lines:
            controller.run_at(4.0)

    def motions() -> int:
        return sum("G1 X" in line or "MOVE=" in line for line in controller.lines)

    controller.fault = slow
    process = either_rig.start(either_rig.words("--phases", "lit", "--runs", "a", stops="1,30"))
    until(lambda: controller.moving and controller.speed < FAST)
    begun = motions()
    process.send_signal(signal.SIGINT if grbl else signal.SIGTERM)
    out, err = process.communicate(timeout=600)
    assert process.returncode == 1, err
    assert "stopped by the operator" in out
    assert "LOOK AT THE MACHINE" not in out
    assert not controller.machine.lights
    assert motions() == begun
    if grbl:
        assert (controller.held, controller.state, controller.machine.let_go) == (1, "Idle", 0)
    else:
        assert controller.motor_on
        assert not controller.emergency_stops
    check_goes_on(either_rig, 2)


@pytest.mark.parametrize("reports", [True, False])
def test_interrupted_homing_stops_with_the_motor_on(rig: Rig, reports: bool) -> None:
    """The controller answers nothing while it homes, unless bit 12 of $10 is set."""
    controller = rig.controller
    if not reports:
        edit_settings(rig, "$10=4607", "$10=511")
    begun = controller.machine.angle
    controller.on_line = lambda number: controller.run_at(
        0.1 if controller.lines[-1] == "$H" else FAST
    )
    process = rig.start(rig.words())
    until(lambda: controller.state == "Home")
    asked = len(controller.asked)
    until(lambda: len(controller.asked) > asked)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=600)
    assert "stopped by the operator" in out
    assert "LOOK AT THE MACHINE" not in out
    assert not controller.homed
    assert begun > controller.machine.angle > controller.switch_deg
    assert (controller.machine.let_go, controller.state) == (0, "Idle")
    assert not controller.machine.lights
    check_goes_on(rig, ALL)


def edit_settings(rig: Rig, old: str, new: str) -> None:
    """Another grbl_settings.txt, in a copy of the export, and the same on the controller."""
    rig.export = Path(shutil.copytree(rig.export, rig.folder / "export"))
    path = rig.export / "grbl_settings.txt"
    path.write_text(path.read_text().replace(old, new))
    rig.controller.settings |= read_settings(path)


def test_homing_that_does_not_end(rig: Rig, stopped: Told) -> None:
    """The time-out names the state; the base is stopped by a reset, and lights are off."""
    edit_settings(rig, "$10=4607", "$10=511")
    rig.controller.on_line = lambda number: rig.controller.run_at(
        0.01 if rig.controller.lines[-1] == "$H" else FAST
    )
    with patch.object(Base, "_homing_s", lambda self: 0.1):
        out = stopped(rig.words())
    assert re.search(r"'\$H': the controller does not answer: .*; its last state: homing\)", out)
    assert "LOOK AT THE MACHINE" not in out
    assert rig.controller.machine.let_go == 0


def test_interrupted_dwell(rig: Rig) -> None:
    """The lines that switch lights off do not wait for its end."""
    controller = rig.controller
    resting = Event()

    def slow(number: int, line: str) -> None:
        if line.startswith("G4") and controller.lines[-2].startswith("M65"):  # at rest
            controller.run_at(1e-6)
            resting.set()

    controller.fault = slow
    process = rig.start(rig.words("--phases", "lit", "--runs", "a", stops="1"))
    until(resting.is_set)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=600)
    assert process.returncode == 1
    assert "LOOK AT THE MACHINE" not in out
    assert controller.machine.let_go == 0


@pytest.mark.parametrize(
    ("state", "says"),
    [
        ("Sleep", "the controller is sleep but sends no ok: its motor is off"),
        ("Check", "the controller is Check"),
        ("Door:1", "error:13: the safety door is open"),
    ],
)
def test_state_that_stops_a_run_is_named(rig: Rig, state: str, says: str, stopped: Told) -> None:
    controller = rig.controller
    controller.fault = at("G1 X", None, lambda: controller.put_into(state), 1)
    out = stopped(rig.words("--phases", "lit", "--runs", "a", stops="1"))
    assert says in out
    assert ("zero pin in" in out) == (state != "Check")


@pytest.mark.slow
def test_alarm_after_which_grbl_answers_a_reset_only(plain_rig: Rig, stopped: Told) -> None:
    """In mid-run, and at the start of the next."""
    plain_rig.controller.fault = at("G1 X", "alarm")
    out = stopped(plain_rig.words(stops="1"))
    assert "ALARM:1: a limit switch was pressed in mid-motion" in out
    assert "LOOK AT THE MACHINE" not in out
    plain_rig.controller.stop_by_limit()
    assert tbcad(plain_rig.resume()) == 0


def test_base_that_does_not_stop_is_not_let_fall(rig: Rig, stopped: Told) -> None:
    """A reset in mid-motion would switch the motor off."""
    controller = rig.controller
    controller.deaf = True

    def fault(number: int, line: str) -> str | None:
        third = sum(one.startswith("G1 X") for one in controller.lines) == 3
        if third and line.startswith("G1 X"):
            controller.run_at(0.1)
        return "error" if third and line.startswith("G4") else None

    controller.fault = fault
    out = stopped(rig.words("--phases", "lit", "--runs", "a", stops="1,30"))
    assert "LOOK AT THE MACHINE: the base did not stop (Run)" in out
    assert controller.state != "Alarm"


def test_complete_run_needs_no_more(rig: Rig, capsys: pytest.CaptureFixture[str]) -> None:
    assert tbcad(rig.words("--phases", "dark", stops="1")) == 0
    homed = rig.controller.lines.count("$H")
    assert tbcad(rig.resume()) == 0
    assert rig.controller.lines.count("$H") == homed
    assert "COMPLETE: 2 of 2 photographs" in capsys.readouterr().out


NO_FOCUS = ') echo "no focus" >&2; exit 3'


def test_photograph_missed_twice_is_named_and_the_rest_goes_on(rig: Rig, stopped: Told) -> None:
    """The first call is for the trial, the fourth and fifth for the third photograph.

    One that is missed once is taken again at once.
    """
    camera = rig.counting(f"4|5|9{NO_FOCUS}")
    out = stopped(rig.words(camera=camera))
    assert out.startswith(f"NOT COMPLETE: {ALL - 1} of {ALL} photographs")
    assert "missing: a_0001_led_2: the camera's command ended with 3: no focus" in out
    assert events(rig.out).count("missed") == 1
    assert tbcad(rig.words("--resume", camera=camera, stops=None)) == 0
    check_every_photograph(rig.out, ALL)


def test_dead_camera_stops_the_run(rig: Rig, stopped: Told) -> None:
    out = stopped(rig.words(camera=rig.counting(f"[6-9]|??*{NO_FOCUS}")))
    assert "12 photographs in a row are missing" in out
    assert "missing: 7 more, in journal.jsonl" in out
    assert len(out.splitlines()) <= 12


def test_full_disk(rig: Rig, monkeypatch: pytest.MonkeyPatch, stopped: Told) -> None:
    whole, writes = runs.write_safely, list[Path]()

    def full(path: Path, data: bytes) -> None:
        writes.append(path)
        if len(writes) > 20:
            raise OSError(errno.ENOSPC, "No space left on device")
        whole(path, data)

    monkeypatch.setattr(runs, "write_safely", full)
    assert "cannot be written: No space left on device" in stopped(rig.words())
    assert not rig.controller.machine.lights
    monkeypatch.setattr(runs, "write_safely", whole)
    check_goes_on(rig, ALL)


@pytest.mark.slow
def test_three_kills(either_rig: Rig) -> None:
    rig, kills = either_rig, 3
    killed_run(rig, rig.copying, stops=1, kills=kills, seed=1)
    check_every_photograph(rig.out, PER_STOP)
    begun = [one["event"] for one in journal(rig.out) if one["event"] in ("started", "resumed")]
    assert len(begun) > kills // 2
    killed = content(rig.out)
    rig.out.rename(rig.folder / "killed")
    assert tbcad(rig.words(stops="1")) == 0
    assert content(rig.out) == killed
