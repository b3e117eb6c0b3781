"""Views a second: python benchmarks/showing.py captures/knot."""

from __future__ import annotations

import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from http.client import HTTPConnection
from pathlib import Path
from typing import Literal

from circumstances import asked, show_and_write
from timing import Figure, Row, at_least, measured

from tbcad import Views
from tbcad.light.reconstruction.field import NAME, read_field
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.viewer.page import Query
from tbcad.light.viewer.render import Renderer, field_renderer, light_field_renderer
from tbcad.light.viewer.server import HOST, ViewServer

Method = Literal["nearest", "depth"]
VIEWS = 90  # once around, in steps of 4 degrees
IN_FLIGHT = 2  # as the page
BROWSER_S = 5.0
FIELD_AT_REST, FIELD_MOVING = 5, 15  # views a second
MS = 1000  # of a second


def synthesised(capture: Path, rounds: int) -> list[Row]:
    """Views by rays, one after the other, in turns so that all meet the same load."""
    with LightField.open(capture) as source:
        views, fine = Views(source, quick=True), Views(source)
        works: dict[str, tuple[Views, Method, float | None]] = {
            "nearest rays": (views, "nearest", 30),
            "blend at the depth found, quick": (views, "depth", 10),
            "blend at the depth found": (fine, "depth", None),
        }
        found: dict[str, list[tuple[float, float]]] = {name: [] for name in works}
        for turn in range(rounds + 1):
            for name, (of, method, _) in works.items():
                one = rates(partial(few, of, method))
                if turn > 0:  # the first compiles and reads
                    found[name].append(one)
    rows = []
    for name, (_, _, limit) in works.items():
        rows += _by_cpu(f"views a second, 640 x 480, {name}", found[name], limit)
    return rows


def _by_cpu(what: str, rates: list[tuple[float, float]], limit: float | None) -> list[Row]:
    """Rows whose limit, views a second, is that of two cores' time, which no load lengthens."""
    views_a_second, cpu = _rows(what, rates)
    return [views_a_second, cpu if limit is None else replace(cpu, limit=round(2 * MS / limit, 1))]


def few(views: Views, method: Method) -> int:
    """A quarter of the views of a turn, spread evenly; their number."""
    for k in range(0, VIEWS, 4):
        _ = views.view(360 * k / VIEWS, method=method).image
    return len(range(0, VIEWS, 4))


def showing(capture: Path, rounds: int) -> list[Row]:
    """Views while the viewpoint moves: made alone, over HTTP, and on a page in Chromium."""
    with LightField.open(capture) as source:
        renderer = light_field_renderer(MirrorTiles(source))
        around(renderer.picture)  # compiles
        alone = [rates(lambda: around(renderer.picture)) for _ in range(rounds)]
        packed = [rates(lambda: around(renderer.jpeg)) for _ in range(rounds)]
        with running(renderer) as server:
            sent = [rates(lambda: fetched(server)) for _ in range(rounds)]
            drawn = in_chromium(server, rounds)
    return [
        *_rows("views a second, 640 x 480, while the viewpoint moves", alone),
        *_rows("- as JPEG", packed),
        *_rows(f"- as JPEG over HTTP, {IN_FLIGHT} requests at a time", sent),
        *(_rows("- drawn by the page in headless Chromium, on the same cores", drawn, 30)),
    ]


def field_shown(field: Path, rounds: int) -> list[Row]:
    """Views by a field: at rest, and while the viewpoint moves, also half as large."""
    renderer = field_renderer(read_field(field))
    around(renderer.picture)  # compiles
    still = [rates(lambda: around(renderer.picture, still=True)) for _ in range(rounds)]
    moving = [rates(lambda: around(renderer.picture)) for _ in range(rounds)]
    half = [rates(lambda: around(renderer.picture, width=320, height=240)) for _ in range(rounds)]
    with running(renderer) as server:
        drawn = in_chromium(server, rounds, smaller=True)
    return [
        *_by_cpu("views a second by a field, 640 x 480", still, FIELD_AT_REST),
        *_by_cpu("- while the viewpoint moves", moving, None),
        *_by_cpu("- while the viewpoint moves, 320 x 240", half, FIELD_MOVING),
        *_rows("- drawn by the page in headless Chromium, 320 x 240", drawn, FIELD_MOVING),
    ]


def _rows(what: str, rates: list[tuple[float, float]], limit: float | None = None) -> list[Row]:
    if not rates:
        return [Row(what, (), note="chromium is not installed")]
    views, cpu = (Figure(values) for values in zip(*rates, strict=True))
    first = measured(what, views, "/s") if limit is None else at_least(what, views, limit, "/s")
    return [first, measured("- - processor time of tbcad for each, all cores", cpu, "ms")]


def around(show: Callable[[Query], object], **query: int) -> int:
    """All views of a turn, one after the other; their number."""
    for k in range(VIEWS):
        show(replace(Query(azimuth=360 * k / VIEWS), **query))
    return VIEWS


def rates(work: Callable[[], int]) -> tuple[float, float]:
    """Views a second, and processor milliseconds of this process for each."""
    start, used = time.perf_counter(), time.process_time()
    count = work()
    taken, cpu = time.perf_counter() - start, time.process_time() - used
    return count / taken, MS * cpu / count


@contextmanager
def running(renderer: Renderer) -> Iterator[ViewServer]:
    with ViewServer(renderer, "knot", Query()) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def fetched(server: ViewServer) -> int:
    """Views of a turn as a page asks for them."""

    def every(first: int) -> None:
        connection = HTTPConnection(HOST, server.server_port)
        for k in range(first, VIEWS, IN_FLIGHT):
            connection.request("GET", f"/{server.token}/view?azimuth={360 * k / VIEWS}")
            answer = connection.getresponse()
            assert answer.status == 200, answer.read()
            answer.read()
        connection.close()

    with ThreadPoolExecutor(IN_FLIGHT) as pool:
        list(pool.map(every, range(IN_FLIGHT)))
    return VIEWS


def in_chromium(
    server: ViewServer, rounds: int, smaller: bool = False
) -> list[tuple[float, float]]:
    """As `rates`, of pictures that the turning page has drawn, at full or half size."""
    program = shutil.which("chromium")
    if program is None:
        return []
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tests.clients.browser import chromium

    with tempfile.TemporaryDirectory() as profile, chromium(program, Path(profile)) as browser:
        browser.open(server.address)
        browser.value(
            f"viewer.smaller = {str(smaller).lower()}; window.drawn = 0; const plain = draw;"
            "draw = (...given) => { window.drawn++; plain(...given); }; turn(true)"
        )
        time.sleep(1)

        def turned() -> int:
            before = int(browser.value("window.drawn"))
            time.sleep(BROWSER_S)
            return int(browser.value("window.drawn")) - before

        return [rates(turned) for _ in range(rounds)]


if __name__ == "__main__":
    given = asked(
        __doc__ or "",
        "showing",
        ("capture", {"type": Path, "help": "folder written by tbcad capture, n = 18"}),
        ("--alone", {"action": "store_true", "help": "leave out `tbcad show`"}),
        rounds=3,
    )
    found = synthesised(given.capture, given.rounds)
    if not given.alone:
        found += showing(given.capture, given.rounds)
        if (field := given.capture / NAME).is_file():
            found += field_shown(field, given.rounds)
    show_and_write(given.out, given.about, found)
