"""The controller's settings against the drive, and GRBL's own rules."""

import pytest

from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.drive.loads import BaseTorques, choose_drive
from tbcad.prototype.drive.travel import HomeAngles
from tbcad.prototype.files.controllers import settings
from tbcad.prototype.purchased.parts import load_parts

ANGLES = HomeAngles(-98.5, -96.5, 191.0)


@pytest.fixture(scope="module")
def drive() -> Drive:
    return choose_drive("nema17-belt", BaseTorques(450.0, 500.0, 1000.0), load_drives(load_parts()))


def of(drive: Drive, motion: MotionSpec) -> dict[int, float]:
    return {number: value for number, value, _ in settings(drive, motion, ANGLES)}


def test_steps_speed_acceleration_travel(drive: Drive) -> None:
    found = of(drive, MotionSpec())
    assert found[100] == pytest.approx(200 * 16 * drive.ratio / 360)
    assert (found[110], found[120], found[130]) == (900, 50, 191)
    assert (found[23], found[44]) == (1, 1)


def test_another_axis_has_its_own_numbers_and_bit(drive: Drive) -> None:
    found = of(drive, MotionSpec(axis="A"))
    assert {103, 113, 123, 133} < set(found)
    assert (found[23], found[44]) == (8, 8)


@pytest.mark.parametrize(("axis", "bit"), [("X", 1), ("A", 8)])
def test_only_the_switch_that_opens_reads_as_pressed_when_high(
    drive: Drive, axis: str, bit: int
) -> None:
    """In grblHAL a high input is a pressed switch unless its bit of $5 is set (core, config.h)."""
    inverted = int(of(drive, MotionSpec(axis=axis))[5])
    pressed = {1, 2, 4, bit} - {other for other in (1, 2, 4, 8) if inverted & other}
    assert pressed == {bit}  # all inputs are high: this switch is open, the others are empty


def test_grbl_refuses_soft_limits_before_homing(drive: Drive) -> None:
    order = list(of(drive, MotionSpec()))
    assert order.index(22) < order.index(20)


def test_grbl_has_no_homing_and_no_setting_that_it_does_not_know(drive: Drive) -> None:
    """GRBL 1.1 has $0 to $32 and those of X, Y and Z."""
    found = of(drive, MotionSpec(controller="grbl"))
    assert {found[number] for number in (20, 21, 22)} == {0}
    assert all(number <= 32 or number >= 100 for number in found)
    assert found[10] == 1


@pytest.mark.parametrize(("axis", "bit"), [("X", 1), ("A", 8)])
def test_motor_stays_on_and_homing_is_reported(drive: Drive, axis: str, bit: int) -> None:
    """In grblHAL $37 keeps motors on in alarms, bit 12 of $10 reports while it homes."""
    found = of(drive, MotionSpec(axis=axis))
    assert (found[1], found[37], found[62]) == (255, bit, 0)
    assert int(found[10]) & 1 << 12


@pytest.mark.parametrize("controller", ["grblhal", "grbl"])
def test_another_life_of_the_board_is_undone(drive: Drive, controller: str) -> None:
    found = of(drive, MotionSpec(controller=controller))
    assert (found[13], found[32]) == (0, 0)  # inches; laser or lathe
    assert int(found[10]) & 1


def test_homing_is_no_faster_than_the_base(drive: Drive) -> None:
    found = of(drive, MotionSpec(feed_deg_min=40))
    assert found[24] <= found[25] <= 40
