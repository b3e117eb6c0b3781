"""All sheets of a build as PDF and DXF, drawn in several processes."""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from difflib import get_close_matches
from functools import partial
from itertools import chain, product
from operator import itemgetter
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import trimesh

from tbcad.cad.drafting.callouts import EDGE, PIXELS, balloons
from tbcad.cad.drafting.dimensions import across, upward
from tbcad.cad.drafting.line_pictures import LinePicture, axes_toward, line_picture
from tbcad.cad.drafting.sheet import (
    A3,
    BESIDE_MM,
    Box,
    Sheet,
    TitleBlock,
    choose_scale,
    drawing_room,
    paper_name,
    placed,
    scale_text,
    table,
)
from tbcad.cad.formats.entities import Entity, Point
from tbcad.cad.formats.glb import read_glb
from tbcad.cad.formats.step import read_named_solid
from tbcad.common.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.common.schedule import background_processes
from tbcad.drawings.export import DrawnExport, read_export
from tbcad.drawings.optical_layout import draw_layout, has_layout
from tbcad.drawings.part_sheet import draw_part
from tbcad.drawings.shell_views import HOLE_HEAD, HOLE_WIDTHS_MM, ShellViews, shell_views
from tbcad.drawings.tables import mm
from tbcad.errors import InputError
from tbcad.output.single_files import check_file
from tbcad.records.design import MandrelRecord
from tbcad.types import Progress

BETWEEN_MM, AROUND_MM, LENGTH_MM = 36.0, 20.0, 10.0  # between views, round them; of dimensions


def draw_shell(export: DrawnExport, name: str) -> list[Sheet]:
    """The sheet of a shell or a negative. InputError: its file is not as it was written."""
    step = f"{name}.step"
    block = TitleBlock(
        title=name.replace("_", " "),
        design=export.title,
        item=name,
        quantity=1,
        material="by process",
        tolerances="of tbcad order",
    )
    left, _, right, _ = drawing_room(A3)
    shape = read_named_solid(export.file(step)).shape
    shown = shell_views({"": shape}, right - left, BETWEEN_MM, AROUND_MM)
    x, y = shown.beside
    drawn = [
        *shown.entities(),
        *table((x + BETWEEN_MM, y), HOLE_WIDTHS_MM, [HOLE_HEAD, *shown.rows]),
        *_lengths(shown),
    ]
    front = shown.views[0]
    words = (*_notes(export, name), *export.source(step))
    return [Sheet.framed((name, name), block, A3, front.scale, front.origin, drawn, words)]


def _notes(export: DrawnExport, name: str) -> tuple[str, ...]:
    spec, camera = export.design.spec, name[-1]
    shell = spec.shell
    for record in export.design.mandrels:
        if record.name == name:
            coat = spec.mirrors.coating_um
            return (
                f"Negative of shell_{camera}. Concave mirrors, of the same names: centres and "
                "radii, the",
                f"latter with the coat of {coat:g} um, in mirrors.csv (camera {camera}).",
                _release(record),
                "x = 0 and z = foot flat; blind holes. Datums: A foot, B seam, C dowel hole.",
            )
    foot, seam = shell.foot_flange, shell.seam_flange
    return (
        f"Wall {shell.wall_mm:g} mm behind the deepest valley of the mirrors. Foot flange "
        f"{foot.thickness_mm:g} x {foot.width_mm:g},",
        f"seam flange {seam.thickness_mm:g} x {seam.width_mm:g} mm, holes through. Holes of "
        f"{foot.dowel_hole_mm:g} mm are H7, for dowels.",
        f"Mirrors, polished and coated: mirrors.csv (camera {camera}), limits by tbcad order.",
        "x, y, z from O, the centre of the capture sphere. Datums: A foot, B seam, C dowel hole.",
    )


def _release(record: MandrelRecord) -> str:
    if record.draft_deg < 0:
        return "Undercut: the shell cannot be drawn off; dissolve the mandrel, or melt it out."
    pull = " ".join(f"{one + 0.0:.3f}" for one in record.pull)
    return f"The shell is drawn along ({pull}), draft {record.draft_deg:.1f} degrees."


