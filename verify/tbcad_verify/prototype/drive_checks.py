"""The drive against what it must bear: masses of the meshes, gears of the solids, a motor's list.

Balance by the meshes' volumes and the balls' masses; nothing is taken from the record of the drive.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.record.prototype import RECORD
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    no_faults,
    require,
)
from tbcad_verify.step.solids_text import TextSolid, distance_to_line
from tbcad_verify.types import Floats

GRAVITY = 9.80665  # m/s^2, standard
FULL_STEPS, STEPS_PER_PERIOD = 200.0, 4.0  # in a turn, and in a period of a stepper's torque


# Holding torque, N mm.
MOTORS = {"NEMA17-40": 450.0, "NEMA17-48": 590.0, "NEMA17-60": 650.0, "STAGE-60": 300.0}
WORM, WORM_RATIO = "stage-60", 90.0  # the drive that the base cannot turn
EFFICIENCY = {"nema17-belt": 0.95, "nema17-direct": 1.0, WORM: 0.3}
HOLD_MARGIN, RATED_RISE_K, MAX_RISE_K = 1.4, 80.0, 40.0  # printed mounts bear less than a motor
MAX_WIND_UP_DEG = 1.0
RADIAL_N, RATED_LIFE_H, MIN_LIFE_H = 22.0, 30_000.0, 500.0  # of a motor's shaft and its bearings
# GT2 belts: pitch, height of a rim over the pitch circle, width where a name tells none; rating
# for each mm of width; least stiffness (10 kg stretch 6 mm of width by 1 %).
PITCH_MM, RIM_MM, NARROW_MM = 2.0, 1.5, 6.0
RATING_N_MM, STIFFNESS_N_MM = 111.0 / 25.4, 98.07 / 0.01 / 6.0
FULL_MESH, LOST_PER_TOOTH, SLACK_SHARE = 6, 0.2, 0.2
LENGTH_MM = 0.1  # by which a belt round its wheels may be off a whole number of teeth
AXIS_MM = 1e-6
# Zero pin: rod, its distance from the axis, thickness of the disc; permitted pressure on printed
# plastic, and shear of hardened steel.
PIN_MM, PIN_OUT_MM, DISC_MM = 4.0, 44.0, 5.0
PRESSURE_MPA, SHEAR_MPA = 20.0, 230.0
# Brakes: torque at the motor, N mm, and time until it is there, s; what it needs over gravity.
BRAKES = {"BRAKE-17-0.4": (400.0, 0.04)}
BRAKE_MARGIN = 1.5
# Energy that a clamped finger takes up: 140 N on 75 N/mm (ISO/TS 15066:2016, annex A, hand).
FALL_J = 140.0**2 / (2 * 75.0) * 1e-3
FALL_STEPS = 100_001  # of the travel: the energy is flat where it is largest
FILE = RECORD
CHECKS = {"drive": "faults", "motor bearing": "N", "power off": "faults", "fall energy": "J"}


@dataclass(frozen=True)
class Gear:
    """Turns of the motor for one of the base; pitch radii, centres and width of a belt, mm."""

    ratio: float
    wheel: float = 0.0
    pinion: float = 0.0
    distance: float = 0.0
    teeth: int = 0
    width: float = 0.0

    @property
    def lean(self) -> float:
        """Angle between the belt's sides and the line of the axes, rad."""
        return float(np.arcsin((self.wheel - self.pinion) / self.distance))


