"""The command that shows an export or a light field in the browser."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.cli.app import app
from tbcad.cli.early_checks import DESIGN_FILE, LIGHT_FIELD_FILE
from tbcad.cli.options import (
    Azimuth,
    Distance,
    Elevation,
    ForceFile,
    Height,
    JsonResult,
    MethodOfView,
    Width,
)
from tbcad.cli.output_mode import print_json
from tbcad.errors import InputError
from tbcad.screen import stages

if TYPE_CHECKING:
    from tbcad.viewer.query import Query
    from tbcad.viewer.render import MethodAtRest
    from tbcad.viewer.server import ViewServer

REPORT_FILE = "report.html"
MAX_PORT = 65535


@app.command()
def show(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER", help="Folder written by tbcad build, or by tbcad capture or merge."
        ),
    ],
    azimuth: Azimuth = 0.0,
    elevation: Elevation = 30.0,
    distance: Distance = 640.0,
    width: Width = 640,
    height: Height = 480,
    turntable: Annotated[
        Path | None,
        typer.Option(
            help="Write a page that turns the object, to send to somebody, instead of showing the "
            "light field: an HTML file of at most 6 MB, which opens from disk.",
        ),
    ] = None,
    frames: Annotated[
        int, typer.Option(min=4, max=360, help="Views of the turntable once around.")
    ] = 60,
    rows: Annotated[
        int,
        typer.Option(
            min=1,
            max=13,
            help="Rows of the turntable, between 15 and 75 degrees of elevation; a single one is "
            "at --elevation.",
        ),
    ] = 3,
    method: MethodOfView = None,
    open_page: Annotated[
        bool,
        typer.Option("--open/--no-open", help="Open the browser, or only print the address."),
    ] = True,
    http_port: Annotated[
        int,
        typer.Option(
            "--http-port", min=0, max=MAX_PORT, help="Port of the address; 0: any that is free."
        ),
    ] = 0,
    force: ForceFile = False,
    json: JsonResult = False,
) -> int:
    """Show an export or a light field in the browser.

    Of an export, opens report.html. Of a light field, opens a page on which dragging moves the
    viewpoint and the wheel changes the distance; sliders set aperture and focus. tbcad makes the
    views and answers this computer alone; it goes on until Ctrl-C.
    """
    file = folder / LIGHT_FIELD_FILE if folder.is_dir() else folder
    if not file.is_file():
        if turntable is not None:
            raise InputError(f"{file}: no such file; --turntable is for a light field")
        return _show_report(folder, open_page, json)
    from tbcad.viewer.query import Query

    start = Query(azimuth, elevation, distance, width=width, height=height)
    if turntable is not None:
        return _write_turntable(file, turntable, start, (frames, rows), method, force, json)
    return _show_light_field(file, start, method, http_port, open_page, json)


def _show_report(folder: Path, open_page: bool, json: bool) -> int:
    page = folder / REPORT_FILE
    if not page.is_file() and (folder / DESIGN_FILE).is_file():
        raise InputError(f"{page}: no such file; write it with `tbcad report {folder}`")
    if not page.is_file():
        raise InputError(
            f"{folder} has neither {REPORT_FILE} nor {LIGHT_FIELD_FILE}: give a folder that "
            "`tbcad build`, `tbcad capture` or `tbcad merge` wrote"
        )
    from tbcad.output.manifest import is_report

    if not is_report(page):
        raise InputError(
            f"{page} is not by tbcad: move it, and write the report with `tbcad report {folder}`"
        )
    if json:
        print_json({"report": str(page.resolve())})
    else:
        typer.echo(str(page.resolve()))
    if open_page:
        _open(page.resolve().as_uri())
    return 0


def _show_light_field(
    file: Path,
    start: "Query",
    method: "MethodAtRest | None",
    port: int,
    open_page: bool,
    json: bool,
) -> int:
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.viewer.render import Renderer
    from tbcad.viewer.server import ViewServer

    with LightField.open(file) as source:
        start.check(source.capture_mm)
        with stages(1) as screen:
            screen.stage("pictures of the virtual cameras")
            renderer = Renderer(source, method or "depth", screen.detail)
        with ViewServer(renderer, _title(file), start, port) as server:
            if json:
                print_json({"address": server.address})
            else:
                typer.echo(f"{server.address} shows {file}; Ctrl-C ends it")
            if open_page:
                _open(server.address)
            return _serve(server)


def _serve(server: "ViewServer") -> int:
    """Answer until Ctrl-C."""
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        typer.echo("ended", err=True)
    return 0


def _write_turntable(
    file: Path,
    out: Path,
    start: "Query",
    views: tuple[int, int],
    method: "MethodAtRest | None",
    force: bool,
    json: bool,
) -> int:
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.viewer.turntable import (
        Turntable,
        check_turntable_path,
        even_elevations,
        write_turntable,
    )

    check_turntable_path(out, force)
    with stages(1) as screen, LightField.open(file) as source:
        start.check(source.capture_mm)
        tiles = MirrorTiles(source)
        columns, rows = views
        table = Turntable(
            columns,
            even_elevations(rows, start.elevation),
            start.distance,
            (start.width, start.height),
            method or "depth",
        )
        screen.stage("turntable")
        size = write_turntable(out, tiles, table, _title(file), screen.detail)
    if json:
        print_json({"turntable": str(out), "bytes": size, "views": columns * rows})
    else:
        typer.echo(f"{out}: {columns * rows} views, {size / 1e6:.1f} MB")
    return 0


def _open(address: str) -> None:
    import webbrowser

    if not webbrowser.open(address):
        typer.echo("no browser was found: open this address in one", err=True)


def _title(file: Path) -> str:
    """The name of the capture's folder, or of a light field that lies alone."""
    file = file.resolve()
    return file.parent.name if file.name == LIGHT_FIELD_FILE else file.stem
