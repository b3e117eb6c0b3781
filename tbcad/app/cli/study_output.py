"""What the commands of all studies share: their subject, and where and how results are shown."""

from collections.abc import Callable
from dataclasses import asdict
from inspect import Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import typer

from tbcad.app.cli.app import print_json
from tbcad.common.screen import paragraph, report_console, stages
from tbcad.options.checks import check_is_export
from tbcad.options.shared import Design, Exports, JsonResult, Out, PlotFormatOption, Settings

if TYPE_CHECKING:
    from tbcad.common.figure_files import PlotFormat
    from tbcad.common.results import Study
    from tbcad.core.spec.design import Spec
    from tbcad.types import Progress


Work: TypeAlias = "Callable[[Progress], Study]"

STUDIES = Path("studies")


def of_design(prepare: Callable[..., Work]) -> Callable[..., int]:
    """A command for a study of a design: takes its Spec, then options of its own."""
    return _command(prepare, _spec)


def of_export(prepare: Callable[..., Work]) -> Callable[..., int]:
    """A command for a study of an export: takes its folder, then options of its own."""
    return _command(prepare, _folder)


def _spec(design: Design[Path] = None, settings: Settings = None) -> "Spec":
    from tbcad.core.spec.load import load_spec

    return load_spec(design, settings or ())


def _folder(folder: Exports[Path]) -> Path:
    check_is_export(folder)
    return folder


def _command(prepare: Callable[..., Work], subject: Callable[..., object]) -> Callable[..., int]:
    """The command: options of the subject, of all studies, and of this one, in this order."""

    def command(
        out: Out[Path] = STUDIES,
        json: JsonResult = False,
        plot: PlotFormatOption = "png",
        **options: Any,
    ) -> int:
        given = {name: options.pop(name) for name in signature(subject).parameters}
        return _run_study(out, json, plot, prepare(subject(**given), **options))

    shared = list(signature(command).parameters.values())[:-1]
    own = list(signature(prepare).parameters.values())[1:]
    parameters = [*signature(subject).parameters.values(), *shared, *own]
    command.__name__, command.__doc__ = prepare.__name__, prepare.__doc__
    # What typer makes options of; it would take annotations before those of the signature.
    vars(command)["__signature__"] = Signature(parameters)
    command.__annotations__ = {}
    return command


def _run_study(out: Path, json: bool, plot: "PlotFormat", work: Work) -> int:
    """Make a study, write its files, and show its figures next to the paper's."""
    from tbcad.common.results import check_study_folder, write_study
    from tbcad.output.single_files import check_tables

    check_tables(out)
    check_study_folder(out)
    with stages(2) as screen:
        screen.stage("study: mirrors and rays")
        result = work(screen.detail)
        screen.stage("study: files")
        files = write_study(result, out, plot=plot)
    if json:
        print_json(_record(result, files))
        return 0
    _show(result)
    typer.echo(paragraph(f"{out}: {', '.join(file.name for file in files)}"))
    return 0


def _record(result: "Study", files: list[Path]) -> dict[str, object]:
    """What is shown, for other programs."""
    return {
        "schema": "tbcad-study/1",
        "study": result.name,
        "figures": [asdict(figure) for figure in result.figures],
        "notes": list(result.notes),
        "files": [str(file) for file in files],
    }


def _show(result: "Study") -> None:
    from rich.table import Table

    table = Table(box=None)
    for heading in ("quantity", "tbcad", "the paper", "where in the paper"):
        table.add_column(heading, overflow="fold")
    for quantity, unit, ours, paper, where in result.summary.rows:
        table.add_row(str(quantity), _shown(ours, unit), _shown(paper, unit), str(where))
    report_console().print(table)


def _shown(value: str | int | float | None, unit: str | int | float | None) -> str:
    """A figure with four digits; the files have all of them."""
    short = f"{value:.4g}" if isinstance(value, float) else "-" if value is None else str(value)
    return f"{short} {unit}".rstrip() if value is not None else short