@dataclass(frozen=True)
class Balance:
    """Turning parts: mass, g, centre of gravity (3,), mm, and inertia about the axis, g mm^2."""

    mass: float
    centre: Floats
    inertia: float

    def torque(self, context: PrototypeContext, angle: Floats) -> Floats:
        """Torque of gravity about the axis at base angles (N,) in radians, N mm."""
        weight = np.array([0.0, 0.0, -self.mass * 1e-3 * GRAVITY])
        lever = context.base_rotation(angle).apply(self.centre)
        return np.asarray(np.cross(lever, weight) @ context.frame[0])


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    parts: list[MeasuredPart],
    solids: Mapping[str, TextSolid],
) -> list[Check]:
    """Torque, belt, heat and turn of the drive, life of the motor's bearing, and power loss."""
    drive, bearing, off, fall = names
    bought = {one.name: one.part for one in context.prototype.bought}
    name = bought.get("motor") or bought.get("rotary_stage") or "no motor"
    motor = require(MOTORS.get(name), f"{name} is no motor that is known")
    gear, balance = gear_of(context, solids), balance_of(context, parts)
    worst = _worst_torque(context, balance)
    peak = worst + balance.inertia * 1e-6 * np.radians(
        context.export.spec.prototype.motion.acceleration_deg_s2
    )
    radial, limit = _shaft_load(gear, peak), _shaft_limit(name)
    energy, speed = _fall(context, balance, BRAKES.get(bought.get("brake") or ""), gear.ratio)
    return [
        no_faults(drive, _faults(context, motor, gear, worst, peak)),
        at_most(bearing, radial, limit, f"the belt pulls with {radial:.0f} N"),
        no_faults(off, _pin_faults(context, balance)),
        at_most(fall, energy, FALL_J, f"at {speed:.0f} deg/s, {_held_by(bought)}"),
    ]


def balance_of(context: PrototypeContext, parts: list[MeasuredPart]) -> Balance:
    """Base, balls and caps, each as a mass in its centre."""
    density = context.export.spec.printer.density_g_cm3 / 1000
    pieces = [require(part.placed_mass, part.reason) for part in of_roles(parts, "base")]
    mass = np.append([piece.volume * density for piece in pieces], context.masses_g)
    centres = [np.asarray(piece.centroid) for piece in pieces]
    place = np.vstack([*centres, context.prototype.balls.columns("bx", 3).T])
    out = ((place @ context.frame[1:].T) ** 2).sum(axis=1)
    return Balance(float(mass.sum()), mass @ place / mass.sum(), float(mass @ out))


