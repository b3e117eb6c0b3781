"""The base without power: how far it may fall, and the brake that holds it.

A stepper without current holds next to nothing. A worm holds; otherwise a base whose fall could
hurt gets a spring-applied brake on the rear of its motor's shaft, which only the supply's voltage
releases. It engages after a time in which the base falls freely.

The limit is what a finger bears between the base and what stands still: 140 N, at which its
75 N/mm (ISO/TS 15066:2016, annex A, hand; quasi-static, for it is clamped) take up 0.13 J.
Not modelled: a belt that breaks, a driver that lets the motor go while the brake has its voltage.
"""

import math
from dataclasses import replace

import numpy as np

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.base.hub import PIN_MM, PIN_OUT_MM, ZERO_DISC_MM
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.drive.drive import SELF_LOCKING, Drive
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, of_kind, without_example
from tbcad.records.prototype_drive import PowerOff

FINGER_N, FINGER_N_MM = 140.0, 75.0
MJ_PER_J, KG_M2 = 1e3, 1e-9  # KG_M2: of a gram millimetre squared
FALL_LIMIT_J = FINGER_N**2 / (2 * FINGER_N_MM) / MJ_PER_J
BRAKE_MARGIN = 1.5  # its torque over that of gravity; assumed, for a lining that is worn or greasy
# Permitted of a printed hole round a pin, as below the heads of screws; of a rod of hardened steel
# in shear: 0.4 of a proof stress of 580 MPa (8.8), which such a rod exceeds.
PRESSURE_LIMIT_MPA, SHEAR_LIMIT_MPA = 20.0, 230.0


def with_brake(
    drive: Drive, balance: BaseBalance, travel: tuple[float, float], parts: Parts
) -> Drive:
    """A drive with the weakest brake that holds the base in its travel (radians), if it needs one.

    SpecError when no brake holds it.
    """
    energy = fall_energy(drive, balance, travel)
    if energy <= FALL_LIMIT_J:
        return drive
    for brake in sorted(of_kind(parts, "brakes"), key=lambda one: one["torque_nmm"]):
        braked = replace(drive, brake=brake, motor=_with_two_ends(drive.motor))
        if fall_energy(braked, balance, travel) <= FALL_LIMIT_J:
            return braked
    raise SpecError(
        f"without power the base falls with {energy:.2f} J, {FALL_LIMIT_J:.2f} are allowed, and no "
        f"brake in brakes.csv holds {balance.max_torque(*travel):.0f} N mm through drive "
        f"{drive.name}: use prototype.base.drive nema17-belt or stage-60, or make "
        "prototype.largest_ball_mm smaller"
    )


def _with_two_ends(motor: PurchasedPart) -> PurchasedPart:
    """A motor as it is ordered for a brake: examples of the list have one end only."""
    ends = f"with a shaft of {motor['shaft_mm']:g} mm at both ends"
    return replace(motor, what=f"{without_example(motor.what)} {ends}")


def fall_energy(drive: Drive, balance: BaseBalance, travel: tuple[float, float]) -> float:
    """Energy that the base gets when power fails, at most, J; without friction."""
    if drive.efficiency < SELF_LOCKING:
        return 0.0
    torque, brake = balance.max_torque(*travel), drive.brake
    if brake is None or brake["torque_nmm"] * drive.ratio < BRAKE_MARGIN * torque:
        return _fall(balance, *travel) / MJ_PER_J
    return _until_braked(brake, torque, balance)


def _until_braked(brake: PurchasedPart, torque: float, balance: BaseBalance) -> float:
    """Energy of a base that the largest torque (N mm) turns until its brake engages, J."""
    momentum = torque / MJ_PER_J * brake["response_s"]  # N m s
    return momentum**2 / (2 * balance.inertia * KG_M2)


def power_off(drive: Drive, balance: BaseBalance, travel: tuple[float, float]) -> PowerOff:
    """Motion of a base without power between the ends of its travel, radians."""
    energy, inertia = fall_energy(drive, balance, travel), balance.inertia * KG_M2
    force, brake = balance.torque_amplitude / PIN_OUT_MM, drive.brake
    return PowerOff(
        brake=brake.name if brake else None,
        brake_torque_nmm=brake["torque_nmm"] * drive.ratio if brake else 0.0,
        needed_torque_nmm=BRAKE_MARGIN * balance.max_torque(*travel),
        fall_energy_j=energy,
        fall_energy_limit_j=FALL_LIMIT_J,
        fall_speed_deg_s=math.degrees(math.sqrt(2 * energy / inertia)) if inertia else 0.0,
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
