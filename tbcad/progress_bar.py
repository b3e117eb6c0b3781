"""The bar that shows the progress of a long command on a terminal."""

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

from tbcad.screen import TimeLeft

BAR_WIDTH = 12
MINUTE = 60


def progress_bar(console: Console, time_left: TimeLeft | None) -> Progress:
    """A bar, which vanishes at its end, with the stage and, if it is estimated, the time left."""
    return Progress(
        SpinnerColumn(),
        BarColumn(bar_width=BAR_WIDTH),
        TimeElapsedColumn(),
        *([_TimeLeftColumn(time_left)] if time_left else []),
        TextColumn("{task.description}", markup=False),
        console=console,
        transient=True,
    )


class _TimeLeftColumn(ProgressColumn):
    """The estimate, in words."""

    def __init__(self, time_left: TimeLeft) -> None:
        super().__init__()
        self._left = time_left

    def render(self, task: Task) -> Text:
        task.completed = self._left.done
        minutes, seconds = divmod(round(self._left.seconds), MINUTE)
        return Text(f"about {minutes}:{seconds:02d} left")
