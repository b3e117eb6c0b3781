"""Exposure times of the photographs of a run, as both commands that take them are told."""

import math
from typing import Annotated

import typer

from tbcad.errors import InputError

SHORTEST_S, LONGEST_S = 1e-6, 3600.0

ExposureLeds = Annotated[
    str | None,
    typer.Option(
        metavar="S",
        help="Exposure of the photographs by LEDs and in the dark, s, such as 1/60; --exposure-lit "
        "alone is for all.",
    ),
]
ExposureLit = Annotated[
    str | None,
    typer.Option(
        metavar="S",
        help="Exposure of the photographs of the lit object, s, such as 0.5; --exposure-leds alone "
        "is for all.",
    ),
]


def seconds(option: str, text: str | None) -> float | None:
    """An exposure time, s, of a number or a fraction as cameras show it.

    Raises:
        InputError: it is neither, or no time of an exposure.
    """
    if text is None:
        return None
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
