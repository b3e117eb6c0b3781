"""Numbers that are written as texts: exposure times as cameras show them, lists of stops."""

import math
from typing import Annotated, TypeVar

import typer

from tbcad.errors import InputError

Time = TypeVar("Time")
SHORTEST_S, LONGEST_S = 1e-6, 3600.0
MOST_STOPS = 1_000_000  # as a run's record may have

ExposureLeds = Annotated[
    Time | None,
    typer.Option(
        "--exposure-leds",
        metavar="S",
        help="Exposure of the photographs by LEDs and in the dark, s, such as 1/60; --exposure-lit "
        "alone is for all.",
    ),
]
ExposureLit = Annotated[
    Time | None,
    typer.Option(
        "--exposure-lit",
        metavar="S",
        help="Exposure of the photographs of the lit object, s, such as 0.5; --exposure-leds alone "
        "is for all.",
    ),
]


def seconds(option: str, given: str | float | None) -> float | None:
    """An exposure time, s, of a number or a fraction as cameras show it.

    Raises:
        InputError: it is neither, or no time of an exposure.
    """
    if given is None:
        return None
    text = str(given)
    above, slash, below = text.partition("/")
    try:
        found = float(above) / (float(below) if slash else 1.0)
    except (ValueError, ZeroDivisionError):
        found = math.nan
    if not SHORTEST_S <= found <= LONGEST_S:
        raise InputError(
            f"{option} is {text!r:.40}, allowed are {SHORTEST_S:g} to {LONGEST_S:g} s, as 0.5 "
            "or 1/60: change it"
        )
    return found


def numbers(text: str) -> tuple[int, ...]:
    """Whole numbers of a list as 1,5,20-30.

    Raises:
        InputError: it is none.
    """
    found: set[int] = set()
    for part in text.split(","):
        first, _, last = part.partition("-")
        try:
            chosen = range(int(first), int(last or first) + 1)
            if not 1 <= len(chosen) <= MOST_STOPS:
                raise ValueError
            found.update(chosen)
        except ValueError:
            raise InputError(
                f"--stops {text!r:.60}: {part.strip()!r:.20} is no stop or range of stops: write "
                "for instance 1,5,20-30"
            ) from None
    return tuple(sorted(found))
