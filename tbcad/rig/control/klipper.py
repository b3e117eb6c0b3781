"""Klipper behind Moonraker: its states, and G-code that is waited for.

Klipper has no feed hold: a motion that was queued comes to its end, and what ends it sooner, an
emergency stop, switches the motor off. It tells nothing of a manual stepper's angle either, so
that angle holds for as long as the motor was never let go; in a shutdown its report of that is
not true, and the state counts. All scripts of a run may be sent twice: places are absolute.
Source: docs/external_api/ of Moonraker: introduction.md, authorization.md, printer.md;
docs/Status_Reference.md, klippy/gcode.py, extras/stepper_enable.py and toolhead.py of Klipper;
tried with both.
"""

import json
import os
import re
import tomllib
from collections.abc import Callable
from concurrent.futures import Future, wait
from contextlib import suppress
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException, HTTPResponse, HTTPSConnection
from importlib.resources import files
from threading import Thread
from time import monotonic, sleep
from typing import Any
from urllib.parse import SplitResult, urlsplit

from tbcad.errors import InputError
from tbcad.rig.control.plan import ControllerReset, MachineFault
from tbcad.types import Progress

PREFIX = "moonraker:"
KEY = "MOONRAKER_API_KEY"
ANSWER_S = 5.0  # that a request may take which does not wait for the machine
MOST_BYTES = 16_000_000  # of an answer; a large configuration has 200 kB
UNAUTHORIZED = 401
_URL = re.compile(r"https?://[\w.:\[\]-]+(?:/[\w./~-]*)?", re.ASCII | re.IGNORECASE)
ELSEWHERE = "is this Moonraker? It listens at port 7125, as in moonraker:http://HOST:7125"
FORM = "allowed is moonraker:http://HOST or moonraker:http://HOST:7125, with https too"

AWAY = "is the printer's computer switched on and in this network?"
WORDS = tomllib.loads(files(__package__).joinpath("klipper_words.toml").read_text("utf-8"))


class Unreachable(MachineFault):
    """Moonraker gives no answer: it may have got the request."""


class Refused(MachineFault):
    """Moonraker answers with an error."""

    def __init__(self, text: str, code: int) -> None:
        """Keep the HTTP status beside the text."""
        super().__init__(text)
        self.code = code


def read_address(text: str) -> SplitResult:
    """Read the URL of a server."""
    if any(sign in text for sign in "@?#"):
        raise InputError(f"--port has more than a host: {FORM}; an API key goes into {KEY}")
    try:
        parts = urlsplit(text)
        valid = parts.hostname and parts.port != 0 and _URL.fullmatch(text)
    except ValueError:
        valid = None
    if not valid:
        raise InputError(f"--port names {text!r:.60}: {FORM}")
    return parts


class Moonraker:
    """A server; each request has a connection of its own, from any thread."""

    def __init__(self, address: SplitResult) -> None:
        """Ask a server, with the API key of the environment if there is one."""
        self._address = address
        key = os.environ.get(KEY, "").strip()
        if not (key.isascii() and key.isprintable()):
            raise InputError(f"{KEY} is no API key: copy it from Moonraker's settings")
        self._headers = {"Content-Type": "application/json"} | ({"X-Api-Key": key} if key else {})

    def get(self, path: str, limit_s: float = ANSWER_S) -> Any:
        """Result of a GET request; Unreachable: no answer, Refused: the answer is an error."""
        return self._result("GET", path, None, limit_s)

    def post(self, path: str, body: dict[str, Any], limit_s: float | None = ANSWER_S) -> Any:
        """Result of a POST request, waited for without end if there is no limit; else as `get`."""
        return self._result("POST", path, json.dumps(body), limit_s)

    def _result(self, method: str, path: str, body: str | None, limit_s: float | None) -> Any:
        try:
            response, data = self._answer(method, path, body, limit_s)
        except (OSError, HTTPException, ValueError) as error:
            kinds = (kind.__name__ for kind in type(error).__mro__)
            text = next(WORDS["no_answer"][kind] for kind in kinds if kind in WORDS["no_answer"])
            told = str(text).format(error=error, elsewhere=ELSEWHERE, away=AWAY)
            raise Unreachable(f"Moonraker: {told}") from None
        try:
            answer = json.loads(data)
        except (ValueError, RecursionError):
            answer = None
        if response.status == UNAUTHORIZED:
            raise Refused(
                f"Moonraker does not let this computer in: set {KEY} to its API key, or name the "
                "computer under trusted_clients in moonraker.conf",
                response.status,
            )
        if isinstance(answer, dict) and "result" in answer:
            return answer["result"]
        raise Refused(_error_text(response, answer), response.status)

    def _answer(
        self, method: str, path: str, body: str | None, limit_s: float | None
    ) -> tuple[HTTPResponse, bytes]:
        to = self._address
        kind = HTTPSConnection if to.scheme == "https" else HTTPConnection
        connection = kind(to.netloc, timeout=ANSWER_S)
        try:
            connection.connect()
            connection.sock.settimeout(limit_s)
            connection.request(method, to.path.rstrip("/") + path, body, self._headers)
            response = connection.getresponse()
            return response, response.read(MOST_BYTES)
        finally:
            connection.close()


