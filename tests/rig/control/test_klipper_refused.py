"""What a run with Klipper refuses before anything moves: one line, exit code 2, nothing written."""

import shutil
import socket
from http import HTTPStatus
from pathlib import Path
from threading import Thread
from types import SimpleNamespace

import pytest

from tbcad.app.cli import run as tbcad
from tbcad.rig.control import klipper_base
from tbcad.rig.control.klipper import Moonraker
from tests.rig.control.conftest import Told
from tests.rig.control.klipper_double import MOTOR
from tests.rig.control.rig import Rig, until


@pytest.fixture
def refused(klipper_rig: Rig, refused: Told) -> Told:
    """The one line that a command of the rig ends with, before anything moves."""

    def line_of(words: list[str]) -> str:
        line = refused(words)
        assert not klipper_rig.out.exists()
        assert not klipper_rig.controller.lines
        return line

    return line_of


def words_to(rig: Rig, port: str) -> list[str]:
    words = rig.words()
    words[words.index("--port") + 1] = port
    return words


FORM = "allowed is moonraker:http://HOST"
KEY = "an API key goes into MOONRAKER_API_KEY"
ADDRESSES = {
    "http://printer": "for Klipper say moonraker:http://HOST",
    "moonraker:ftp://printer": FORM,
    "moonraker:http://printer:99999": FORM,
    "moonraker:http://printer\n": FORM,
    "moonraker:http://[::1": FORM,
    "moonraker:http://user:secret@printer": KEY,
    "moonraker:http://printer/?token=1": KEY,
    "moonraker:http://no-such-printer.invalid": "there is no such host",
}


@pytest.mark.parametrize(("port", "says"), ADDRESSES.items())
def test_addresses(klipper_rig: Rig, refused: Told, port: str, says: str) -> None:
    assert says in refused(words_to(klipper_rig, port))


def test_server_that_does_not_listen_or_speak_so(klipper_rig: Rig, refused: Told) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = f"moonraker:http://127.0.0.1:{server.getsockname()[1]}"
    line = refused(words_to(klipper_rig, port))
    assert "nothing listens there: is this Moonraker? It listens at port 7125" in line
    secure = klipper_rig.controller.port.replace("http:", "https:")
    assert "it does not speak https: say http://" in refused(words_to(klipper_rig, secure))


@pytest.mark.parametrize(
    ("code", "head", "body", "says"),
    [
        (200, {}, b"<html>", "the server answers 200 OK: is this Moonraker?"),
        (502, {}, b"<html>", "the server answers 502 Bad Gateway: is this Moonraker?"),
        (200, {}, b'{"result": {"up": 1}}', "the server is not Moonraker"),
        (200, {}, b"[" * 100_000, "the server answers 200 OK"),
        (301, {"Location": "https://printer/"}, b"", "sends us to https://printer/: name that"),
        (500, {}, b'{"error": {"message": "two\\nlines"}}', "two lines"),
    ],
)
def test_server_that_is_not_moonraker(
    klipper_rig: Rig,
    refused: Told,
    monkeypatch: pytest.MonkeyPatch,
    code: int,
    head: dict[str, str],
    body: bytes,
    says: str,
) -> None:
    response = SimpleNamespace(status=code, reason=HTTPStatus(code).phrase, getheader=head.get)
    monkeypatch.setattr(Moonraker, "_answer", lambda *_: (response, body))
    assert says in refused(klipper_rig.words())


def test_key(klipper_rig: Rig, refused: Told, monkeypatch: pytest.MonkeyPatch) -> None:
    klipper_rig.controller.key = "1234"
    line = refused(klipper_rig.words())
    assert "does not let this computer in: set MOONRAKER_API_KEY" in line
    monkeypatch.setenv("MOONRAKER_API_KEY", "one\ntwo")
    assert "is no API key" in refused(klipper_rig.words())
    monkeypatch.setenv("MOONRAKER_API_KEY", "1234")
    klipper_rig.controller.port = klipper_rig.controller.port.replace("http:", "HTTP:") + "/"
    assert tbcad(klipper_rig.words("--phases", "dark", stops="1")) == 0


STATES = """
startup | Printer is not ready | Klipper is in state startup: Printer is not ready
error | Section 'x' is not valid | then mend what it says and say FIRMWARE_RESTART
shutdown | Lost communication | put the zero pin in first, then say FIRMWARE_RESTART
disconnected |  | put the zero pin in first, then start the service klipper
unheard of |  | put the zero pin in first
"""


@pytest.mark.parametrize("case", STATES.strip().splitlines())
def test_states(klipper_rig: Rig, refused: Told, case: str) -> None:
    state, message, says = case.split(" | ")
    klipper_rig.controller.state, klipper_rig.controller.message = state, f"\n{message}\nmore"
    klipper_rig.controller.started = state != "disconnected"
    line = refused(klipper_rig.words())
    assert says in line
    assert f"Klipper is in state {state}" in line


