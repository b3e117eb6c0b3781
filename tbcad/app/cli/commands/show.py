"""The command that shows an export or a light field in the browser."""

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

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
    from tbcad.light.viewer.page import Query
    from tbcad.light.viewer.render import MethodAtRest, Renderer

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
    """Show an export, a light field or a field in the browser.

    Of an export, opens report.html. Of a light field or a field, opens a page on which dragging
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
    if turntable is not None:
        from tbcad.light.viewer.render import check_turntable_path

        check_turntable_path(turntable, force)
    from tbcad.light.viewer.render import capture_mm

    with _shown(file, method) as shown:
        start.check(capture_mm(shown.pictured))
        if turntable is not None:
            return _write_turntable(shown, turntable, start, (frames, rows), json)
        return _show_views(shown, start, http_port, open_page, json)


class _Shown(NamedTuple):
    """What is shown."""

    file: Path  # of the light field, or of a field without one
    pictured: "MirrorTiles | Field"  # what views are made from
    tiles: "MirrorTiles | None"  # the light field; None: there is a field alone
    method: "MethodAtRest" = "depth"  # of views of a light field

    @property
    def how(self) -> str:
        """The method of all views."""
        return self.method if self.pictured is self.tiles else "field"


@contextmanager
def _shown(file: Path, method: "MethodAtRest | Literal['field'] | None") -> "Iterator[_Shown]":
    """A light field, with the field that is asked for or beside it; or a field."""
    from tbcad.light.reconstruction.field import SUFFIX, read_field, wanted_field
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.views.mirror_tiles import MirrorTiles

    if file.suffix.lower() == SUFFIX:
        if method not in (None, "field"):
            raise InputError(f"--method {method} is for a light field: leave it out for {file}")
        yield _Shown(file, read_field(file), None)
        return
    with LightField.open(file) as source:
        tiles = MirrorTiles(source)
        made = wanted_field(method, file, source)
        how: MethodAtRest = "depth" if method is None or method == "field" else method
        yield _Shown(file, made or tiles, tiles, how)


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


def _show_views(shown: _Shown, start: "Query", port: int, open_page: bool, json: bool) -> int:
    from tbcad.light.viewer.server import ViewServer

    with ViewServer(_renderer(shown), _title(shown.file), start, port) as server:
        told = f"{server.address} shows {shown.file} by method {shown.how}; Ctrl-C ends it"
        print_result({"address": server.address}, [told], json)
        if open_page:
            _open(server.address)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            typer.echo("ended", err=True)
    return 0


def _renderer(shown: _Shown) -> "Renderer":
    from tbcad.light.reconstruction.field import Field
    from tbcad.light.viewer.render import field_renderer, light_field_renderer

    if isinstance(shown.pictured, Field):
        return field_renderer(shown.pictured, shown.tiles)
    with stages(1) as screen:
        screen.stage("pictures of the virtual cameras")
        return light_field_renderer(shown.pictured, shown.method, screen.detail)


def _write_turntable(
    shown: _Shown, out: Path, start: "Query", views: tuple[int, int], json: bool
) -> int:
    from tbcad.light.viewer.render import Turntable, even_elevations, write_turntable

    columns, rows = views
    elevations = even_elevations(rows, start.elevation)
    size_px = start.width, start.height
    table = Turntable(columns, elevations, start.distance, size_px, shown.method)
    with stages(1) as screen:
        screen.stage("turntable")
        size = write_turntable(out, shown.pictured, table, _title(shown.file), screen.detail)
    told = f"{out}: {columns * rows} views by method {shown.how}, {size / 1e6:.1f} MB"
    print_result({"turntable": str(out), "bytes": size, "views": columns * rows}, [told], json)
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
