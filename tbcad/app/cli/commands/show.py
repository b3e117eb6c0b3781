"""The command that shows a build or a light field in the browser."""

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tbcad.app.cli.app import app, print_result
from tbcad.common.screen import stages
from tbcad.errors import InputError
from tbcad.options.call import tell_options
from tbcad.options.checks import DESIGN_FILE, FIELD_FILE, LIGHT_FIELD_FILE
from tbcad.options.shared import (
    Azimuth,
    Distance,
    Elevation,
    ForceFile,
    Height,
    JsonResult,
    MethodOfView,
    Width,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tbcad.light.reconstruction.field import Field
    from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.light.viewer.render import Renderer, Turntable

REPORT_FILE = "report.html"
MAX_PORT = 65535


FolderOption = Annotated[Path, typer.Argument(metavar="FOLDER")]
"""Folder written by tbcad build, or by tbcad capture or merge; or the file of tbcad reconstruct."""
TurntableOption = Annotated[Path | None, typer.Option()]
"""Write a page that turns the object, to send to somebody, instead of showing the light field or
field: an HTML file of at most 6 MB, which opens from disk."""
RowsOption = Annotated[int, typer.Option(min=1, max=13)]
"""Rows of the turntable, between 15 and 75 degrees of elevation; a single one is at --elevation."""
OpenPageOption = Annotated[bool, typer.Option("--open/--no-open")]
"""Open the browser, or only print the address."""
HttpPortOption = Annotated[int, typer.Option("--http-port", min=0, max=MAX_PORT)]
"""Port of the address; 0: any that is free."""


@app.command()
def show(
    folder: FolderOption,
    azimuth: Azimuth = 0.0,
    elevation: Elevation = 30.0,
    distance: Distance = 640.0,
    width: Width = 640,
    height: Height = 480,
    turntable: TurntableOption = None,
    frames: Annotated[
        int, typer.Option(min=4, max=360, help="Views of the turntable once around.")
    ] = 60,
    rows: RowsOption = 3,
    method: MethodOfView = None,
    open_page: OpenPageOption = True,
    http_port: HttpPortOption = 0,
    force: ForceFile = False,
    json: JsonResult = False,
) -> int:
    """Show a build, a light field or a field in the browser.

    Of a build, opens report.html. Of a light field or a field, opens a page on which dragging
    moves the viewpoint and the wheel changes the distance; of a light field sliders set aperture
    and focus. tbcad makes the views and answers this computer alone; it goes on until Ctrl-C.
    """
    file = folder / LIGHT_FIELD_FILE if folder.is_dir() else folder
    if not file.is_file():
        if turntable is not None:
            raise InputError(f"{file}: no such file; --turntable is for a light field")
        return _show_report(folder, open_page, json)
    from tbcad.light.viewer.page import Query

    start = Query(azimuth, elevation, distance, width=width, height=height)
    from tbcad.light.viewer.render import (
        Turntable,
        capture_mm,
        check_turntable_path,
        even_elevations,
    )

    if turntable is not None:
        check_turntable_path(turntable, force)
    with _shown(file, method) as (pictured, tiles):
        start.check(capture_mm(pictured))
        how = (method or "depth") if pictured is tiles else "field"
        if turntable is not None:
            elevations = even_elevations(rows, elevation)
            table = Turntable(frames, elevations, distance, (width, height), how)
            return _write_turntable(turntable, pictured, table, _title(file), json)
        from tbcad.light.viewer.server import ViewServer

        with ViewServer(_renderer(pictured, tiles, how), _title(file), start, http_port) as server:
            told = f"{server.address} shows {file} by method {how}; Ctrl-C ends it"
            print_result({"address": server.address}, [told], json)
            if open_page:
                _open(server.address)
            try:
                server.serve_forever()
            except KeyboardInterrupt:
                typer.echo("ended", err=True)
    return 0


@contextmanager
def _shown(
    file: Path, method: str | None
) -> "Iterator[tuple[MirrorTiles | Field, MirrorTiles | None]]":
    """Source of the views, a light field or a field; and the light field, if there is one."""
    from tbcad.light.reconstruction.field import SUFFIX, read_field, wanted_field
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.views.mirror_tiles import MirrorTiles

    if file.suffix.lower() == SUFFIX:
        if method not in (None, "field"):
            raise InputError(f"--method {method} is for a light field: leave it out for {file}")
        yield read_field(file), None
        return
    with LightField.open(file) as source:
        tiles = MirrorTiles(source)
        yield wanted_field(method, file, source) or tiles, tiles


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
    print_result({"report": str(page.resolve())}, [str(page.resolve())], json)
    if open_page:
        _open(page.resolve().as_uri())
    return 0


def _renderer(
    pictured: "MirrorTiles | Field", tiles: "MirrorTiles | None", method: str
) -> "Renderer":
    from tbcad.light.reconstruction.field import Field
    from tbcad.light.viewer.render import field_renderer, light_field_renderer

    if isinstance(pictured, Field):
        return field_renderer(pictured, tiles)
    with stages(1) as screen:
        screen.stage("pictures of the virtual cameras")
        return light_field_renderer(pictured, method, screen.detail)


def _write_turntable(
    out: Path, pictured: "MirrorTiles | Field", table: "Turntable", title: str, json: bool
) -> int:
    from tbcad.light.viewer.render import write_turntable

    with stages(1) as screen:
        screen.stage("turntable")
        size = write_turntable(out, pictured, table, title, screen.detail)
    views = table.columns * len(table.elevations_deg)
    told = f"{out}: {views} views by method {table.method}, {size / 1e6:.1f} MB"
    print_result({"turntable": str(out), "bytes": size, "views": views}, [told], json)
    return 0


def _open(address: str) -> None:
    import webbrowser

    if not webbrowser.open(address):
        typer.echo("no browser was found: open this address in one", err=True)


def _title(file: Path) -> str:
    """The name of the capture's folder, or of a light field or field that lies alone."""
    file = file.resolve()
    return file.parent.name if file.name in (LIGHT_FIELD_FILE, FIELD_FILE) else file.stem


tell_options(__name__)
