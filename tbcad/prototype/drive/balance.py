"""The balance of the base, and the base angles that the program drives to.

Gravity is along -z of the shell's frame. The base turns about the axis w, which is inclined: the
torque is zero with the centre of gravity straight above or below the axis, and largest with it
beside the axis. The base has no counterweight; what holds it without power is in `power_off`.

Homing turns the base downward until its tab presses the switch, then up again by the pull-off. The
controller then knows the angle, and keeps the base between soft limits. Base angles are positive
by the right-hand rule about the axis from the origin to the camera.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.balls.selection import Balls
from tbcad.types import Floats

GRAVITY = 9.80665  # m/s^2, standard
ROUNDING = 1e-9  # of first moments, as a share of the sum of their magnitudes


@dataclass(frozen=True)
class PointMasses:
    """Masses on the base, n of them."""

    mass_g: Floats  # grams, (n,)
    centre: Floats  # centres of gravity in the frame of the shell at base angle zero, mm, (n, 3)

    def __len__(self) -> int:
        return len(self.mass_g)


@dataclass(frozen=True)
class BaseBalance:
    """Sums over all masses on the base."""

    frame: Floats  # rows: axis w, azimuth zero, third, in the frame of the shell, (3, 3)
    mass_g: float  # grams
    first_moment: Floats  # along the rows of the frame at base angle zero, g mm, (3,)
    inertia: float  # moment of inertia of the point masses about the axis, g mm^2

    @property
    def centre(self) -> Floats:
        """Centre of gravity at base angle zero, mm, in the frame of the shell, (3,)."""
        return np.asarray(self.first_moment @ self.frame / self.mass_g)

    @property
    def moment(self) -> float:
        """Mass times distance of the centre of gravity from the axis, g mm."""
        return float(np.hypot(self.first_moment[1], self.first_moment[2]))

    @property
    def azimuth(self) -> float:
        """Azimuth of the centre of gravity at base angle zero, radians."""
        return float(np.arctan2(self.first_moment[2], self.first_moment[1]))

    @property
    def torque_amplitude(self) -> float:
        """Torque with the centre of gravity beside the axis, the largest at any angle, N mm."""
        sine_of_lean = float(np.hypot(*self.frame[1:, 2]))
        return self.moment * GRAVITY * 1e-3 * sine_of_lean

    @property
    def _up(self) -> float:
        """Azimuth straight above the axis, radians."""
        return float(np.arctan2(self.frame[2, 2], self.frame[1, 2]))

    def torque(self, angle: Floats) -> Floats:
        """Torque of gravity about w with the base at angles (n,), N mm, (n,).

        w . (r x F) with F = -m g z: m g (r2 z1 - r1 z2), r and z along the second and third row.
        """
        return np.asarray(self.torque_amplitude * np.sin(self.azimuth + angle - self._up))

    @property
    def angle_of_top(self) -> float:
        """Base angle with the centre of gravity straight above the axis, radians."""
        return self._up - self.azimuth

    def energy(self, angle: Floats) -> Floats:
        """Energy of gravity with the base at angles (n,), N mm, (n,); zero beside the axis."""
        return np.asarray(self.torque_amplitude * np.cos(angle - self.angle_of_top))

    def max_torque(self, low: float, high: float) -> float:
        """Largest magnitude of the torque between two base angles (radians), N mm."""
        # The torque has an extreme at this base angle and at each half turn from it.
        extreme = self._up - self.azimuth + np.pi / 2
        half_turns = np.ceil((low - extreme) / np.pi)
        if extreme + half_turns * np.pi <= high:
            return self.torque_amplitude
        return float(np.abs(self.torque(np.array([low, high]))).max())


def sum_masses(frame: Floats, *loads: PointMasses) -> BaseBalance:
    """Sum up the masses on a base whose axis is the first row of a frame (3, 3)."""
    mass = np.concatenate([load.mass_g for load in loads])
    place = np.concatenate([load.centre for load in loads]) @ frame.T
    first_moment = mass @ place
    # The centre of gravity of a balanced base has no azimuth: rounding must not give it one.
    rounding = ROUNDING * (mass @ np.abs(place[:, 1:]))
    first_moment[1:][np.abs(first_moment[1:]) < rounding] = 0.0
    inertia = float(mass @ (place[:, 1] ** 2 + place[:, 2] ** 2))
    return BaseBalance(frame, float(mass.sum()), first_moment, inertia)


def ball_masses(prototype: PrototypeLayout) -> PointMasses:
    """All balls and caps in their places.

    The mass of a cap counts at the centre of its body's sphere, which is at most a few millimetres
    from its centre of gravity.
    """
    volume = cap_volume(prototype.balls)
    mass = prototype.balls.mass_g + volume * prototype.spec.cap_density_g_cm3 * 1e-3
    return PointMasses(mass, prototype.body_centres())


def cap_volume(balls: Balls) -> Floats:
    """Volume of each cap, mm^3, (k,); zero for bought balls.

    A ball of the body's radius with its front segment replaced by one of the reflecting sphere;
    both segments end at the edge where the two spheres meet.
    """
    body, radius = balls.body_radius, balls.radius
    edge = np.minimum(np.where(body < radius, body / np.sqrt(2), body), radius)
    removed = body - np.sqrt(body**2 - edge**2)
    added = radius - np.sqrt(radius**2 - edge**2)
    ball = 4 / 3 * np.pi * body**3
    cap = ball - _segment_volume(body, removed) + _segment_volume(radius, added)
    return np.where(balls.cap, cap, 0.0)


def _segment_volume(radius: Floats, height: Floats) -> Floats:
    """Volume of a sphere's segment (spherical cap), mm^3."""
    return np.asarray(np.pi * height**2 * (3 * radius - height) / 3)


