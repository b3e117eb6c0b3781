"""Progress of a long command: a bar on a terminal, plain lines elsewhere.

What draws is loaded when it is needed: help and errors of the input come without it.
"""

from __future__ import annotations

import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import accumulate
from time import monotonic
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

WIDTH = 80  # columns of what is printed where no terminal says how many it has
BAR_WIDTH = 12
# The pace of this computer is taken from the stages done, and from this share of all of them as if
# it had been done at the expected pace: the first short stages say little of the others.
PRIOR_SHARE = 0.1
PAUSE_S = 30.0  # without a plain line, before a step is worth one


def report_console() -> Console:
    """Where results are printed."""
    from rich.console import Console

    return Console() if sys.stdout.isatty() else Console(width=WIDTH)


def paragraph(text: str, first: str = "", others: str = "") -> str:
    """Text in lines of WIDTH columns at most, but for words that are longer: paths stay whole.

    The first line and the others begin with what is given.
    """
    return textwrap.fill(
        text,
        WIDTH,
        initial_indent=first,
        subsequent_indent=others,
        break_long_words=False,
        break_on_hyphens=False,
    )


class TimeLeft:
    """Estimate of the time left, from expected durations and the pace so far."""

    def __init__(self, expected: Mapping[str, float], clock: Callable[[], float] = monotonic):
        """Take the expected seconds of all stages, in order, by title."""
        self._begins = dict(zip(expected, accumulate(expected.values(), initial=0.0), strict=False))
        self._expected, self._clock = expected, clock
        self.total = sum(expected.values())
        self._started = self._stage_started = clock()
        self._done, self._stage = 0.0, 0.0

    def begin(self, stage: str) -> None:
        """Begin a stage: those before it are done. A stage not expected changes nothing."""
        if stage in self._begins:
            self._done, self._stage = self._begins[stage], self._expected[stage]
            self._stage_started = self._clock()

    @property
    def done(self) -> float:
        """Expected seconds of what is done."""
        return self._done + min(self._clock() - self._stage_started, self._stage)

    @property
    def seconds(self) -> float:
        """Seconds left, about."""
        prior = PRIOR_SHARE * self.total
        pace = (self._clock() - self._started + prior) / (self.done + prior)
        return pace * (self.total - self.done)

    def __str__(self) -> str:
        """Return the estimate in words."""
        minutes, seconds = divmod(round(self.seconds), 60)
        return f"about {minutes}:{seconds:02d} left"


class Stages:
    """Stages of one command, shown on stderr."""

    def __init__(
        self, bar: Progress | None, expected: Mapping[str, float] | int, silent: bool = False
    ) -> None:
        """Show stages on a bar, or in plain lines when there is none, or not at all."""
        self._left = None if isinstance(expected, int) else TimeLeft(expected)
        total = expected if isinstance(expected, int) else sum(expected.values())
        self._bar, self._silent = bar, silent
        self._task = bar.add_task("", total=total, left=self._left or "") if bar else None
        self._started = self._printed = monotonic()
        self._stage = ""

    def stage(self, text: str) -> None:
        """Begin the next stage."""
        if self._left is not None:
            self._left.begin(text)
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=text, advance=1 if self._stage else 0)
            if self._left is not None:
                self._bar.update(self._task, completed=self._left.done)
        else:
            self._print(text)
        self._stage = text

    def _print(self, text: str) -> None:
        self._printed = monotonic()
        if not self._silent:
            print(f"[{self._printed - self._started:3.0f} s] {text}", file=sys.stderr, flush=True)

    def detail(self, text: str) -> None:
        """Show a step of the stage; without a terminal only where no line came for some time."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=f"{self._stage}: {text}")
        elif monotonic() - self._printed > PAUSE_S:
            self._print(f"{self._stage}: {text}")

    def note(self, text: str) -> None:
        """Print a line that stays."""
        if self._bar is not None:
            self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)
        else:
            self._print(text)


@contextmanager
def stages(expected: Mapping[str, float] | int, silent: bool = False) -> Iterator[Stages]:
    """Show stages while the block runs, unless it is silent.

    Expected are the seconds of each stage, in order, by title; or about the number of stages, and
    no time left is shown.
    """
    from rich.console import Console

    console = Console(stderr=True)
    if silent or not console.is_terminal:
        yield Stages(None, 0, silent)
        return
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    bar = Progress(
        SpinnerColumn(),
        BarColumn(bar_width=BAR_WIDTH),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]} {task.description}", markup=False),
        console=console,
        transient=True,
    )
    with bar:
        yield Stages(bar, expected)