def _lengths(shown: ShellViews) -> Iterator[Entity]:
    """Overall sizes: x and z of the section y = 0, y of the foot."""
    low, high = shown.box
    (left, bottom), (right, top) = (shown.views[0].at(corner) for corner in (low, high))
    yield across((left, top), (right, top), top + LENGTH_MM, mm(float(high[0] - low[0])))
    yield upward((right, bottom), (right, top), right + LENGTH_MM, mm(float(high[2] - low[2])))
    (_, bottom), (right, top) = (shown.views[1].at(corner) for corner in (low, high))
    yield upward((right, bottom), (right, top), right + LENGTH_MM, mm(float(high[1] - low[1])))


NAME = "assembly"
# Toward the eye: from the camera's side, from behind the uprights, from below to the balls.
EYES = ((1.0, -1.0, 0.6), (-1.0, -1.0, 0.6), (0.6, -1.0, -0.35))
NOTES = (
    "Numbers are those of the parts list, bom.csv.",
    "What is hidden here is on another sheet; what is nowhere is inside others or has no body.",
)
VIEWS = (
    "from the camera's side, without shroud",
    "from behind, without shroud",
    "from below, without shroud",
)
LEFT_OUT = ("shroud_", "capture_sphere", "camera_view")  # would hide the rest, or are no parts
SCALES = (0.5, 0.4, 0.2, 0.1)
PIECE_MM = 2.0  # edges are tested in pieces as long
HEAD, WIDTHS_MM = ("no.", "qty", "part"), (9.0, 9.0, 42.0)
Called: TypeAlias = Mapping[str, tuple[int, int, Point]]
"""Number and quantity of parts, and a point of each in a picture, mm."""


def draw_assembly(export: DrawnExport) -> list[Sheet]:
    """A sheet for each side of the machine. InputError: its file is not as it was written."""
    machine = export.machine
    assert machine is not None
    path = export.file(machine.record.assembly.glb)
    parts = {**machine.bodies, **{one.name: one.part for one in machine.fasteners}}
    listed = {
        part: (item, machine.bill.quantities[part]) for part, item in machine.bill.items.items()
    }
    return assembly_sheets(path, parts, listed, export.title)


def assembly_sheets(
    path: Path, parts: Mapping[str, str], listed: Mapping[str, tuple[int, int]], design: str
) -> list[Sheet]:
    """A sheet for each side, with the numbers of what is seen there first.

    From the GLB file of all bodies, the part of each, and each part's number and quantity.
    """
    bodies = {
        one.name: trimesh.Trimesh(one.mesh.vertices, one.mesh.triangles)
        for one in read_glb(path)
        if not one.name.startswith(LEFT_OUT)
    }
    sheets, seen = list[Sheet](), set[str]()
    for k, eye in enumerate(EYES):
        picture = line_picture(bodies, axes_toward(eye), PIECE_MM)
        anchors: dict[str, Point] = {}  # of each part that has no number yet: its first body's
        for body, point in picture.anchors.items():
            part = parts.get(body, "")
            if part in listed and part not in seen:
                anchors.setdefault(part, point)
        seen |= anchors.keys()
        shown = {part: (*listed[part], point) for part, point in anchors.items()}
        sheets.append(_sheet(picture, shown, design, k))
    return sheets


def _sheet(picture: LinePicture, shown: Called, design: str, k: int) -> Sheet:
    left, low, right, high = drawing_room(A3)
    column = right - sum(WIDTHS_MM) - BESIDE_MM
    room = left, low, column, high
    scale, origin = _fitted(picture, room)
    block = TitleBlock(
        title="general assembly",
        design=design,
        item="all",
        quantity=1,
        material="see the parts list",
        view=VIEWS[k],
        sheet=f"{k + 1} of {len(EYES)}",
        tolerances="none",
    )
    rows = sorted((item, quantity, part) for part, (item, quantity, _) in shown.items())
    cells = [(str(item), str(quantity), part) for item, quantity, part in rows]
    points = [
        (number, (origin[0] + scale * x, origin[1] + scale * y))
        for number, _, (x, y) in shown.values()
    ]
    drawn = [
        *placed(picture.lines, origin, scale),
        *balloons(points, room),
        *table((column + BESIDE_MM, high), WIDTHS_MM, (HEAD, *cells)),
    ]
    name = NAME if k == 0 else f"{NAME}_{k + 1}"
    return Sheet.framed((name, NAME), block, A3, scale, origin, drawn, NOTES)