def _error_text(response: HTTPResponse, answer: Any) -> str:
    error = answer.get("error") if isinstance(answer, dict) else None
    if isinstance(error, dict):
        return " ".join(str(error.get("message")).split())
    if (where := response.getheader("Location")) is not None:
        return f"the server sends us to {where}: name that address"
    return f"the server answers {response.status} {response.reason}: {ELSEWHERE}"


MOTOR = "manual_stepper base"
INFO, SCRIPT = "/printer/info", "/printer/gcode/script"
QUERY, ENDSTOPS = "/printer/objects/query", "/printer/query_endstops/status"
READY, STARTUP, DISCONNECTED = "ready", "startup", "disconnected"
NO_KLIPPER = (404, 503)  # before Klipper's first start, and after it ended
STARTING_S = {STARTUP: 30.0, DISCONNECTED: 5.0}  # that a restart needs
SWITCH_S = 60.0
BACK_S = 20.0  # that Moonraker may be away for
AGAIN_S = 0.5
LOOK_S = 0.2  # between looks at the state while a script runs
LATE_S = 5.0  # longer than expected: another program's G-code comes first
TRIES = 2
HOLD_FIRST = "hold the base by hand and put the zero pin in first"
LET_GO = "Klipper has let the motor go (M84, a restart, or idle_timeout): the angle is lost"


class Disconnected(MachineFault):
    """Moonraker has no Klipper."""


@dataclass(frozen=True)
class KlipperState:
    """State of Klipper: ready, startup, error, shutdown or disconnected; and its message."""

    name: str
    message: str

    @property
    def what(self) -> str:
        """Description of the event."""
        first = next((line for line in self.message.splitlines() if line.strip()), "")
        return f"Klipper is in state {self.name}" + (f": {first.strip()}" if first else "")

    @property
    def safe(self) -> str:
        """Safe next step."""
        words = WORDS["safe"]
        return str(words.get(self.name, words["other"])).format(hold=HOLD_FIRST)