def gear_of(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Gear:
    """Wheels of the assembly, whose teeth are in their names.

    Unknown: wheels that are not known, or not as drawn.
    """
    drive = context.export.spec.prototype.base.drive
    if drive != "nema17-belt":
        return Gear(WORM_RATIO if drive == WORM else 1.0)
    bought = {one.name: one.part for one in context.prototype.bought}
    found = []
    for name in ("wheel", "pinion"):
        pulley = re.fullmatch(r"GT2-(\d+)(?:-(\d+))?", bought.get(name) or "")
        if not pulley or name not in solids:
            raise Unknown(f"there is no {name} of known teeth")
        teeth, rim = int(pulley[1]), next(face for face in solids[name].faces if not face.hollow)
        if abs(rim.radius - teeth * PITCH_MM / (2 * np.pi) - RIM_MM) > AXIS_MM:
            raise Unknown(f"the {name} of the assembly does not have {teeth} teeth")
        found.append((teeth, rim, float(pulley[2] or NARROW_MM)))
    (teeth, wheel, width), (few, pinion, other) = found
    if width != other:
        raise Unknown(f"wheels of {width:g} and {other:g} mm for one belt")
    distance = distance_to_line(pinion.point, wheel.point, wheel.axis)
    return Gear(teeth / few, wheel.radius - RIM_MM, pinion.radius - RIM_MM, distance, few, width)


def _worst_torque(context: PrototypeContext, balance: Balance) -> float:
    """Largest torque of gravity from the first stop to the last, N mm."""
    ends = np.radians(context.prototype.stops.angle)
    angle = np.linspace(ends.min(), ends.max(), FALL_STEPS)
    return float(np.abs(balance.torque(context, angle)).max())


def _faults(
    context: PrototypeContext, motor: float, gear: Gear, worst: float, peak: float
) -> Iterator[str]:
    """Overloads of motor and belt by torques, N mm: gravity's, with acceleration the peak's."""
    spec = context.export.spec.prototype
    efficiency, torque = EFFICIENCY[spec.base.drive], motor * gear.ratio
    if torque * efficiency < spec.motion.safety * peak:
        yield f"the drive holds {torque * efficiency:.0f} N mm of {spec.motion.safety * peak:.0f}"
    yield from _belt_faults(gear, peak)
    share = 0.0 if spec.base.drive == WORM else HOLD_MARGIN * worst / (torque * efficiency)
    rise = RATED_RISE_K * min(share, 1.0) ** 2
    if rise > MAX_RISE_K:
        yield f"the motor gets {rise:.0f} K warmer, its printed mount bears {MAX_RISE_K:.0f} K"
    held = torque * (1.0 if spec.base.drive == WORM else min(share, 1.0))
    sine = min(worst / held, 1.0) if held else 0.0
    turn = np.degrees(np.arcsin(sine)) * STEPS_PER_PERIOD / FULL_STEPS / gear.ratio
    turn += np.degrees(_stretch(gear, worst))
    if turn > MAX_WIND_UP_DEG:
        yield f"motor and belt yield by {turn:.2f} deg, at most {MAX_WIND_UP_DEG:g} are allowed"


def _belt_faults(gear: Gear, peak: float) -> Iterator[str]:
    if not gear.width:
        return
    round_it = 2 * gear.distance * np.cos(gear.lean)
    round_it += gear.wheel * (np.pi + 2 * gear.lean) + gear.pinion * (np.pi - 2 * gear.lean)
    if abs(round_it - PITCH_MM * round(round_it / PITCH_MM)) > LENGTH_MM:
        yield f"no belt has the {round_it:.1f} mm that its wheels want"
    mesh = int(gear.teeth * (np.pi - 2 * gear.lean) / (2 * np.pi))
    rating = RATING_N_MM * gear.width * (1 - LOST_PER_TOOTH * max(FULL_MESH - mesh, 0))
    if peak / gear.wheel > rating:
        yield f"the belt is pulled by {peak / gear.wheel:.1f} N and rated for {rating:.1f} N"


def _stretch(gear: Gear, worst: float) -> float:
    """Turn of the base by which the belt yields, rad."""
    if not gear.width:
        return 0.0
    span = gear.distance * np.cos(gear.lean)
    return float(worst * span / (2 * STIFFNESS_N_MM * gear.width) / gear.wheel**2)


def _shaft_load(gear: Gear, peak: float) -> float:
    """Force of both sides of the belt on the motor's shaft, N: law of cosines."""
    if not gear.width:
        return 0.0
    pull = peak / gear.wheel
    tight, slack = (SLACK_SHARE + 1) * pull, SLACK_SHARE * pull
    return float(np.sqrt(tight**2 + slack**2 + 2 * tight * slack * np.cos(2 * gear.lean)))


def _shaft_limit(motor: str) -> float:
    """Force with which a motor's bearings last long enough, N: ISO 281."""
    return float(RADIAL_N * np.cbrt(RATED_LIFE_H / MIN_LIFE_H)) if "NEMA" in motor else 0.0


def _pin_faults(context: PrototypeContext, balance: Balance) -> Iterator[str]:
    """Overload of the zero pin by the largest torque of gravity at any angle."""
    turn = np.linspace(0, 2 * np.pi, FALL_STEPS)
    force = np.abs(balance.torque(context, turn)).max() / PIN_OUT_MM
    shear, pressure = force / (np.pi / 4 * PIN_MM**2), force / (PIN_MM * DISC_MM)
    for name, load, limit in (("shear", shear, SHEAR_MPA), ("pressure", pressure, PRESSURE_MPA)):
        if not load <= limit:
            yield f"the zero pin's {name} is {load:.0f} MPa, it bears {limit:.0f}"


def _held_by(bought: Mapping[str, str | None]) -> str:
    """The part that holds the base without power, in words."""
    return f"with {bought['brake']}" if bought.get("brake") else "without a brake"


def _fall(
    context: PrototypeContext,
    balance: Balance,
    brake: tuple[float, float] | None = None,
    ratio: float = 1.0,
) -> tuple[float, float]:
    """Energy, J, and speed, deg/s, that the base gets when the motor lets go.

    Until its brake engages under the largest torque; without one that holds it, to an end.
    """
    home = context.prototype.home
    if context.export.spec.prototype.base.drive == WORM:
        return 0.0, 0.0
    angle = np.radians(np.linspace(home.switch, home.switch + home.travel, FALL_STEPS))
    height = context.base_rotation(angle).apply(balance.centre)[:, 2]  # mm
    energy = balance.mass * GRAVITY * 1e-6 * (height.max() - min(height[0], height[-1]))
    torque, inertia = np.abs(balance.torque(context, angle)).max(), balance.inertia * 1e-9
    if brake and brake[0] * ratio >= BRAKE_MARGIN * torque:
        energy = (torque * 1e-3 * brake[1]) ** 2 / (2 * inertia)
    return float(energy), float(np.degrees(np.sqrt(2 * energy / inertia)))