# Of the switch below the lowest angle of the program, so that its lever is free there.
SWITCH_BELOW_DEG = 8.0
MIN_BELOW_DEG = 3.0
PULL_OFF_DEG = 2.0
OVERTRAVEL_DEG = 2.0  # below the switch, before the base stops
ANGLE_STEP_DEG = 0.1  # that the switch's angle is rounded up to
ABOVE_DEG = 1.0  # of the upper soft limit above the highest angle


@dataclass(frozen=True)
class StopSequence:
    """The stops of the base in one run; there are two runs, one for each turn of the object."""

    start: float  # base angle below all stops, degrees
    angle: Floats  # of the stops, degrees, ascending, (s,)
    mirrors: NDArray[np.int64]  # shown at each stop, (s,)


@dataclass(frozen=True)
class HomeAngles:
    """Base angles of homing, degrees."""

    switch: float  # at which the switch trips
    homed: float  # after the pull-off, without the trim
    travel: float  # from the switch to the upper soft limit and the pull-off beyond it


def stop_sequence(prototype: PrototypeLayout, motion: MotionSpec) -> StopSequence:
    """The stops, and a start below them so that play in the drive is taken up before the first.

    SpecError when the base cannot be where the program starts, for post or camera.
    """
    low, high = free_base_angles(prototype)
    home = math.radians(motion.home_deg)
    if not low <= home <= high:
        raise SpecError(
            f"prototype.motion.home_deg is {motion.home_deg:g}, but the base is free from "
            f"{math.degrees(low):.1f} to {math.degrees(high):.1f} degrees: choose one of these"
        )
    angle = np.degrees(prototype.stops.angle)
    start = max(float(angle[0]) - motion.approach_deg, min(math.degrees(low), float(angle[0])))
    return StopSequence(start, angle, np.bincount(prototype.stops.stop, minlength=len(angle)))


def free_base_angles(prototype: PrototypeLayout) -> tuple[float, float]:
    """Base angles between which no ball meets post or camera, within the largest swing, radians."""
    problem, azimuth = prototype.problem, prototype.placement.azimuth
    low = max(float((problem.min_azimuth - azimuth).max()), -problem.max_swing / 2)
    return low, min(float((problem.max_azimuth - azimuth).min()), problem.max_swing / 2)


def home_angles(prototype: PrototypeLayout, motion: MotionSpec) -> HomeAngles:
    """Where the switch trips: below all that the program drives to, where the base is still free.

    SpecError when there is no room for it below the first stop.
    """
    sequence = stop_sequence(prototype, motion)
    lowest = min(sequence.start, motion.home_deg)
    highest = max(float(sequence.angle[-1]), motion.home_deg)
    free = math.degrees(free_base_angles(prototype)[0])
    wanted = max(lowest - SWITCH_BELOW_DEG, free + OVERTRAVEL_DEG)
    switch = math.ceil(wanted / ANGLE_STEP_DEG) * ANGLE_STEP_DEG
    if motion.homes and switch > lowest - MIN_BELOW_DEG:
        raise SpecError(
            f"the base is free from {free:.1f} degrees on, which leaves no room for a switch below "
            f"its first angle {lowest:.1f}: make prototype.max_swing_deg larger, "
            "prototype.motion.approach_deg smaller, or set prototype.motion.controller to grbl"
        )
    return HomeAngles(switch, switch + PULL_OFF_DEG, highest + ABOVE_DEG - switch + PULL_OFF_DEG)


def travel_ends(prototype: PrototypeLayout, motion: MotionSpec) -> tuple[float, float]:
    """Base angles of both ends of the travel, radians; SpecError as of `home_angles`."""
    angles = home_angles(prototype, motion)
    return math.radians(angles.switch), math.radians(angles.switch + angles.travel)
