"""What the drive must bear and does, worked out again: masses from meshes, gears from solids."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.prototype.purchases import cap_volume
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, require, short_list
from tbcad_verify.step.solids_text import TextSolid, distance_to_line
from tbcad_verify.types import Floats

GRAVITY = 9.80665  # m/s^2, standard
MOTORS_NMM = {"NEMA17-40": 450.0, "NEMA17-48": 590.0, "NEMA17-60": 650.0, "STAGE-60": 300.0}
STAGE_RATIO = 90.0
EFFICIENCY = {"nema17-belt": 0.95, "nema17-direct": 1.0, "stage-60": 0.3}
FULL_STEPS = 200.0
STEPS_PER_PERIOD = 4.0  # full steps in a period of a stepper's torque
PITCH_MM, RIM_MM = 2.0, 1.5  # of GT2; of a wheel's rim over the pitch circle
MASS_SHARE = 2e-3  # by which meshes and STEP files may differ in mass
INERTIA_SHARE = 2e-2
CENTRE_MM = 0.1
SHARE = 1e-6  # of figures that follow from others
AXIS_MM = 1e-6
TINY_NMM = 1e-9
CHECKS = {"drive": "faults"}


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    parts: list[MeasuredPart],
    solids: Mapping[str, TextSolid],
) -> list[Check]:
    """Compare the drive's record with masses, gears and motion."""
    faults = [*_balance(context, parts), *_torques(context), *_gears(context, solids)]
    return [at_most(names[0], len(faults), 0, short_list(faults))]


def _balance(context: PrototypeContext, parts: list[MeasuredPart]) -> Iterator[str]:
    """Mass, centre of gravity and inertia of base, balls and caps."""
    drive, axes = context.prototype.drive, context.frame
    mass, place = _masses(context, parts)
    if abs(drive.mass_g - mass.sum()) > MASS_SHARE * mass.sum():
        yield f"mass_g is not {mass.sum():.1f}"
    centre = mass @ place / mass.sum()
    if np.abs(drive.centre - centre).max() > CENTRE_MM:
        yield "centre_mm is elsewhere"
    across = place @ axes[1:].T
    inertia = float((mass * (across**2).sum(axis=1)).sum())
    if abs(drive.inertia_g_mm2 - inertia) > INERTIA_SHARE * inertia:
        yield f"inertia_g_mm2 is not {inertia:.4g}"
    zero, third = (drive.mass_g * drive.centre @ axis for axis in axes[1:])
    moment = float(np.hypot(zero, third))
    yield from _unlike("moment_g_mm", drive.moment_g_mm, moment)
    azimuth_error = np.radians(drive.azimuth_deg) - np.arctan2(third, zero)
    if moment * abs(np.sin(azimuth_error / 2)) > SHARE * moment:
        yield "azimuth_deg"


def _masses(context: PrototypeContext, parts: list[MeasuredPart]) -> tuple[Floats, Floats]:
    """(n,) grams and (n, 3) mm of everything on the base."""
    density = context.export.spec.printer.density_g_cm3 / 1000
    balls = context.prototype.balls
    pieces = [require(part.placed_mass, part.reason) for part in of_roles(parts, "base")]
    caps = cap_volume(context) * density
    mass = np.where(balls.cap, caps, balls.mass_g)
    volumes = [piece.volume * density for piece in pieces]
    centres = [np.asarray(piece.centroid) for piece in pieces]
    return np.append(volumes, mass), np.vstack([*centres, balls.columns("bx", 3).T])


def _torques(context: PrototypeContext) -> Iterator[str]:
    """Gravity over the stops, with acceleration and safety, against the motor."""
    drive, motion = context.prototype.drive, context.export.spec.prototype.motion
    torque = _worst_torque(context)
    acceleration = np.radians(motion.acceleration_deg_s2)
    required = motion.safety * (torque + drive.inertia_g_mm2 * acceleration * 1e-6)
    yield from _unlike("worst_torque_nmm", drive.worst_torque_nmm, torque)
    yield from _unlike("safety", drive.safety, motion.safety)
    yield from _unlike("required_torque_nmm", drive.required_torque_nmm, required)
    if drive.holding_torque_nmm < drive.required_torque_nmm:
        yield "the drive does not hold the base"
    lever = drive.counterweight_radius_mm
    yield from _unlike("counterweight_g", drive.counterweight_g * lever, drive.moment_g_mm)
    if not lever > 0:
        yield "counterweight_radius_mm"


