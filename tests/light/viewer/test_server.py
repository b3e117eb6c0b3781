"""The server of views and its queries: its own page is answered, all else refused."""

import socket
import struct
import threading
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPResponse
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from tbcad.errors import InputError
from tbcad.light.depth.depth_map import depth_views
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import ThinLens, refocus
from tbcad.light.viewer.page import Query, limits, parse_query
from tbcad.light.viewer.render import Renderer
from tbcad.light.viewer.server import HOST, ViewServer

CAPTURE_MM = 60.0
SMALL = "width=160&height=120"


def test_what_is_left_out_has_its_default() -> None:
    assert parse_query("", CAPTURE_MM) == Query()
    assert parse_query("azimuth=12.5&still=1", CAPTURE_MM) == Query(azimuth=12.5, still=1)


@pytest.mark.parametrize("name", limits(CAPTURE_MM))
def test_limits_are_allowed_and_what_is_beyond_is_not(name: str) -> None:
    kind = type(getattr(Query(), name))
    for value, beyond in zip(limits(CAPTURE_MM)[name], (-1, 1), strict=True):
        query = parse_query(f"{name}={kind(value)}", CAPTURE_MM)
        assert getattr(query, name) == value
        assert query.camera(CAPTURE_MM).width_px == query.width
        with pytest.raises(InputError, match=f"{name} .* is not allowed"):
            parse_query(f"{name}={kind(value) + beyond}", CAPTURE_MM)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("azimuth=north", "azimuth 'north' is no number"),
        ("distance=inf", "distance 'inf' is no number"),
        ("width=64.5", "width '64.5' is no number"),
        ("zoom=2", "'zoom' is unknown or given twice"),
        ("azimuth=1&azimuth=2", "'azimuth' is unknown or given twice"),
        ("&".join(f"azimuth={k}" for k in range(99)), "too many parts"),
    ],
)
def test_refused(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_query(text, CAPTURE_MM)


@pytest.fixture(scope="module")
def server(renderer: Renderer) -> Iterator[ViewServer]:
    with ViewServer(renderer, "a <knot>", Query(width=160, height=120)) as running:
        thread = threading.Thread(target=running.serve_forever)
        thread.start()
        yield running
        running.shutdown()
        thread.join()


def get(
    server: ViewServer, path: str, host: str | None = None, method: str = "GET"
) -> tuple[HTTPResponse, bytes]:
    connection = HTTPConnection(HOST, server.server_port, timeout=600)
    connection.putrequest(method, path, skip_host=True)
    if host != "":
        connection.putheader("Host", host or f"{HOST}:{server.server_port}")
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer, body


def test_the_page_asks_nobody_else(server: ViewServer) -> None:
    answer, body = get(server, f"/{server.token}/")
    text = body.decode()
    assert answer.status == 200
    assert "<title>a &lt;knot&gt;: light field</title>" in text
    assert "http" not in text.replace('http-equiv="Content-Security-Policy"', "")
    assert "{{" not in text
    assert "default-src 'none'" in str(answer.headers["Content-Security-Policy"])


def test_a_view_is_that_of_the_library(
    server: ViewServer, renderer: Renderer, tiles: MirrorTiles
) -> None:
    answer, body = get(server, f"/{server.token}/view?azimuth=40&elevation=20&still=1&{SMALL}")
    assert answer.status == 200
    assert answer.headers["Content-Type"] == "image/jpeg"
    query = Query(azimuth=40, elevation=20, width=160, height=120)
    view = query.camera(renderer.capture_mm)
    assert renderer.method == "depth"
    image = depth_views(tiles).of(view)[0].image
    shown = np.asarray(Image.open(BytesIO(body)))
    assert shown.shape == image.shape
    assert np.abs(shown.astype(float) - image).mean() < 3


@pytest.mark.parametrize("host", ["example.com:{port}", "{ip}", "{ip}:1", ""])
def test_other_hosts_are_refused(server: ViewServer, host: str) -> None:
    """A name of somebody else may point to this computer."""
    named = host.format(port=server.server_port, ip=HOST)
    answer, body = get(server, f"/{server.token}/", host=named)
    assert answer.status == 403
    assert b"<" not in body
    assert get(server, f"/{server.token}/", f"localhost:{server.server_port}")[0].status == 200


@pytest.mark.parametrize(
    "path",
    ["/", "/view", "/wrong/", "/wrong/view", "/{token}", "/{token}/../etc/passwd",
     "/{token}/view/x", "/{token}//view", "/{token}é/"],
)  # fmt: skip
def test_other_paths_are_refused(server: ViewServer, path: str) -> None:
    named = path.format(token=server.token).encode().decode("latin-1")
    connection = HTTPConnection(HOST, server.server_port, timeout=600)
    connection._validate_path = lambda _: None  # type: ignore[attr-defined]
    connection._encode_request = lambda request: request.encode("latin-1")  # type: ignore[attr-defined]
    connection.request("GET", named)
    answer = connection.getresponse()
    assert answer.status == 404
    assert answer.read() == b"not here\n"
    connection.close()


def test_bad_values_are_refused_in_one_line(
    server: ViewServer, capfd: pytest.CaptureFixture[str]
) -> None:
    answer, body = get(server, f"/{server.token}/view?elevation=91")
    assert answer.status == 400
    assert body.count(b"\n") == 1
    assert b"Traceback" not in body
    assert capfd.readouterr() == ("", "")


def test_other_methods_are_refused(server: ViewServer) -> None:
    assert get(server, f"/{server.token}/", method="POST")[0].status == 501


def test_addresses_and_ports_are_a_servers_own(server: ViewServer, renderer: Renderer) -> None:
    with ViewServer(renderer, "knot", Query()) as other:
        assert other.token != server.token
        assert len(other.token) > 20
    with pytest.raises(InputError, match=f"port {server.server_port} cannot be used"):
        ViewServer(renderer, "knot", Query(), server.server_port)


def test_a_lens_at_rest_is_that_of_refocus_and_moving_it_is_smaller(
    renderer: Renderer, tiles: MirrorTiles
) -> None:
    query = Query(aperture=200, focus=10, width=160, height=120, still=1)
    lens, view = ThinLens(200, 10), query.camera(renderer.capture_mm)
    assert np.array_equal(renderer.picture(query), refocus(tiles, view, lens).image)
    moving = Query(aperture=200, focus=10, width=160, height=120)
    assert renderer.picture(moving).shape == (60, 80, 3)


def raw(server: ViewServer, sent: bytes) -> socket.socket:
    connection = socket.create_connection((HOST, server.server_port), timeout=600)
    connection.sendall(sent)
    return connection


def head(server: ViewServer, path: str, *more: str) -> bytes:
    host = f"Host: {HOST}:{server.server_port}"
    return "\r\n".join([f"GET {path} HTTP/1.1", host, *more, "", ""]).encode()


def reset(connection: socket.socket) -> None:
    """Close a connection as a client does that crashes."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    connection.close()


def everything(connection: socket.socket) -> bytes:
    with connection, connection.makefile("rb") as file:
        return file.read()


@pytest.mark.parametrize(
    "sent",
    [b"", b"GE", b"GET / HTTP/1.1\r\nHost: x\r\n", "page", "view", b"\0\xff\xfe" * 9 + b"\r\n\r\n"],
)
def test_a_client_that_resets_is_no_error(
    server: ViewServer, sent: bytes | str, capfd: pytest.CaptureFixture[str]
) -> None:
    if isinstance(sent, str):
        path = f"/{server.token}/" + (f"view?{SMALL}" if sent == "view" else "")
        sent = head(server, path)
    reset(raw(server, sent))
    assert get(server, f"/{server.token}/")[0].status == 200
    assert capfd.readouterr() == ("", "")


def test_a_client_that_sends_nothing_is_let_go(
    server: ViewServer, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("tbcad.light.viewer.server._Handler.timeout", 0.2)
    assert everything(raw(server, b"GET")) == b""
    assert capfd.readouterr() == ("", "")


def test_what_follows_a_request_with_a_body_is_no_request(server: ViewServer) -> None:
    body = head(server, f"/{server.token}/")
    connection = raw(server, head(server, "/", f"Content-Length: {len(body)}") + body)
    assert everything(connection).count(b"HTTP/1.1") == 1
