"""What the drive must bear and does, worked out again: masses from meshes, gears from solids."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype import drive_loads
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.drive_loads import FULL_STEPS, PITCH_MM, SHARE, TINY, Gear, unlike
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, require, short_list
from tbcad_verify.step.solids_text import TextSolid, distance_to_line
from tbcad_verify.types import Floats

GRAVITY = 9.80665  # m/s^2, standard
MOTORS_NMM = {"NEMA17-40": 450.0, "NEMA17-48": 590.0, "NEMA17-60": 650.0, "STAGE-60": 300.0}
NARROW_MM = 6.0  # of wheels whose names give no width
STAGE_RATIO = 90.0
EFFICIENCY = {"nema17-belt": 0.95, "nema17-direct": 1.0, "stage-60": 0.3}
RIM_MM = 1.5  # of a wheel over its pitch circle
MASS_SHARE = 2e-3  # by which meshes and STEP files may differ in mass
INERTIA_SHARE = 2e-2
CENTRE_MM = 0.1
AXIS_MM = 1e-6
CHECKS = {"drive": "faults", "motor bearing": "N"}
WIND_UP_DEG = 1e-6


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    parts: list[MeasuredPart],
    solids: Mapping[str, TextSolid],
) -> list[Check]:
    """Compare the drive's record with masses, gears and motion."""
    faults = [*_balance(context, parts), *_torques(context), *_gears(context, solids)]
    radial, limit = _shaft(context, solids), drive_loads.shaft_limit(context.prototype.drive)
    recorded = context.prototype.drive.motor_radial_n
    faults += unlike("motor_radial_n", recorded, radial, drive_loads.FIGURE_SHARE)
    lasts = f"the belt pulls with {radial:.0f} N, {limit:.0f} N are allowed"
    return [
        at_most(names[0], len(faults), 0, short_list(faults)),
        at_most(names[1], radial, limit, lasts),
    ]


