"""The lamps as data: strips, places, bodies, and what holds them."""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.primitives import Component
from tbcad.prototype.fasteners.fastener import Fastener
from tbcad.prototype.frame.brackets import Bracket
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats

STRIP, SHORT_STRIP = "STRIP-COB-24V", "STRIP-240-24V"
EDGE_MM = 2.0  # of a plate beyond the strips
ACROSS, UP = np.eye(3)[1:]


@dataclass(frozen=True)
class LampLayout:
    """The lamps, in the frame of the shell.

    Attributes:
        strip: that they are made of, from the lists.
        strips: number of strips on each, side by side.
        length: of a strip, mm.
        level: whether strips lie level, along y; else they are upright.
        places: middles of the shining faces, mm, (l, 3).
        inward: unit directions that they shine in, (l, 3).
        stands: on the base plate, to print.
        holders: on the uprights, to print.
        screws: heights (z) of the holders' screws on each upright, the upper first, mm.
        fasteners: that hold the holders.
        bodies: of the strips of each lamp.
    """

    strip: PurchasedPart
    strips: int
    length: float
    level: bool
    places: Floats
    inward: Floats
    stands: tuple[Bracket, ...]
    holders: tuple[Component, ...]
    screws: tuple[float, ...]
    fasteners: tuple[Fastener, ...]
    bodies: tuple[Component, ...]

    @property
    def width(self) -> float:
        """Of all strips of a lamp, side by side, mm."""
        return self.strips * self.strip["width_mm"]

    @property
    def sides(self) -> tuple[float, float]:
        """Of a shining face, along y and along z, mm."""
        return (self.length, self.width) if self.level else (self.width, self.length)

    @property
    def metres(self) -> float:
        """Length of all strips, m."""
        return len(self.places) * self.strips * self.length / 1e3

    @property
    def watt(self) -> float:
        """Power of all lamps."""
        return self.metres * self.strip["watt_m"]

    @property
    def current_ma(self) -> float:
        """Of all lamps, at the strip's voltage."""
        return 1e3 * self.watt / self.strip["supply_v"]

    @property
    def lumen(self) -> float:
        """Light of one lamp."""
        return self.strips * self.length / 1e3 * self.strip["lumen_m"]

    def outlines(self) -> Floats:
        """Corners of all shining faces and the middles of their upright edges, mm, (l, 6, 3)."""
        y, z = np.array(self.sides) / 2
        around = [side * y * ACROSS + high * UP for side in (-1, 1) for high in (-z, 0.0, z)]
        return np.asarray(self.places[:, None] + np.array(around))
