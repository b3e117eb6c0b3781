"""The section `drive` of prototype.json: the balance of the base, and what its drive bears."""

import numpy as np

from tbcad.formats.csv_table import Cell
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.drive.loads import (
    HOLD_MARGIN,
    MAX_RISE_K,
    MAX_WIND_UP_DEG,
    DriveLoads,
    base_torques,
)
from tbcad.spec.prototype import MotionSpec


def drive_record(
    balance: BaseBalance, drive: Drive, motion: MotionSpec, swing: tuple[float, float]
) -> dict[str, Cell | list[float]]:
    """What the drive must bear and does, with its limits.

    There is no counterweight: the drive holds the base as it is.

    Args:
        balance: masses on the base.
        drive: chosen for them.
        motion: of the base.
        swing: smallest and largest base angle, radians.
    """
    torques = base_torques(balance, swing, motion)
    loads = DriveLoads(drive, torques)
    return {
        "mass_g": balance.mass_g,
        "centre_mm": (balance.centre + 0.0).tolist(),
        "moment_g_mm": balance.moment,
        "azimuth_deg": float(np.degrees(balance.azimuth)),
        "inertia_g_mm2": balance.inertia,
        "worst_torque_nmm": torques.gravity,
        "peak_torque_nmm": torques.peak,
        "safety": motion.safety,
        "required_torque_nmm": torques.required,
        "holding_torque_nmm": drive.holds_nmm,
        "drive": drive.name,
        "motor": drive.motor.name,
        "ratio": drive.ratio,
        "steps_per_deg": drive.steps_per_deg(motion.microsteps),
        "motor_wind_up_deg": float(np.degrees(loads.motor_wind_up)),
        "belt_wind_up_deg": float(np.degrees(loads.belt_wind_up)),
        "wind_up_limit_deg": MAX_WIND_UP_DEG,
        "belt_centre_mm": drive.centre_mm,
        "teeth_in_mesh": loads.teeth_in_mesh,
        "belt_pull_n": loads.belt_pull,
        "belt_rating_n": loads.belt_rating,
        "belt_tension_n": loads.belt_tension,
        "belt_tone_hz": loads.belt_tone,
        "motor_radial_n": loads.motor_radial,
        "motor_radial_limit_n": loads.motor_radial_limit,
        "hold_margin": 0.0 if loads.self_locking else HOLD_MARGIN,
        "hold_current_a": loads.hold_current,
        "hold_loss_w": loads.hold_loss,
        "motor_rise_k": loads.motor_rise,
        "motor_rise_limit_k": MAX_RISE_K,
    }
