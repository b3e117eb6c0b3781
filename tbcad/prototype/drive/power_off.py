"""What happens when the motor lets go of the base, and what the zero pin then bears.

The base has no counterweight and a stepper without current holds next to nothing, so the base falls
to where its centre of gravity is lowest, or strikes what stands in its way at an end of its travel.
"""

import math

import numpy as np

from tbcad.prototype.base.hub import ZERO_DISC_MM
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.homing import PIN_MM, PIN_OUT_MM
from tbcad.records.prototype_drive import PowerOff

# Permitted of a printed hole round a pin, as below the heads of screws; of a rod of hardened steel
# in shear: 0.4 of a proof stress of 580 MPa (8.8), which such a rod exceeds.
PRESSURE_LIMIT_MPA, SHEAR_LIMIT_MPA = 20.0, 230.0
MJ_PER_J, KG_M2 = 1e3, 1e-9  # KG_M2: of a gram millimetre squared


def power_off(balance: BaseBalance, low: float, high: float, *, holds_itself: bool) -> PowerOff:
    """What a base does without power between the ends of its travel.

    Args:
        balance: of what turns.
        low: smallest base angle, radians.
        high: largest.
        holds_itself: whether the drive cannot be turned from the base's side.
    """
    energy = 0.0 if holds_itself else _fall(balance, low, high) / MJ_PER_J
    inertia = balance.inertia * KG_M2
    speed = math.degrees(math.sqrt(2 * energy / inertia)) if inertia else 0.0
    force = balance.torque_amplitude / PIN_OUT_MM
    return PowerOff(
        fall_energy_j=energy,
        fall_speed_deg_s=speed,
        pin_force_n=force,
        pin_shear_mpa=force / (math.pi / 4 * PIN_MM**2),
        pin_shear_limit_mpa=SHEAR_LIMIT_MPA,
        pin_pressure_mpa=force / (PIN_MM * ZERO_DISC_MM),
        pin_pressure_limit_mpa=PRESSURE_LIMIT_MPA,
    )


def _fall(balance: BaseBalance, low: float, high: float) -> float:
    """Largest energy of gravity on the way to an end of the travel, N mm."""
    ends: list[float] = balance.energy(np.array([low, high])).tolist()
    top = balance.angle_of_top
    top += 2 * math.pi * math.ceil((low - top) / (2 * math.pi))
    highest = balance.torque_amplitude if top <= high else max(ends)
    return highest - min(ends)
