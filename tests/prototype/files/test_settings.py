"""The controller's settings against the drive, and GRBL's own rules."""

import pytest

from tbcad.prototype.drive.drive import Drive, choose_drive, load_drives
from tbcad.prototype.drive.travel import HomeAngles
from tbcad.prototype.files.settings import settings, settings_lines
from tbcad.prototype.purchased.parts import load_parts
from tbcad.spec.prototype import MotionSpec

ANGLES = HomeAngles(-98.5, -96.5, 191.0)


@pytest.fixture(scope="module")
def drive() -> Drive:
    return choose_drive("nema17-belt", 1000, load_drives(load_parts()))


def of(drive: Drive, motion: MotionSpec) -> dict[int, float]:
    return {number: value for number, value, _ in settings(drive, motion, ANGLES)}


def test_steps_speed_acceleration_travel(drive: Drive) -> None:
    found = of(drive, MotionSpec())
    assert found[100] == pytest.approx(200 * 16 * drive.ratio / 360)
    assert (found[110], found[120], found[130]) == (900, 50, 191)
    assert (found[5], found[23], found[44]) == (1, 1, 1)


def test_another_axis_has_its_own_numbers_and_bit(drive: Drive) -> None:
    found = of(drive, MotionSpec(axis="A"))
    assert {103, 113, 123, 133} < set(found)
    assert (found[5], found[23], found[44]) == (8, 8, 8)


def test_grbl_refuses_soft_limits_before_homing(drive: Drive) -> None:
    order = list(of(drive, MotionSpec()))
    assert order.index(22) < order.index(20)


def test_no_homing_with_grbl(drive: Drive) -> None:
    assert not {20, 21, 22, 44} & set(of(drive, MotionSpec(controller="grbl")))


def test_homing_is_no_faster_than_the_base(drive: Drive) -> None:
    found = of(drive, MotionSpec(feed_deg_min=40))
    assert found[24] <= found[25] <= 40


def test_lines(drive: Drive) -> None:
    lines = list(settings_lines("title", settings(drive, MotionSpec(), ANGLES)))
    assert lines[:3] == ["(title)", "(motor always on, for the base falls without it)", "$1=255"]
    assert max(map(len, lines)) < 80
    assert all(line.startswith(("(", "$")) for line in lines)
