"""All sheets of an export as PDF and DXF, drawn in several processes."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from tbcad.cad.drafting.sheet import Sheet, paper_name, scale_text
from tbcad.common.atomic_files import replace_files, write_errors_as_input_errors
from tbcad.common.schedule import background_processes
from tbcad.drawings.export import DrawnExport, read_export
from tbcad.drawings.optical_layout import has_layout, layout_rows, layout_sheet
from tbcad.errors import InputError
from tbcad.output.single_files import check_file
from tbcad.types import Progress

SUFFIXES = (".pdf", ".dxf")
OPTICAL_LAYOUT, ASSEMBLY = "optical_layout", "assembly"


@dataclass(frozen=True)
class WrittenSheet:
    """A sheet that was written."""

    name: str  # of its files
    title: str  # in its title block
    part: str  # that it shows
    paper: str  # A3 or A4
    scale: str | None  # such as 1:2; None where nothing is to scale

    @property
    def files(self) -> list[str]:
        """Names of its files."""
        return [self.name + suffix for suffix in SUFFIXES]


@dataclass(frozen=True)
class Job:
    """Sheets that one process draws."""

    name: str  # of the part, or of what is drawn
    draw: Callable[..., list[Sheet]]  # function of a module
    arguments: tuple[Any, ...]  # of it


def write_drawings(
    folder: Path,
    out: Path,
    only: Sequence[str] = (),
    *,
    force: bool = False,
    progress: Progress = lambda _: None,
    workers: int = 1,
) -> list[WrittenSheet]:
    """Draw an export into a folder, whose other files stay, in a number of processes.

    Without names in `only` everything is drawn; progress is called with each name that is done.

    InputError: no export, a file of it is not as it was written, a name is unknown, or files cannot
    be written or exist.
    """
    export = read_export(folder)
    names = _chosen(export, only)
    jobs = [_job(export, name) for name in names]
    for job in jobs:
        for suffix in SUFFIXES:
            check_file(out / f"{job.name}{suffix}", force)
    with write_errors_as_input_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="tbcad-drawings-") as place:
        results = _results(jobs, Path(place), progress, min(workers, len(jobs)))
        drawings = sorted((one for done in results for one in done), key=lambda one: one.name)
        files = sorted(Path(place).iterdir())
        for file in files:
            check_file(out / file.name, force)
        replace_files(out, {file.name: file.read_bytes() for file in files})
    return drawings


def drawable(export: DrawnExport) -> list[str]:
    """Names of all that can be drawn of an export, those that take longest first."""
    parts = sorted(export.parts, key=lambda name: (not name.startswith("carrier"), name))
    whole = [ASSEMBLY] if export.machine else []
    return [
        *export.shells,
        *export.mandrels,
        *whole,
        *parts,
        *([OPTICAL_LAYOUT] if has_layout(export.design) else []),
    ]


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
                f"--only {name:.40} is nothing that this export can draw; the nearest is "
                f"{near[0]}, all are: {', '.join(sorted(names))}"
            )
    return [name for name in names if name in only or not only]


def _job(export: DrawnExport, name: str) -> Job:
    from tbcad.drawings.assembly_sheet import assembly_job, draw_assembly
    from tbcad.drawings.printed_parts import draw_part, part_job
    from tbcad.drawings.shell_sheet import draw_shell, mandrel_job, shell_job

    if name == ASSEMBLY and export.machine:
        return Job(name, draw_assembly, (assembly_job(export, export.machine),))
    if name in export.shells:
        return Job(name, draw_shell, (shell_job(export, name),))
    if name in export.mandrels:
        return Job(name, draw_shell, (mandrel_job(export, name),))
    if name == OPTICAL_LAYOUT:
        rows = layout_rows(export)
        return Job(name, layout_sheet, (export.design, rows, export.title))
    return Job(name, draw_part, (part_job(export, export.parts[name]),))


def _results(
    jobs: Sequence[Job], place: Path, progress: Progress, workers: int
) -> Iterator[list[WrittenSheet]]:
    if workers == 1:
        for job in jobs:
            yield draw(job, place)
            progress(job.name)
        return
    with background_processes(workers) as submit:
        futures = {submit(draw, job, place): job.name for job in jobs}
        for future in as_completed(futures):
            yield future.result()
            progress(futures[future])


def draw(job: Job, place: Path) -> list[WrittenSheet]:
    """Draw and write all sheets of a job into a folder."""
    sheets = job.draw(*job.arguments)
    for sheet in sheets:
        sheet.write(place)
    return [
        WrittenSheet(
            sheet.name,
            sheet.title,
            sheet.part,
            paper_name(sheet.paper),
            scale_text(sheet.scale) if sheet.to_scale else None,
        )
        for sheet in sheets
    ]


def record(out: Path, drawings: Sequence[WrittenSheet]) -> dict[str, Any]:
    """What was written, for JSON."""
    return {"folder": str(out), "sheets": [asdict(one) | {"files": one.files} for one in drawings]}