def test_start_is_waited_for(klipper_rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    controller = klipper_rig.controller
    controller.state = "startup"
    monkeypatch.setattr("tbcad.rig.control.klipper.STARTING_S", {"startup": 60.0})

    def start() -> None:
        until(lambda: controller.asked > 2)
        controller.state = "ready"

    Thread(target=start, daemon=True).start()
    assert tbcad(klipper_rig.words("--phases", "dark", stops="1")) == 0


def test_neither_settings_nor_a_print_are_touched(klipper_rig: Rig, refused: Told) -> None:
    assert "leave --send-settings out" in refused(klipper_rig.words("--send-settings"))
    klipper_rig.controller.print_state = "paused"
    assert "the printer prints a file" in refused(klipper_rig.words())


@pytest.mark.parametrize(
    ("section", "option", "value", "says"),
    [
        (MOTOR, "rotation_distance", 40.0, " is 40.0, not"),
        (MOTOR, "gear_ratio", [[2.0, 1.0]], " is [[2.0, 1.0]]"),
        (MOTOR, "accel", None, " is missing"),
        (MOTOR, "endstop_pin", "PA1", " is 'PA1', not ^"),
        (MOTOR, "dir_pin", "FILL_IN", " is 'FILL_IN'"),
        ("printer", "kinematics", "corexy", " is 'corexy', not none"),
        ("idle_timeout", "timeout", 600.0, "idle_timeout"),
    ],
)
def test_other_configuration(
    klipper_rig: Rig, refused: Told, section: str, option: str, value: object, says: str
) -> None:
    settings = klipper_rig.controller.settings
    settings[section] |= {option: value}
    if value is None:
        del settings[section][option]
    line = refused(klipper_rig.words())
    assert (says if section == "idle_timeout" else f"{option} of [{section}]{says}") in line
    assert "zero pin in first" in line
    del settings["output_pin led_4"]
    assert "[output_pin led_4] is missing" in refused(klipper_rig.words())


IDLE = {"timeout": 1e7, "gcode": "\nM84\n"}


@pytest.mark.parametrize(
    ("settings", "status", "seconds"),
    [
        ({}, {}, 600.0),
        ({"timeout": 300.0, "gcode": "\nm84\n"}, {}, 300.0),
        ({"timeout": 300.0, "gcode": "M117 idle"}, {}, None),
        (IDLE, {}, None),
        (IDLE, {"idle_timeout": 60.0}, 60.0),
    ],
)
def test_idle_printer(
    settings: dict[str, object], status: dict[str, object], seconds: float | None
) -> None:
    """What is set, and what SET_IDLE_TIMEOUT changed since."""
    assert klipper_base.idle_that_lets_go({"idle_timeout": settings}, status) == seconds


@pytest.mark.parametrize(
    ("wanted", "found", "same"),
    [
        ("13.50:1", [[13.5, 1.0]], True),
        ("80:16, 2:1", [[80.0, 16.0], [2.0, 1.0]], True),
        ("80:16, 2:1", [[80.0, 16.0]], False),
        ("false", False, True),
        ("no", True, False),
        ("\nM117\n  idle", "M117\nidle", True),
        ("0.8", "0.80000001", True),
        ("^FILL_IN", "^ PG6", True),
        ("^FILL_IN", "^", False),
        ("FILL_IN", "!^PG6", True),
    ],
)
def test_same_values(wanted: str, found: object, same: bool) -> None:
    assert list(klipper_base.differences({"a": {"b": wanted}}, {"a": {"b": found}})) == (
        [] if same else [f"b of [a] is {found!r}, not {wanted}"]
    )


def test_exports_that_are_not_for_klipper(
    klipper_export: Path,
    plain_export: Path,
    control_export: Path,
    tmp_path: Path,
    klipper_rig: Rig,
    refused: Told,
) -> None:
    for other, name in ((plain_export, "GRBL 1.1"), (control_export, "grblHAL")):
        klipper_rig.export = other
        line = refused(klipper_rig.words())
        assert f"but the build is for {name}: say the controller's serial port" in line
        assert "--set prototype.motion.controller=klipper" in line
    klipper_rig.export = Path(shutil.copytree(klipper_export, tmp_path / "copy"))
    program = klipper_rig.export / "rotation_plan_klipper.gcode"
    program.write_text(program.read_text().replace("STOP_ON_ENDSTOP=1", "STOP_ON_ENDSTOP=-1"))
    assert "does not home once" in refused(klipper_rig.words())
    program.write_text((klipper_export / program.name).read_text())
    (klipper_rig.export / "klipper.cfg").write_text("velocity: 3\n")
    assert "is no configuration" in refused(klipper_rig.words())
    (klipper_rig.export / "klipper.cfg").unlink()
    assert "klipper.cfg is not there: build again" in refused(klipper_rig.words())
    program.unlink()
    assert f"{program.name} is not there" in refused(klipper_rig.words())


def test_a_serial_port_is_not_klippers(klipper_rig: Rig, refused: Told) -> None:
    words = klipper_rig.words()
    words[words.index("--port") + 1] = "/dev/ttyUSB0"
    line = refused(words)
    assert "the build is for Klipper: say moonraker:http://HOST, or build again with" in line