def _shaft(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> float:
    """Force on the motor's shaft, N."""
    bought = {one.name: one.part for one in context.prototype.bought}
    return drive_loads.shaft_load(context.prototype.drive, _gear(context, solids, bought))


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
    yield from unlike("moment_g_mm", drive.moment_g_mm, moment)
    azimuth_error = np.radians(drive.azimuth_deg) - np.arctan2(third, zero)
    if moment * abs(np.sin(azimuth_error / 2)) > SHARE * moment:
        yield "azimuth_deg"


def _masses(context: PrototypeContext, parts: list[MeasuredPart]) -> tuple[Floats, Floats]:
    """(n,) grams and (n, 3) mm of everything on the base."""
    density = context.export.spec.printer.density_g_cm3 / 1000
    balls = context.prototype.balls
    pieces = [require(part.placed_mass, part.reason) for part in of_roles(parts, "base")]
    volumes = [piece.volume * density for piece in pieces]
    centres = [np.asarray(piece.centroid) for piece in pieces]
    return np.append(volumes, context.masses_g), np.vstack([*centres, balls.columns("bx", 3).T])


def _torques(context: PrototypeContext) -> Iterator[str]:
    """Gravity over the stops, with acceleration and safety, against the motor."""
    drive, motion = context.prototype.drive, context.export.spec.prototype.motion
    torque = _worst_torque(context)
    acceleration = np.radians(motion.acceleration_deg_s2)
    peak = torque + drive.inertia_g_mm2 * acceleration * 1e-6
    required = motion.safety * peak
    yield from unlike("worst_torque_nmm", drive.worst_torque_nmm, torque)
    yield from unlike("peak_torque_nmm", drive.peak_torque_nmm, peak)
    yield from unlike("required_torque_nmm", drive.required_torque_nmm, required)
    if drive.holding_torque_nmm < drive.required_torque_nmm:
        yield "the drive does not hold the base"


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
    """Motor, ratio, steps, and what belt and motor bear."""
    drive, spec = context.prototype.drive, context.export.spec.prototype
    bought = {one.name: one.part for one in context.prototype.bought}
    motor = bought.get("motor") or bought.get("rotary_stage")
    if drive.drive != spec.base.drive:
        yield f"drive is {drive.drive}, the spec has {spec.base.drive}"
    if drive.motor != motor or motor not in MOTORS_NMM:
        yield f"motor is {drive.motor}, {motor} is bought"
        return
    gear = _gear(context, solids, bought)
    yield from unlike("ratio", drive.ratio, gear.ratio)
    yield from unlike("belt_centre_mm", drive.belt_centre_mm, gear.distance)
    steps = FULL_STEPS * spec.motion.microsteps * gear.ratio / 360
    yield from unlike("steps_per_deg", drive.steps_per_deg, steps)
    motor_torque = MOTORS_NMM[motor] * gear.ratio
    holds = motor_torque * EFFICIENCY[spec.base.drive]
    yield from unlike("holding_torque_nmm", drive.holding_torque_nmm, holds)
    yield from drive_loads.belt_faults(drive, gear)
    yield from drive_loads.motor_faults(
        drive, motor_torque, EFFICIENCY[spec.base.drive], gear.ratio
    )
    yield from _stops(context, gear.ratio)


def _stops(context: PrototypeContext, ratio: float) -> Iterator[str]:
    """Gravity's torque at each stop, and how far it turns the base beyond its place at zero."""
    drive, stops = context.prototype.drive, context.prototype.stops
    angle = np.append(np.radians(stops.angle), 0.0)
    weight = np.array([0.0, 0.0, -drive.mass_g * 1e-3 * GRAVITY])
    centre = context.base_rotation(angle).apply(drive.centre)
    torque = np.cross(centre, weight) @ context.frame[0]
    turned = drive_loads.wind_ups(drive, torque, ratio)
    for name, recorded, mine, limit in (
        ("torque_nmm", stops.torque, torque[:-1], SHARE * np.abs(torque).max()),
        ("wind_up_deg", stops.wind_up, turned[:-1] - turned[-1], WIND_UP_DEG),
    ):
        off = np.flatnonzero(np.abs(recorded - mine) > limit + TINY)
        yield from (f"stop {k + 1}: {name} is not {mine[k]:g}" for k in off.tolist())


def _gear(
    context: PrototypeContext, solids: Mapping[str, TextSolid], bought: Mapping[str, str | None]
) -> Gear:
    """Wheels of the assembly, whose sizes are in their names.

    Raises:
        Unknown: wheels that are not known, or not as drawn.
    """
    drive = context.export.spec.prototype.base.drive
    if drive != "nema17-belt":
        return Gear(STAGE_RATIO if drive == "stage-60" else 1.0)
    teeth, rims, widths = {}, {}, {}
    for name in ("wheel", "pinion"):
        pulley = re.fullmatch(r"GT2-(\d+)(?:-(\d+))?", bought.get(name) or "")
        solid = solids.get(name)
        if not pulley or solid is None:
            raise Unknown(f"there is no {name} of known teeth")
        teeth[name], widths[name] = int(pulley[1]), float(pulley[2] or NARROW_MM)
        rims[name] = next(face for face in solid.faces if not face.hollow)
        expected = teeth[name] * PITCH_MM / (2 * np.pi) + RIM_MM
        if abs(rims[name].radius - expected) > AXIS_MM:
            raise Unknown(f"the {name} of the assembly has not {teeth[name]} teeth")
    wheel, pinion = rims["wheel"], rims["pinion"]
    distance = distance_to_line(pinion.point, wheel.point, wheel.axis)
    width = widths["wheel"]
    if width != widths["pinion"]:
        raise Unknown(f"wheels of {width:g} and {widths['pinion']:g} mm for one belt")
    radii = wheel.radius - RIM_MM, pinion.radius - RIM_MM
    return Gear(teeth["wheel"] / teeth["pinion"], *radii, distance, teeth["pinion"], width)
