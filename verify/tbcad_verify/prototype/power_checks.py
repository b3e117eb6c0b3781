"""The base without power: how it falls, worked out again, and what the zero pin bears."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.drive_loads import unlike
from tbcad_verify.report.checks import Check, CheckName, at_most, short_list

CHECKS = {"power off": "faults"}
GRAVITY = 9.80665  # m/s^2, standard
WORM = "stage-60"  # the drive that the base cannot turn
PIN_MM, PIN_OUT_MM, DISC_MM = 4.0, 44.0, 5.0  # rod, its distance from the axis, zero disc
# Permitted pressure on printed plastic, and shear of hardened steel, MPa.
PRESSURE_MPA, SHEAR_MPA = 20.0, 230.0
STEPS = 100_001  # of the travel: the energy is flat where it is largest
SHARE = 1e-3


def checks(names: list[CheckName], context: PrototypeContext) -> list[Check]:
    """Compare the record with gravity's energy along the travel, and the pin with its limits."""
    faults = [*_fall_faults(context), *_pin_faults(context)]
    return [at_most(names[0], len(faults), 0, short_list(faults))]


def _fall_faults(context: PrototypeContext) -> Iterator[str]:
    record, drive, home = (
        context.prototype.power_off,
        context.prototype.drive,
        context.prototype.home,
    )
    angle = np.radians(np.linspace(home.switch, home.switch + home.travel, STEPS))
    height = context.base_rotation(angle).apply(drive.centre)[:, 2]  # mm
    energy = drive.mass_g * GRAVITY * 1e-6 * (height.max() - min(height[0], height[-1]))
    energy = 0.0 if drive.drive == WORM else energy
    inertia = drive.inertia_g_mm2 * 1e-9  # kg m^2
    speed = np.degrees(np.sqrt(2 * energy / inertia)) if inertia else 0.0
    yield from unlike("fall_energy_j", record.fall_energy_j, float(energy), SHARE)
    yield from unlike("fall_speed_deg_s", record.fall_speed_deg_s, float(speed), SHARE)


def _pin_faults(context: PrototypeContext) -> Iterator[str]:
    record, drive = context.prototype.power_off, context.prototype.drive
    lean = float(np.hypot(*context.frame[1:, 2]))
    force = drive.moment_g_mm * GRAVITY * 1e-3 * lean / PIN_OUT_MM
    shear, pressure = force / (np.pi / 4 * PIN_MM**2), force / (PIN_MM * DISC_MM)
    yield from unlike("pin_force_n", record.pin_force_n, force, SHARE)
    yield from unlike("pin_shear_mpa", record.pin_shear_mpa, shear, SHARE)
    yield from unlike("pin_pressure_mpa", record.pin_pressure_mpa, pressure, SHARE)
    if shear > SHEAR_MPA or pressure > PRESSURE_MPA:
        yield "the zero pin does not hold the base"
