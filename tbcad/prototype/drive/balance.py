"""The balance of the base: mass, centre of gravity, and the torque of gravity about its axis.

Gravity is along -z of the shell's frame. The base turns about the axis w, which leans, so its
weight has no torque when its centre stands straight above the axis or below it, and most when it
stands beside it.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.balls.selection import Balls
from tbcad.types import Floats

GRAVITY = 9.80665  # m/s^2, standard
NEGLIGIBLE = 1e-9  # of a mass's moment: rounding


@dataclass(frozen=True)
class PointMasses:
    """Masses on the base, over n of them.

    Attributes:
        mass_g: grams, (n,).
        centre: of gravity of each, in the frame of the shell at base angle zero, mm, (n, 3).
    """

    mass_g: Floats
    centre: Floats

    def __len__(self) -> int:
        """Number of masses."""
        return len(self.mass_g)


@dataclass(frozen=True)
class Counterweight:
    """A mass that balances a base.

    Attributes:
        mass_g: grams.
        radius: from the axis, mm.
        azimuth: on the base, radians; the base's is that plus pi.
    """

    mass_g: float
    radius: float
    azimuth: float


@dataclass(frozen=True)
class BaseBalance:
    """Sums over all masses on the base.

    Attributes:
        frame: rows: axis w, azimuth zero, third, in the frame of the shell, (3, 3).
        mass_g: grams.
        first: first moments along the rows of the frame at base angle zero, g mm, (3,).
        inertia: moment of inertia about the axis, of point masses, g mm^2.
    """

    frame: Floats
    mass_g: float
    first: Floats
    inertia: float

    @property
    def centre(self) -> Floats:
        """Centre of gravity at base angle zero, mm, in the frame of the shell, (3,)."""
        result: Floats = self.first @ self.frame / self.mass_g
        return result

    @property
    def moment(self) -> float:
        """Mass times distance of the centre of gravity from the axis, g mm."""
        return float(np.hypot(self.first[1], self.first[2]))

    @property
    def azimuth(self) -> float:
        """Azimuth of the centre of gravity at base angle zero, radians."""
        return float(np.arctan2(self.first[2], self.first[1]))

    @property
    def greatest(self) -> float:
        """Torque with the centre of gravity just beside the axis, N mm."""
        return self.moment * GRAVITY * 1e-3 * float(np.hypot(*self.frame[1:, 2]))

    def torque(self, angle: Floats) -> Floats:
        """Torque of gravity about w with the base at angles (n,), N mm, (n,).

        w . (r x F) with F = -m g z: m g (r2 z1 - r1 z2), r and z along the second and third row.
        """
        up = np.arctan2(self.frame[2, 2], self.frame[1, 2])
        result: Floats = self.greatest * np.sin(self.azimuth + angle - up)
        return result

    def worst(self, low: float, high: float) -> float:
        """Greatest torque, to either side, between two base angles (radians), N mm."""
        up = float(np.arctan2(self.frame[2, 2], self.frame[1, 2]))
        # Beside the axis at these angles, half a turn apart.
        side = up - self.azimuth + np.pi / 2
        first = np.ceil((low - side) / np.pi)
        if side + first * np.pi <= high:
            return self.greatest
        return float(np.abs(self.torque(np.array([low, high]))).max())

    def tilting(self, along: float) -> float:
        """Greatest moment across the axis at a place of it (mm from the origin), N mm.

        What bearings or a stage must bear beside the torque, whatever the angle.
        """
        lever = self.first[0] - self.mass_g * along
        lean = np.hypot(*self.frame[1:, 2])
        return GRAVITY * 1e-3 * float(abs(lever) * lean + self.moment * abs(self.frame[0, 2]))

    def needed(self, low: float, high: float, acceleration: float, safety: float) -> float:
        """Holding torque wanted on the base, N mm.

        Args:
            low: least base angle, radians.
            high: largest one.
            acceleration: of the base, radians/s^2.
            safety: factor on gravity and acceleration together, which stands for friction too.
        """
        return safety * (self.worst(low, high) + self.inertia * acceleration * 1e-6)

    def counterweight(self, radius: float) -> Counterweight:
        """The mass at a distance from the axis (mm) that takes all torque away."""
        return Counterweight(self.moment / radius, radius, self.azimuth + np.pi)


def sum_masses(frame: Floats, *loads: PointMasses) -> BaseBalance:
    """Sum up the masses on a base whose axis is the first row of a frame (3, 3)."""
    mass = np.concatenate([load.mass_g for load in loads])
    place = np.concatenate([load.centre for load in loads]) @ frame.T
    first = mass @ place
    # A balanced base has no direction: without this, rounding would give it one.
    first[1:][np.abs(first[1:]) < NEGLIGIBLE * (mass @ np.abs(place[:, 1:]))] = 0.0
    inertia = float(mass @ (place[:, 1] ** 2 + place[:, 2] ** 2))
    return BaseBalance(frame, float(mass.sum()), first, inertia)


def ball_masses(made: PrototypeLayout, cap_density: float) -> PointMasses:
    """All balls in their places, and the caps.

    Args:
        made: the prototype.
        cap_density: of the caps' material, g/cm^3.

    A cap weighs as a body about the middle of its body's sphere, which is at most a few
    millimetres off.
    """
    volume = cap_volume(made.balls)
    return PointMasses(made.balls.mass_g + volume * cap_density * 1e-3, made.body_centres())


def counterweight_masses(weight: Counterweight, along: float, frame: Floats) -> PointMasses:
    """A counterweight at a place along the axis (mm from the origin)."""
    cosine, sine = np.cos(weight.azimuth), np.sin(weight.azimuth)
    place = np.array([[along, weight.radius * cosine, weight.radius * sine]])
    return PointMasses(np.array([weight.mass_g]), place @ frame)


def cap_volume(balls: Balls) -> Floats:
    """Volume of each cap, mm^3, (k,); zero for bought balls.

    A ball of the body's radius, its front beyond the edge of the cap's sphere taken off and the
    segment of that sphere put there.
    """
    body, radius = balls.body_radius, balls.radius
    edge = np.minimum(np.where(body < radius, body / np.sqrt(2), body), radius)
    off = body - np.sqrt(body**2 - edge**2)
    put = radius - np.sqrt(radius**2 - edge**2)
    whole = 4 / 3 * np.pi * body**3
    return np.where(balls.cap, whole - _segment(body, off) + _segment(radius, put), 0.0)


def _segment(radius: Floats, height: Floats) -> Floats:
    result: Floats = np.pi * height**2 * (3 * radius - height) / 3
    return result