def _worst_torque(context: PrototypeContext) -> float:
    """Largest torque of gravity about the axis at the stops and between them, N mm."""
    drive, angle = context.prototype.drive, np.radians(context.prototype.stops.angle)
    up = context.frame[:, 2]
    largest = drive.moment_g_mm * GRAVITY * 1e-3 * float(np.hypot(up[1], up[2]))
    phase = np.radians(drive.azimuth_deg) - np.arctan2(up[2], up[1])
    low, high = (phase + end for end in (angle.min(), angle.max()))
    if np.floor(high / np.pi - 0.5) > np.floor(low / np.pi - 0.5):
        return largest  # a quarter turn from the vertical is between both ends
    return float(largest * np.abs(np.sin([low, high])).max())


def _gears(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    """Motor, ratio, steps, belt and stiffness."""
    drive, spec = context.prototype.drive, context.export.spec.prototype
    bought = {one.name: one.part for one in context.prototype.bought}
    motor = bought.get("motor") or bought.get("rotary_stage")
    if drive.drive != spec.base.drive:
        yield f"drive is {drive.drive}, the spec has {spec.base.drive}"
    if drive.motor != motor or motor not in MOTORS_NMM:
        yield f"motor is {drive.motor}, {motor} is bought"
        return
    ratio, radius, distance = _ratio(context, solids, bought)
    yield from _unlike("ratio", drive.ratio, ratio)
    yield from _unlike("belt_centre_mm", drive.belt_centre_mm, distance)
    pull = drive.worst_torque_nmm / radius if radius else 0.0
    yield from _unlike("belt_pull_n", drive.belt_pull_n, pull)
    steps = FULL_STEPS * spec.motion.microsteps * ratio / 360
    yield from _unlike("steps_per_deg", drive.steps_per_deg, steps)
    motor_torque = MOTORS_NMM[motor] * ratio
    holds = motor_torque * EFFICIENCY[spec.base.drive]
    yield from _unlike("holding_torque_nmm", drive.holding_torque_nmm, holds)
    share = min(drive.worst_torque_nmm / motor_torque, 1.0)
    angle = np.degrees(np.arcsin(share)) * STEPS_PER_PERIOD / FULL_STEPS / ratio
    yield from _unlike("wind_up_deg", drive.wind_up_deg, float(angle))


def _ratio(
    context: PrototypeContext, solids: Mapping[str, TextSolid], bought: Mapping[str, str | None]
) -> tuple[float, float, float]:
    """Turns of the motor for one of the base; pitch radius of the wheel and distance of the pinion.

    The number of teeth is taken from the wheel's name, and must be that of its body.
    """
    drive = context.export.spec.prototype.base.drive
    if drive != "nema17-belt":
        return (STAGE_RATIO if drive == "stage-60" else 1.0), 0.0, 0.0
    teeth, rims = {}, {}
    for name in ("wheel", "pinion"):
        pulley = re.fullmatch(r"GT2-(\d+)", bought.get(name) or "")
        solid = solids.get(name)
        if not pulley or solid is None:
            raise Unknown(f"there is no {name} of known teeth")
        teeth[name] = int(pulley[1])
        rims[name] = next(face for face in solid.faces if not face.hollow)
        expected = teeth[name] * PITCH_MM / (2 * np.pi) + RIM_MM
        if abs(rims[name].radius - expected) > AXIS_MM:
            raise Unknown(f"the {name} of the assembly has not {teeth[name]} teeth")
    wheel, pinion = rims["wheel"], rims["pinion"]
    distance = distance_to_line(pinion.point, wheel.point, wheel.axis)
    return teeth["wheel"] / teeth["pinion"], wheel.radius - RIM_MM, distance


def _unlike(name: str, recorded: float, expected: float) -> Iterator[str]:
    if not abs(recorded - expected) <= SHARE * abs(expected) + TINY_NMM:
        yield f"{name} is {recorded:g}, not {expected:g}"
