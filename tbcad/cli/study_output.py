"""Makes a study, writes its files, and shows its figures next to the paper's."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from tbcad.cli.output_mode import print_json
from tbcad.screen import paragraph, report_console, stages

if TYPE_CHECKING:
    from tbcad.figure_files import PlotFormat
    from tbcad.results.study import Study
    from tbcad.types import Progress


def run_study(
    out: Path, json: bool, plot: "PlotFormat", work: "Callable[[Progress], Study]"
) -> int:
    """Make a study, write its files, and show its figures next to the paper's."""
    from tbcad.output.single_files import check_tables
    from tbcad.results.study import check_study_folder, write_study

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
