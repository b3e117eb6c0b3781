"""Moonraker and Klipper as an HTTP server on loopback, with a base and lights.

It knows Klipper's states, MANUAL_STEPPER with and without STOP_ON_ENDSTOP, SET_PIN, G4, M400 and
M84, and the answers of Moonraker. G-code is taken when it is queued, 0.25 s ahead of the machine
and 1 s at most, and M400 waits for the machine; an unknown command is no error. A shutdown stops a
motion and switches motor and lights off. Its time runs faster than the clock.
Sources: docs/external_api/ of Moonraker; klippy/gcode.py, toolhead.py, webhooks.py,
extras/manual_stepper.py and stepper_enable.py of Klipper; compared with both, run with the micro-
controller that Klipper has for Linux: a Klipper in shutdown says that the motor is on, refuses
G-code by the message "Unknown", and without Klipper a request ends in 503, or 404 before its first
start.
"""

import json
import math
import re
from collections.abc import Callable
from configparser import RawConfigParser
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock, RLock, Thread
from time import sleep
from typing import Any

from tests.rig.control.grbl_double import Double, Motion

AHEAD_S, QUEUE_S, TICK_S = 0.25, 1.0, 0.0005
MOTOR = "manual_stepper base"
OUTPUTS = {"lamp": 0} | {f"led_{k}": k for k in range(1, 8)}
ESTOP = "Shutdown due to webhooks request\nOnce the underlying issue is corrected ...\n"


class CommandError(Exception):
    """What Klipper refuses."""


class Shutdown(Exception):
    """Klipper shut down while it did something."""


class KlipperDouble(Double):
    """A printer; `port` is what tbcad is given."""

    lines_before = 34  # from the connection to the first photograph

    def __init__(self, settings: dict[str, dict[str, Any]], switch_deg: float) -> None:
        """Control a machine by settings, by section."""
        super().__init__(switch_deg)
        self.settings = settings
        self.unknown: list[str] = []
        self.state, self.message = "ready", "Printer is ready"
        self.started, self.key, self.emergency_stops = True, "", 0
        self.stuck_switch = False
        self.away = False  # gives no answers
        self.asked = 0  # for the state
        self.searching = 0  # answers until Moonraker has found Klipper
        self.print_state = ""
        self._gcode, self._lock = Lock(), RLock()
        self._forget()
        double = self

        class Handler(_Handler):
            printer = double

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.port = f"moonraker:http://127.0.0.1:{self._server.server_port}"

    def start(self) -> None:
        Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()

    @property
    def moving(self) -> bool:
        return 0 < self.now - self._motion.start_s < self._motion.seconds

    def run_at(self, speed: float) -> None:
        """Let its time run at another speed from now on."""
        with self._lock:
            super().run_at(speed)

    def _forget(self) -> None:
        self.motor_on = False
        self._position, self._end = 0.0, 0.0
        self._zero = self.machine.angle
        self._motion = Motion(0.0, 0.0, 0.0, 0.0)
        self._later: list[tuple[float, Callable[[], None]]] = []

    def restart(self) -> None:
        """RESTART by somebody: the motor is let go, the place forgotten."""
        with self._lock:
            self.stop_at_once()
            self._forget()
            self.state, self.message, self.started = "ready", "Printer is ready", True

    def stop_at_once(self, state: str = "shutdown", message: str = ESTOP) -> None:
        """Shut down, with motor and lights off."""
        with self._lock:
            self.advance()
            self._later.clear()
            self._end = self.now
            self._position = self.machine.angle - self._zero
            self._motion = Motion(self._position, self._position, self.now, 0.0)
            self.machine.lights.clear()
            self.machine.relay = False
            self.state, self.message = state, message

    def advance(self) -> None:
        """What has happened until now."""
        with self._lock:
            self.machine.angle = self._motion.at(self.now) + self._zero
            while self._later and self._later[0][0] <= self.now:
                self._later.pop(0)[1]()

    def script(self, text: str) -> None:
        """Run G-code, one script at a time."""
        with self._gcode:
            for line in text.splitlines():
                self.lines.append(line)
                self.on_line(len(self.lines))
                if self.state != "ready":
                    raise Shutdown
                self._inject(self.fault(len(self.lines), line))
                if self.state != "ready" and line != "M400":
                    raise Shutdown
                self._line(line)

    def _inject(self, fault: str | None) -> None:
        if fault == "error":
            raise CommandError("Timer too close")
        if fault == "drop":
            raise ConnectionAbortedError
        if fault is not None:
            self.stop_at_once(fault, ESTOP if fault == "shutdown" else "")

    def _line(self, line: str) -> None:
        command, _, rest = line.partition(" ")
        words = dict(re.findall(r"([A-Z_]+)=(\S+)", rest))
        match command:
            case "MANUAL_STEPPER":
                if words.get("STEPPER") != "base":
                    raise CommandError(f"The value '{words.get('STEPPER')}' is not valid")
                self._stepper(words)
            case "SET_PIN":
                self._pin(words["PIN"], on=words["VALUE"] == "1")
            case "G4":
                self._end = self._begin() + float(rest.removeprefix("P")) / 1000
                self._until(self._end - QUEUE_S)
            case "M400":  # ends without an error in a shutdown
                with suppress(Shutdown):
                    self._until(self._end)
                self.see(self.machine)
            case "M84":
                self.let_go()
            case _:
                self.unknown.append(line)

    def let_go(self) -> None:
        self.motor_on = False

    def go_away(self) -> None:
        self.away = True

    def _begin(self) -> float:
        return max(self.now + AHEAD_S, self._end)

    def _until(self, time: float) -> None:
        while self.now < time:
            if self.state != "ready":
                raise Shutdown
            sleep(TICK_S)
        self.advance()

    def _stepper(self, words: dict[str, str]) -> None:
        if words.get("ENABLE") == "1":
            self.motor_on = True
        if "SET_POSITION" in words:
            self._until(self._end)
            with self._lock:
                self._zero += self._position - float(words["SET_POSITION"])
                self._position = float(words["SET_POSITION"])
                self._motion = Motion(self._position, self._position, 0.0, 0.0)
        if "MOVE" in words:
            self._move(float(words["MOVE"]), float(words["SPEED"]), words.get("STOP_ON_ENDSTOP"))

    def _move(self, to: float, speed: float, stop: str | None) -> None:
        self.motor_on = True
        hit = False
        if stop is not None and to + self._zero <= self.switch_deg:
            to, hit = min(self.switch_deg - self._zero, self._position), True
        hit = hit or self.stuck_switch
        if stop is not None and self.stuck_switch:
            to = self._position
        accel = self.settings[MOTOR]["accel"]
        with self._lock:
            begin = self._begin()
            seconds = abs(to - self._position) / speed + speed / accel
            self._motion = Motion(
                self._position, to, begin, seconds if to != self._position else 0.0
            )
            self._end = begin + self._motion.seconds
            self._position = to
        if stop is None:
            self._until(self._end - QUEUE_S)
            return
        self._until(self._end)
        if stop in ("1", "home") and not hit:
            raise CommandError("No trigger on manual_stepper base after full movement")

    def _pin(self, name: str, *, on: bool) -> None:
        if f"output_pin {name}" not in self.settings:
            raise CommandError(f"The value '{name}' is not valid for PIN")

        def switch() -> None:
            if name == "release":
                self.switch_relay(on=on)
            else:
                self.switch_light(OUTPUTS[name], on=on)

        with self._lock:
            self._end = self._begin()
            self._later.append((self._end, switch))

    @property
    def switch_pressed(self) -> bool:
        self.advance()
        return self.stuck_switch or self.machine.angle <= self.switch_deg + 1e-9

    def objects(self) -> dict[str, Any]:
        idle = self.settings.get("idle_timeout", {}).get("timeout", 600.0)
        return {
            "webhooks": {"state": self.state, "state_message": self.message},
            "configfile": {"settings": self.settings},
            "idle_timeout": {"state": "Ready", "idle_timeout": idle},
            "stepper_enable": {"steppers": {MOTOR: self.motor_on}},
            "print_stats": {"state": self.print_state} if self.print_state else {},
        }


