"""Progress of a long command: a bar on a terminal, plain lines elsewhere."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

PIPED_WIDTH = 160


def report_console() -> Console:
    """Where results are printed; piped, a table needs no terminal's width."""
    return Console() if sys.stdout.isatty() else Console(width=PIPED_WIDTH)


class Stages:
    """Stages of one command, shown on stderr."""

    def __init__(self, bar: Progress | None, total: int) -> None:
        """Show stages on a bar, or in plain lines when there is none."""
        self._bar = bar
        self._task = bar.add_task("", total=total) if bar else None
        self._plain = Console(stderr=True, highlight=False, soft_wrap=True)
        self._stage = ""

    def stage(self, text: str) -> None:
        """Begin the next stage."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=text, advance=1 if self._stage else 0)
        else:
            self._plain.print(f"tbcad: {text}", markup=False)
        self._stage = text

    def detail(self, text: str) -> None:
        """Show a step of the stage, on a terminal only."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=f"{self._stage}: {text}")


@contextmanager
def stages(total: int) -> Iterator[Stages]:
    """Show stages while the block runs; `total` is about their number."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield Stages(None, total)
        return
    columns = (
        SpinnerColumn(),
        BarColumn(bar_width=24),
        TimeElapsedColumn(),
        TextColumn("{task.description}", markup=False),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        yield Stages(bar, total)
