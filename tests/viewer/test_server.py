"""The server of views: it answers its own page, and refuses all else in plain words."""

import threading
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPResponse
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from tbcad.depth.view import depth_views
from tbcad.errors import InputError
from tbcad.simulate.views.refocus import ThinLens, refocus
from tbcad.viewer.query import Query
from tbcad.viewer.render import Renderer, Superseded
from tbcad.viewer.server import HOST, ViewServer

SMALL = "width=160&height=120"


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
    connection = HTTPConnection(HOST, server.server_port, timeout=60)
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


def test_a_view_is_that_of_the_library(server: ViewServer, renderer: Renderer) -> None:
    answer, body = get(server, f"/{server.token}/view?azimuth=40&elevation=20&still=1&{SMALL}")
    assert answer.status == 200
    assert answer.headers["Content-Type"] == "image/jpeg"
    query = Query(azimuth=40, elevation=20, width=160, height=120)
    view = query.camera(renderer.capture_mm)
    assert renderer.method == "depth"
    image = depth_views(renderer.tiles).of(view)[0].image
    shown = np.asarray(Image.open(BytesIO(body)))
    assert shown.shape == image.shape
    assert np.abs(shown.astype(float) - image).mean() < 3


@pytest.mark.parametrize("host", ["example.com", "example.com:{port}", "{ip}", "{ip}:1", ""])
def test_other_hosts_are_refused(server: ViewServer, host: str) -> None:
    """A name of somebody else may point to this computer."""
    named = host.format(port=server.server_port, ip=HOST)
    answer, body = get(server, f"/{server.token}/", host=named)
    assert answer.status == 403
    assert b"<" not in body


def test_this_computers_own_name_is_not_refused(server: ViewServer) -> None:
    assert get(server, f"/{server.token}/", f"localhost:{server.server_port}")[0].status == 200


@pytest.mark.parametrize(
    "path",
    ["/", "/view", "/wrong/", "/wrong/view", "/{token}", "/{token}/../etc/passwd",
     "/{token}/view/x", "/{token}//view", "/{token}é/"],
)  # fmt: skip
def test_other_paths_are_refused(server: ViewServer, path: str) -> None:
    named = path.format(token=server.token).encode().decode("latin-1")
    connection = HTTPConnection(HOST, server.server_port, timeout=60)
    connection._validate_path = lambda _: None  # type: ignore[attr-defined]
    connection._encode_request = lambda request: request.encode("latin-1")  # type: ignore[attr-defined]
    connection.request("GET", named)
    answer = connection.getresponse()
    assert answer.status == 404
    assert answer.read() == b"not here\n"
    connection.close()


@pytest.mark.parametrize("query", ["azimuth=x", "elevation=91", "distance=1", "still=2", "a=1",
                                   "width=99999", "aperture=-1", "focus=1e999"])  # fmt: skip
def test_bad_values_are_refused_in_one_line(
    server: ViewServer, query: str, capfd: pytest.CaptureFixture[str]
) -> None:
    answer, body = get(server, f"/{server.token}/view?{query}")
    assert answer.status == 400
    assert body.count(b"\n") == 1
    assert b"Traceback" not in body
    assert capfd.readouterr() == ("", "")


def test_other_methods_are_refused(server: ViewServer) -> None:
    assert get(server, f"/{server.token}/", method="POST")[0].status == 501


def test_only_this_computer_reaches_it(server: ViewServer) -> None:
    assert server.server_address[0] == "127.0.0.1"


def test_addresses_cannot_be_guessed(server: ViewServer, renderer: Renderer) -> None:
    with ViewServer(renderer, "knot", Query()) as other:
        assert other.token != server.token
        assert len(other.token) > 20


def test_a_port_that_is_taken_is_refused(server: ViewServer, renderer: Renderer) -> None:
    with pytest.raises(InputError, match=f"port {server.server_port} cannot be used"):
        ViewServer(renderer, "knot", Query(), server.server_port)


def test_a_lens_at_rest_is_that_of_refocus_and_moving_it_is_smaller(renderer: Renderer) -> None:
    query = Query(aperture=200, focus=10, width=160, height=120, still=1)
    lens, view = ThinLens(200, 10), query.camera(renderer.capture_mm)
    assert np.array_equal(renderer.picture(query), refocus(renderer.tiles, view, lens).image)
    moving = Query(aperture=200, focus=10, width=160, height=120)
    assert renderer.picture(moving).shape == (60, 80, 3)


def test_a_lens_gives_up_when_another_view_is_asked_for(renderer: Renderer) -> None:
    lens = Query(aperture=200, width=320, height=240, still=1)
    original = renderer.picture

    def picture(query: Query, proceed: object = None) -> object:
        renderer._latest += 1  # as another request does
        return original(query, proceed)  # type: ignore[arg-type]

    renderer.picture = picture  # type: ignore[method-assign, assignment]
    try:
        with pytest.raises(Superseded):
            renderer.jpeg(lens)
    finally:
        del renderer.picture  # type: ignore[method-assign]