class _Handler(BaseHTTPRequestHandler):
    printer: KlipperDouble
    protocol_version = "HTTP/1.1"

    def log_message(self, format: str, *args: object) -> None:
        pass

    def do_GET(self) -> None:
        self._request({})

    def do_POST(self) -> None:
        self._request(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))

    def _request(self, body: dict[str, Any]) -> None:
        printer = self.printer
        if printer.away:
            self.close_connection = True
            return None
        if printer.key and self.headers["X-Api-Key"] != printer.key:
            return self._error(401, "Unauthorized")
        gone = printer.state == "disconnected"
        if self.path == "/server/info":
            return self._say({"klippy_connected": not gone, "klippy_state": printer.state})
        if gone:
            if self.path == "/printer/info" and not printer.started:
                return self._error(404, "Not Found")
            return self._error(503, "Klippy Host not connected")
        if printer.searching:
            printer.searching -= 1
            return self._error(404, "Not Found")
        match self.path:
            case "/printer/info":
                printer.asked += 1
                self._say({"state": printer.state, "state_message": printer.message})
            case "/printer/objects/query":
                known = printer.objects()
                found = {name: known.get(name, {}) for name in body["objects"]}
                self._say({"eventtime": printer.now, "status": found})
            case "/printer/query_endstops/status":
                self._say({MOTOR: "TRIGGERED" if printer.switch_pressed else "open"})
            case "/printer/emergency_stop":
                printer.emergency_stops += 1
                printer.stop_at_once()
                self._say("ok")
            case "/printer/gcode/script":
                self._script(body["script"])
            case _:
                self._error(404, "Not Found")

    def _script(self, text: str) -> None:
        try:
            self.printer.script(text)
        except CommandError as error:
            self._error(400, str(error))
        except Shutdown:
            gone = self.printer.state == "disconnected"
            self._error(*((503, "Klippy Disconnected") if gone else (400, "Unknown")))
        except ConnectionAbortedError:
            self.close_connection = True
        else:
            self._say("ok")

    def _say(self, result: Any) -> None:
        self._answer(200, {"result": result})

    def _error(self, code: int, message: str) -> None:
        self._answer(code, {"error": {"code": code, "message": message, "traceback": "..."}})

    def _answer(self, code: int, value: dict[str, Any]) -> None:
        data = json.dumps(value).encode()
        try:
            self.send_response(code)
            self.send_header("Content-Type", "application/json; charset=UTF-8")
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)
        except OSError:
            pass  # a killed program does not listen


def printer_settings(config: Path) -> dict[str, dict[str, Any]]:
    """Settings as Klipper tells them of a configuration whose pins were filled in."""
    parser = RawConfigParser(strict=False, inline_comment_prefixes=(";", "#"))
    parser.read_string(config.read_text(encoding="ascii").replace("FILL_IN", "PA1"))
    found = {name: {k: _parsed(v) for k, v in parser.items(name)} for name in parser.sections()}
    found.setdefault("idle_timeout", {"timeout": 1e7, "gcode": "\nM84\n"})
    return found


def _parsed(text: str) -> Any:
    if re.fullmatch(r"[\d.]+:[\d.]+", text):
        return [[float(part) for part in text.split(":")]]
    try:
        value = float(text)
    except ValueError:
        return text
    return value if math.isfinite(value) else text
