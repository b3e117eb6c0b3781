"""The fall of a base without power, against closed forms."""

import math

import numpy as np
import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.base.hub import PIN_OUT_MM
from tbcad.prototype.drive.balance import GRAVITY, BaseBalance
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.drive.power_off import FALL_LIMIT_J, fall_energy, power_off, with_brake
from tbcad.prototype.purchased.parts import load_parts
from tbcad.records.prototype_drive import PowerOff

PARTS = load_parts()
BELT, DIRECT, WORM = (
    next(one for one in load_drives(PARTS) if one.name == name and one.ratio >= ratio)
    for name, ratio in (("nema17-belt", 6), ("nema17-direct", 1), ("stage-60", 1))
)

# The axis is level along y; one kilogram 100 mm above it at base angle zero.
FRAME = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
RADIUS_MM, MASS_G = 100.0, 1000.0
BALANCE = BaseBalance(
    FRAME, MASS_G, np.array([0.0, MASS_G * RADIUS_MM, 0.0]), MASS_G * RADIUS_MM**2
)
WEIGHT_N = GRAVITY


def fall(low_deg: float, high_deg: float, *, holds_itself: bool = False) -> PowerOff:
    travel = math.radians(low_deg), math.radians(high_deg)
    return power_off(WORM if holds_itself else BELT, BALANCE, travel)


@pytest.mark.parametrize(
    ("low", "high", "height_mm"),
    [
        (-90, 90, RADIUS_MM),  # from the top to beside the axis
        (-60, 120, 1.5 * RADIUS_MM),
        (-120, 60, 1.5 * RADIUS_MM),
        (30, 90, math.cos(math.radians(30)) * RADIUS_MM),  # the top is not in the travel
        (300, 420, RADIUS_MM / 2),  # a whole turn on
        (-180, 0, 2 * RADIUS_MM),
    ],
)
def test_energy_is_weight_by_height(low: float, high: float, height_mm: float) -> None:
    energy = WEIGHT_N * height_mm * 1e-3
    found = fall(low, high)
    assert found.fall_energy_j == pytest.approx(energy)
    speed = math.sqrt(2 * energy / (MASS_G * RADIUS_MM**2 * 1e-9))
    assert found.fall_speed_deg_s == pytest.approx(math.degrees(speed))


def test_at_rest_with_a_worm_or_between_ends_of_one_height() -> None:
    """It swings from one end to the other and arrives with nothing."""
    assert fall(100, 260).fall_energy_j == pytest.approx(0, abs=1e-12)
    found = fall(-90, 90, holds_itself=True)
    assert (found.fall_energy_j, found.fall_speed_deg_s) == (0, 0)


def test_the_pin_bears_the_largest_torque() -> None:
    found, force = fall(-90, 90), WEIGHT_N * RADIUS_MM / PIN_OUT_MM
    assert found.pin_force_n == pytest.approx(force)
    assert found.pin_shear_mpa == pytest.approx(force / (math.pi * 2**2))
    assert found.pin_pressure_mpa == pytest.approx(force / (4 * 5))
    assert found.pin_pressure_mpa < found.pin_pressure_limit_mpa


TRAVEL = -math.pi / 2, math.pi / 2


def balance(mass_g: float) -> BaseBalance:
    first = np.array([0.0, mass_g * RADIUS_MM, 0.0])
    return BaseBalance(FRAME, mass_g, first, mass_g * RADIUS_MM**2)


def test_a_brake_lets_the_base_fall_until_it_engages() -> None:
    """Angular momentum M t, energy (M t)^2 / 2 I; within 0.13 J: 140 N on 75 N/mm."""
    assert pytest.approx(0.1307, abs=1e-4) == FALL_LIMIT_J
    braked = with_brake(BELT, BALANCE, TRAVEL, PARTS)
    assert braked.brake is not None
    momentum = WEIGHT_N * RADIUS_MM * 1e-3 * braked.brake["response_s"]
    energy = momentum**2 / (2 * MASS_G * RADIUS_MM**2 * 1e-9)
    found = power_off(braked, BALANCE, TRAVEL)
    assert found.fall_energy_j == pytest.approx(energy)
    assert energy < FALL_LIMIT_J < fall_energy(BELT, BALANCE, TRAVEL)
    assert found.brake_torque_nmm == 6 * 400
    assert found.needed_torque_nmm == pytest.approx(1.5 * WEIGHT_N * RADIUS_MM)


@pytest.mark.parametrize(("drive", "mass"), [(BELT, 100.0), (DIRECT, 100.0), (WORM, 5000.0)])
def test_no_brake_where_the_fall_is_harmless(drive: Drive, mass: float) -> None:
    assert with_brake(drive, balance(mass), TRAVEL, PARTS) == drive


@pytest.mark.parametrize(("drive", "mass"), [(BELT, 1700.0), (DIRECT, 300.0)])
def test_what_no_brake_holds_is_refused(drive: Drive, mass: float) -> None:
    """400 N mm on the motor, with a ratio of 6 or 1, against 1.5 times gravity."""
    with pytest.raises(SpecError, match=r"without power the base falls .* no brake in brakes\.csv"):
        with_brake(drive, balance(mass), TRAVEL, PARTS)
