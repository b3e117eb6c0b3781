"""The bar that shows the progress of a long command on a terminal."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from tbcad.background import Repeated
from tbcad.screen import TimeLeft

BAR_WIDTH = 12
REFRESH_S = 0.1
MINUTE = 60


@contextmanager
def progress_bar(console: Console, time_left: TimeLeft | None) -> Iterator[Progress]:
    """A bar, which vanishes at its end, with the stage and, if it is estimated, the time left.

    It is drawn again by a thread that pauses while the process is copied; rich's own would not.
    """
    bar = Progress(
        SpinnerColumn(),
        BarColumn(bar_width=BAR_WIDTH),
        TimeElapsedColumn(),
        *([_TimeLeftColumn(time_left)] if time_left else []),
        TextColumn("{task.description}", markup=False),
        console=console,
        transient=True,
        auto_refresh=False,
    )
    with bar, Repeated(bar.refresh, REFRESH_S):
        yield bar


class _TimeLeftColumn(ProgressColumn):
    """The estimate, in words."""

    def __init__(self, time_left: TimeLeft) -> None:
        super().__init__()
        self._left = time_left

    def render(self, task: Task) -> Text:
        task.completed = self._left.done
        minutes, seconds = divmod(round(self._left.seconds), MINUTE)
        return Text(f"about {minutes}:{seconds:02d} left")