def _fitted(picture: LinePicture, room: Box) -> tuple[float, Point]:
    """Scale and place of a picture between two columns of numbers."""
    points = np.array([end for line in picture.lines for end in (line.start, line.end)])
    low, high = points.min(axis=0), points.max(axis=0)
    edge = 2 * EDGE / PIXELS
    space = room[2] - room[0] - 2 * edge, room[3] - room[1] - 2 * BESIDE_MM
    scale = choose_scale((high - low).tolist(), space, SCALES)
    middle = np.array([room[0] + room[2], room[1] + room[3]]) / 2 - scale * (low + high) / 2
    return scale, (float(middle[0]), float(middle[1]))


SUFFIXES = (".pdf", ".dxf")
OPTICAL_LAYOUT, ASSEMBLY = "optical_layout", "assembly"


WrittenSheet: TypeAlias = dict[str, Any]
"""A sheet that was written: name, title, part that it shows, paper, scale or None, files."""


def write_drawings(
    folder: Path,
    out: Path,
    only: Sequence[str] = (),
    *,
    force: bool = False,
    progress: Progress = lambda _: None,
    workers: int = 1,
) -> list[WrittenSheet]:
    """Draw a build into a folder, whose other files stay, in a number of processes.

    Without names in `only` everything is drawn; progress is called with each name that is done.

    InputError: no build, a file of it is not as it was written, a name is unknown, or files cannot
    be written or exist.
    """
    export = read_export(folder)
    names = _chosen(export, only)
    for name, suffix in product(names, SUFFIXES):
        check_file(out / f"{name}{suffix}", force)
    with tempfile.TemporaryDirectory(prefix="tbcad-drawings-") as place:
        work = partial(draw, export, Path(place))
        done = _results(work, names, progress, min(workers, len(names)))
        drawings = sorted(chain.from_iterable(done), key=itemgetter("name"))
        files = sorted(Path(place).iterdir())
        for file in files:
            check_file(out / file.name, force)
        with write_errors_as_input_errors(out):
            out.mkdir(parents=True, exist_ok=True)
        replace_files(out, {file.name: file.read_bytes() for file in files})
    return drawings


def drawable(export: DrawnExport) -> list[str]:
    """Names of all that can be drawn of a build, those that take longest first."""
    parts = sorted(export.parts, key=lambda name: (not name.startswith("carrier"), name))
    whole = [ASSEMBLY] if export.machine else []
    layout = [OPTICAL_LAYOUT] if has_layout(export.design) else []
    return [*export.shells, *whole, *parts, *layout]


def _chosen(export: DrawnExport, only: Sequence[str]) -> list[str]:
    names = drawable(export)
    if not names:
        raise InputError(
            f"{export.folder} has no prototype, and its pinholes are not in the plane y = 0 of the "
            "optical layout: build it with --parts prototype"
        )
    for name in only:
        if name not in names:
            near = get_close_matches(name, names, 1) or names[:1]
            raise InputError(
                f"--only {name:.40} is nothing that this build can draw; the nearest is "
                f"{near[0]}, all are: {', '.join(sorted(names))}"
            )
    return [name for name in names if name in only or not only]


def _results(
    work: Callable[[str], list[WrittenSheet]],
    names: Sequence[str],
    progress: Progress,
    workers: int,
) -> Iterator[list[WrittenSheet]]:
    if workers == 1:
        for name in names:
            yield work(name)
            progress(name)
        return
    with background_processes(workers) as submit:
        futures = {submit(work, name): name for name in names}
        for future in as_completed(futures):
            yield future.result()
            progress(futures[future])


def draw(export: DrawnExport, place: Path, name: str) -> list[WrittenSheet]:
    """Draw all sheets of a part, or of what has another name, and write them into a folder.

    InputError: a file that is drawn is missing or not as it was written.
    """
    if name in export.parts:
        sheets = draw_part(export, export.parts[name])
    elif name in export.shells:
        sheets = draw_shell(export, name)
    else:
        sheets = (draw_assembly if name == ASSEMBLY else draw_layout)(export)
    for sheet in sheets:
        sheet.write(place)
    return [
        {
            "name": sheet.name,
            "title": sheet.title,
            "part": sheet.part,
            "paper": paper_name(sheet.paper),
            "scale": scale_text(sheet.scale) if sheet.to_scale else None,
            "files": [sheet.name + suffix for suffix in SUFFIXES],
        }
        for sheet in sheets
    ]
