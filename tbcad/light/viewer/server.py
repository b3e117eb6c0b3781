"""A server for one page on this computer: it makes the views of a light field or a field.

Only programs of this computer reach it, at an address with a random word in it. A page of another
site that guesses the port, or has its own name point to this computer, is refused: the word is
missing, or the host is not ours.
"""

import secrets
import sys
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from tbcad.errors import InputError
from tbcad.light.viewer.page import Query, parse_query, viewer_page
from tbcad.light.viewer.render import Renderer, Superseded

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")
TOKEN_BYTES = 16
# A connection is closed when nothing of its next request comes, or of an answer is taken, for so
# many seconds.
TIMEOUT_S = 60.0
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; img-src 'self' blob: data:; connect-src 'self'"
    "; style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
    "; frame-ancestors 'none'",
}
TEXT, HTML, JPEG = "text/plain; charset=utf-8", "text/html; charset=utf-8", "image/jpeg"


class ViewServer(ThreadingHTTPServer):
    """Serves one light field or field until it is shut down; `token` is a word of its address."""

    daemon_threads = True
    allow_reuse_address = False

    def __init__(self, renderer: Renderer, title: str, start: Query, port: int = 0) -> None:
        """Listen on this computer alone, at a port, 0 for any; InputError if it is taken."""
        self.renderer = renderer
        page = viewer_page(
            title, start, renderer.capture_mm, renderer.method, lens=renderer.lens is not None
        )
        self.page = page.encode("utf-8")
        self.token = secrets.token_urlsafe(TOKEN_BYTES)
        try:
            super().__init__((HOST, port), _Handler)
        except OSError as error:
            raise InputError(f"port {port} cannot be used: {error.strerror}") from None

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{HOST}:{self.server_port}/{self.token}/"

    @property
    def hosts(self) -> tuple[str, ...]:
        """Names by which a browser with the address calls this server."""
        return tuple(f"{name}:{self.server_port}" for name in NAMES)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a connection that its client breaks off: only faults of ours are shown."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server: ViewServer
    protocol_version = "HTTP/1.1"  # one connection for all views
    disable_nagle_algorithm = True
    timeout = TIMEOUT_S

    def do_GET(self) -> None:
        """Answer with the page or a view."""
        if "Content-Length" in self.headers or "Transfer-Encoding" in self.headers:
            self.close_connection = True  # what follows is no request
        if self.headers.get("Host") not in self.server.hosts:
            return self._answer(403, TEXT, b"this server answers to its own address alone\n")
        path, _, query = self.path.partition("?")
        begin = f"/{self.server.token}/"
        if not secrets.compare_digest(path[: len(begin)].encode(), begin.encode()):
            return self._answer(404, TEXT, b"not here\n")
        match path[len(begin) :]:
            case "":
                return self._answer(200, HTML, self.server.page)
            case "view":
                return self._view(query)
        return self._answer(404, TEXT, b"not here\n")

    def _view(self, text: str) -> None:
        renderer = self.server.renderer
        try:
            picture = renderer.jpeg(parse_query(text, renderer.capture_mm))
        except InputError as error:
            return self._answer(400, TEXT, f"{error}\n".encode())
        except Superseded:
            return self._answer(204, TEXT, b"")
        return self._answer(200, JPEG, picture)

    def _answer(self, status: int, kind: str, body: bytes) -> None:
        try:
            self.send_response(status)
            for name, value in {**HEADERS, "Content-Type": kind}.items():
                self.send_header(name, value)
            if status != 204:
                self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)
        except OSError:  # the page was closed, or takes no answer
            self.close_connection = True

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""