class Klipper:
    """A Klipper host."""

    def __init__(self, server: Moonraker, note: Progress) -> None:
        """Speak to Klipper through Moonraker; notes are what the operator should know."""
        self._server, self._note = server, note

    def connect(self) -> None:
        """Wait until Klipper is ready; MachineFault: it is not, or the server is not Moonraker."""
        info = self._server.get("/server/info")
        if not isinstance(info, dict) or "klippy_state" not in info:
            raise MachineFault(f"the server is not Moonraker: {ELSEWHERE}")
        begun = monotonic()
        while monotonic() - begun < STARTING_S.get((state := self.state()).name, 0.0):
            sleep(AGAIN_S)
        if state.name != READY:
            raise MachineFault(f"{state.what}: {state.safe}")

    def state(self) -> KlipperState:
        """State of Klipper; Unreachable: Moonraker gives no answer."""
        try:
            info = self._server.get(INFO)
            return KlipperState(str(info["state"]), str(info["state_message"]))
        except Refused as fault:
            if fault.code in NO_KLIPPER:
                return KlipperState(DISCONNECTED, "")
            raise
        except (KeyError, TypeError):
            raise MachineFault(f"{INFO} tells no state: {ELSEWHERE}") from None

    def objects(self, *names: str) -> dict[str, Any]:
        """Status of objects by name; of those that Klipper has not, nothing."""
        answer = self._server.post(QUERY, {"objects": dict.fromkeys(names)})
        try:
            return {name: answer["status"].get(name) or {} for name in names}
        except (KeyError, TypeError, AttributeError):
            raise MachineFault(f"{QUERY} tells no status: {ELSEWHERE}") from None

    def switch_pressed(self) -> bool:
        """Whether the home switch is pressed, when other G-code is done."""
        return bool(self._server.get(ENDSTOPS, SWITCH_S).get(MOTOR) == "TRIGGERED")

    def check_ready(self) -> None:
        """Raise a MachineFault if Klipper is not ready."""
        if (state := self.state()).name != READY:
            raise (Disconnected if state.name == DISCONNECTED else MachineFault)(state.what)

    def check_held(self) -> None:
        """Raise a ControllerReset if the motor was let go."""
        self.check_ready()
        if self.objects("stepper_enable")["stepper_enable"].get("steppers", {}).get(MOTOR) is False:
            raise ControllerReset(LET_GO)

    def script(
        self,
        *lines: str,
        expected_s: float = 0.0,
        held: bool = True,
        limit_s: float = float("inf"),
    ) -> None:
        """Run lines of G-code and wait until Klipper has taken them; with M400, until it is done.

        While they run, the motor must stay on, if it is held, and Klipper ready. However long
        another program's G-code comes first, it is waited for up to the limit: lines that were sent
        cannot be taken back. MachineFault: Klipper refuses a line, is not ready any more, or gives
        no answer.
        """
        text = "\n".join(lines)
        for _ in range(TRIES):
            answer = _in_background(lambda: self._server.post(SCRIPT, {"script": text}, None))
            try:
                self._until_done(answer, expected_s, held, limit_s)
                self._refuse(lines[0], answer)
                return self.check_ready()
            except Unreachable as fault:
                self._note(f"{fault}; {lines[0]} once more")
                self._until_back(fault, held)
        raise MachineFault(f"{lines[0]!r}: the connection to Moonraker breaks again and again")

    def _until_done(
        self, answer: "Future[Any]", expected_s: float, held: bool, limit_s: float
    ) -> None:
        begun = monotonic()
        late = begun + expected_s + LATE_S
        self._look(answer, self.check_held if held else self.check_ready)
        while not wait([answer], LOOK_S).done:
            self._look(answer, self.check_ready)
            if (now := monotonic()) - begun > limit_s:
                raise MachineFault("Klipper is busy with another program's G-code")
            if now > late:
                late = float("inf")
                self._note("Klipper takes long: does another program give it G-code?")

    def _look(self, answer: "Future[Any]", check: Callable[[], None]) -> None:
        """Check the state; a Moonraker that begins anew also breaks the answer's connection.

        Until it has found Klipper it says that Klipper is disconnected, so the answer decides
        which of both has gone: of a Klipper that ended, Moonraker tells as an error.
        """
        try:
            check()
        except (Disconnected, Refused) as fault:
            if isinstance(fault, Refused) and fault.code not in NO_KLIPPER:
                raise
            wait([answer], BACK_S)
            if answer.done() and isinstance(lost := answer.exception(), Unreachable):
                raise lost from None
            raise

    def _refuse(self, line: str, answer: "Future[Any]") -> None:
        """Raise what ends a run; Moonraker calls the error of a Klipper that shut down unknown."""
        try:
            answer.result()
        except Refused as fault:
            self.check_ready()
            raise MachineFault(f"Klipper refuses {line!r}: {fault}") from None

    def _until_back(self, fault: Unreachable, held: bool) -> None:
        """Wait until Moonraker is there again, which finds Klipper some seconds later."""
        begun = monotonic()
        while monotonic() - begun < BACK_S:
            with suppress(Unreachable):
                if self.state().name not in STARTING_S:
                    return self.check_held() if held else self.check_ready()
            sleep(AGAIN_S)
        raise fault


def _in_background(action: Callable[[], Any]) -> "Future[Any]":
    """Do something in a thread that does not keep the program from ending."""
    future = Future[Any]()

    def run() -> None:
        try:
            future.set_result(action())
        except BaseException as error:
            future.set_exception(error)

    Thread(target=run, daemon=True).start()
    return future
