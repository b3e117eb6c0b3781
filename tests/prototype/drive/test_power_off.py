"""The fall of a base without power, against closed forms."""

import math

import numpy as np
import pytest

from tbcad.prototype.base.hub import PIN_OUT_MM
from tbcad.prototype.drive.balance import GRAVITY, BaseBalance, power_off
from tbcad.records.prototype_drive import PowerOff

# The axis is level along y; one kilogram 100 mm above it at base angle zero.
FRAME = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
RADIUS_MM, MASS_G = 100.0, 1000.0
BALANCE = BaseBalance(
    FRAME, MASS_G, np.array([0.0, MASS_G * RADIUS_MM, 0.0]), MASS_G * RADIUS_MM**2
)
WEIGHT_N = GRAVITY


def fall(low_deg: float, high_deg: float, *, holds_itself: bool = False) -> PowerOff:
    low, high = math.radians(low_deg), math.radians(high_deg)
    return power_off(BALANCE, low, high, holds_itself=holds_itself)


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
