"""Radii of balls that were measured, as the command takes them."""

import re

from tbcad.errors import InputError

MEASURED_MM = 0.01
"""Standard deviation of a radius that is measured without saying how well: by a micrometer screw
over the body, or a spherometer."""
PATTERN = re.compile(r"(\d{1,4})=([0-9.]{1,12})(?::([0-9.]{1,12}))?")

Measured = tuple[tuple[int, float, float], ...]


def parse_measured(texts: tuple[str, ...], balls: int) -> Measured:
    """Radii "BALL=MM" or "BALL=MM:SIGMA" as number from 0, radius and standard deviation, mm.

    Args:
        texts: of the options.
        balls: number of balls of the prototype.

    Raises:
        InputError: a text is neither, or names another ball.
    """
    return tuple(_measured(text, balls) for text in texts)


def _measured(text: str, balls: int) -> tuple[int, float, float]:
    found = PATTERN.fullmatch(text.replace(" ", ""))
    try:
        ball, radius, sigma = found.groups() if found else ("", "", "")
        values = int(ball) - 1, float(radius), float(sigma or MEASURED_MM)
    except ValueError:
        raise InputError(
            f"--measured {text!r:.60} is not BALL=RADIUS_MM or BALL=RADIUS_MM:SIGMA_MM: write for "
            "instance 1=43.21:0.01"
        ) from None
    if not (0 <= values[0] < balls and values[1] > 0 and values[2] > 0):
        raise InputError(
            f"--measured {text}: allowed is ball 1 to {balls}, with a radius and a deviation above "
            "0 mm: change it"
        )
    return values
