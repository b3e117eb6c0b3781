"""Requests to Moonraker, the HTTP server in front of Klipper.

Source: docs/external_api/ of Moonraker: introduction.md, authorization.md, printer.md.
"""

import json
import os
import re
import socket
import ssl
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPException, HTTPResponse, HTTPSConnection
from typing import Any
from urllib.parse import urlsplit

from tbcad.errors import InputError
from tbcad.rig.control.plan import MachineFault

PREFIX = "moonraker:"
KEY = "MOONRAKER_API_KEY"
ANSWER_S = 5.0  # that a request may take which does not wait for the machine
MOST_BYTES = 16_000_000  # of an answer; a large configuration has 200 kB
UNAUTHORIZED = 401
PORTS = {"http": 80, "https": 443}
_URL = re.compile(r"https?://[\w.:\[\]-]+(?:/[\w./~-]*)?", re.ASCII | re.IGNORECASE)
ELSEWHERE = "is this Moonraker? It listens at port 7125, as in moonraker:http://HOST:7125"
FORM = "allowed is moonraker:http://HOST or moonraker:http://HOST:7125, with https too"

AWAY = "is the printer's computer switched on and in this network?"
REASONS: tuple[tuple[type[Exception], str], ...] = (
    (socket.gaierror, "there is no such host: look at its name, or use its number"),
    (UnicodeError, "there is no such host: look at its name, or use its number"),
    (
        ssl.SSLCertVerificationError,
        "its certificate is not trusted: name that of its authority in SSL_CERT_FILE",
    ),
    (ssl.SSLError, "it does not speak https: say http://"),
    (ConnectionRefusedError, f"nothing listens there: {ELSEWHERE}"),
    (TimeoutError, f"no answer: {AWAY}"),
    (ConnectionResetError, f"the connection was cut: {AWAY}"),
    (HTTPException, f"the answer is not HTTP: {ELSEWHERE}, or at https://"),
)
"""Why there is no answer, and what to do; the first that fits."""


class Unreachable(MachineFault):
    """Moonraker gives no answer: it may have got the request."""


class Refused(MachineFault):
    """Moonraker answers with an error."""

    def __init__(self, text: str, code: int) -> None:
        """Keep the HTTP status beside the text."""
        super().__init__(text)
        self.code = code


@dataclass(frozen=True)
class Address:
    """Where Moonraker listens."""

    host: str
    port: int
    path: str  # before those of the API, without a slash at its end
    secure: bool  # whether by https


def read_address(text: str) -> Address:
    """Read the URL of a server."""
    if any(sign in text for sign in "@?#"):
        raise InputError(f"--port has more than a host: {FORM}; an API key goes into {KEY}")
    try:
        parts = urlsplit(text)
        port = parts.port or (PORTS[parts.scheme] if parts.port is None else 0)
    except (ValueError, KeyError):
        port = 0
    if not port or not parts.hostname or _URL.fullmatch(text) is None:
        raise InputError(f"--port names {text!r:.60}: {FORM}")
    return Address(parts.hostname, port, parts.path.rstrip("/"), parts.scheme == "https")


class Moonraker:
    """A server; each request has a connection of its own, from any thread."""

    def __init__(self, address: Address) -> None:
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
            raise Unreachable(f"Moonraker: {_reason(error)}") from None
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
        connection = (HTTPSConnection if to.secure else HTTPConnection)(
            to.host, to.port, timeout=ANSWER_S
        )
        try:
            connection.connect()
            connection.sock.settimeout(limit_s)
            connection.request(method, to.path + path, body, self._headers)
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


def _reason(error: Exception) -> str:
    for kind, text in REASONS:
        if isinstance(error, kind):
            return text
    return f"{error}: {AWAY}"
