"""Seats of balls and caps on the sheet of the carrier: sphere, centre, pads."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.cad.features import distance
from tbcad.cad.projection import Shape
from tbcad.drawings.columns import Table
from tbcad.drawings.holes import mm
from tbcad.types import Floats

HEAD = ("seat", "is for", "R", "x", "y", "z", "3 pads")
WIDTHS_MM = (9.0, 28.0, 15.0, 17.0, 17.0, 17.0, 12.0)
ON_PART_MM = 0.5  # of a pad's place from the part, offset as the coupon asks


@dataclass(frozen=True)
class Seat:
    """A seat.

    Attributes:
        number: of its ball.
        takes: what lies in it.
        radius: of the body's sphere, mm.
        centre: of that, mm, (3,).
        axis: of the seat, a unit vector, (3,).
        contacts: with the pads, mm, (3, 3).
        pad: diameter of the pads, mm.
    """

    number: int
    takes: str
    radius: float
    centre: Floats
    axis: Floats
    contacts: Floats
    pad: float


def seats_table(shape: Shape, seats: Sequence[Seat]) -> Table:
    """The seats whose pads are on a part, places in the part's frame."""
    rows = [
        (
            str(one.number),
            one.takes,
            f"{one.radius:.3f}",
            *(f"{value + 0.0:.2f}" for value in np.round(one.centre, 2).tolist()),
            f"Ø{mm(one.pad)}",
        )
        for one in seats
        if all(distance(shape, contact) < ON_PART_MM for contact in one.contacts)
    ]
    return Table(HEAD, WIDTHS_MM, tuple(rows))
