"""How far a calibrated machine's balls are from the drawing, and colours for it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.geometry.vectors import norm
from tbcad.machine.machine import Machine
from tbcad.simulate.prototype.plan import Plan
from tbcad.types import Floats

UM_PER_MM = 1000.0
LEAST_BALLS = 3  # whose places tell a motion of the whole base from errors of balls
STEPS = (1.0, 2.0, 5.0)  # of the scale's ends, times powers of ten
# From none to the largest deviation: blue, green, yellow, red; red, green, blue from 0 to 1.
COLOURS = np.array([[0.16, 0.38, 0.75], [0.20, 0.66, 0.36], [0.98, 0.83, 0.20], [0.83, 0.15, 0.16]])


@dataclass(frozen=True)
class Deviations:
    """Deviations of k balls from the designed base, moved as a whole to fit best.

    Attributes:
        offset: of the centres, in the frame of the design, mm, (k, 3).
        radius: measured less designed, mm, (k,).
        shift: of the whole base, mm, (3,).
        turn: rotation vector of the whole base about the origin, radians, (3,).
    """

    offset: Floats
    radius: Floats
    shift: Floats
    turn: Floats

    @property
    def distance_um(self) -> Floats:
        """Of the centres from where the base should have them, micrometres, (k,)."""
        return UM_PER_MM * norm(self.offset)

    @property
    def scale_um(self) -> float:
        """End of a scale from 0 that holds all distances, micrometres."""
        return round_up(float(self.distance_um.max()))


def deviations(machine: Machine, plan: Plan) -> Deviations:
    """Compare a calibrated machine with its plan, which has as many balls."""
    designed, found = plan.centre, machine.centre
    turn, shift = Rotation.identity(), np.zeros(3)
    if len(designed) >= LEAST_BALLS:
        middles = designed.mean(axis=0), found.mean(axis=0)
        turn, _ = Rotation.align_vectors(found - middles[1], designed - middles[0])
        shift = middles[1] - turn.apply(middles[0])
    offset = found - turn.apply(designed) - shift
    return Deviations(offset, machine.radius - plan.radius, shift, turn.as_rotvec())


def round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, 20 ... from a value on; 1 for less."""
    power = 10.0 ** int(np.floor(np.log10(max(value, 1.0))))
    return next(step * power for step in (*STEPS, 10.0) if step * power >= value)


def colours(share: Floats) -> Floats:
    """Colours (n, 3), 0 to 1, of shares (n,) of the scale."""
    places = np.linspace(0, 1, len(COLOURS))
    return np.stack([np.interp(share, places, column) for column in COLOURS.T], axis=-1)
