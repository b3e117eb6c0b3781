"""All sheets of a build as PDF and DXF, drawn in several processes."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from difflib import get_close_matches
from functools import partial
from itertools import chain, product
from operator import itemgetter
from pathlib import Path
from typing import Any, TypeAlias

from tbcad.cad.drafting.sheet import paper_name, scale_text
from tbcad.common.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.common.schedule import background_processes
from tbcad.drawings.export import DrawnExport, read_export
from tbcad.drawings.optical_layout import draw_layout, has_layout
from tbcad.errors import InputError
from tbcad.output.single_files import check_file
from tbcad.types import Progress

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
    from tbcad.drawings.assembly_sheet import draw_assembly
    from tbcad.drawings.part_sheet import draw_part
    from tbcad.drawings.shell_sheet import draw_shell

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
