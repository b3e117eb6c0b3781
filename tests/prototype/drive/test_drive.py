import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.drive.drive import (
    DRIVE_COLUMNS,
    HOLD_MARGIN,
    BaseTorques,
    Drive,
    DriveLoads,
    belt_length,
    centre_distance,
    choose_drive,
    drive_loads,
    load_drives,
    pitch_diameter,
)
from tbcad.prototype.purchased.parts import load_parts

PARTS = load_parts()
DRIVES = load_drives(PARTS)


def belt(motor: str = "NEMA17-40", teeth: int = 60) -> Drive:
    return next(d for d in DRIVES if d.motor.name == motor and d.ratio == teeth / 20)


def twice(gravity: float) -> BaseTorques:
    """Torques of a base at rest with a safety factor of two."""
    return BaseTorques(gravity, gravity, 2 * gravity)


def loads(drive: Drive, gravity: float = 500.0) -> DriveLoads:
    return drive_loads(drive, twice(gravity))


class TestDrives:
    def test_wrong_cells_are_named(self, tmp_path: Path) -> None:
        cases = {
            "a,,,,,,1,s": "drives.csv, line 2, column motor: empty",
            "a,NEMA99,,,,,1,s": "'NEMA99' is not in motors.csv or stages.csv",
            "a,608-2Z,,,,,1,s": "column motor: '608-2Z' is not in",
            "a,NEMA17-40,,GT2-60,,,1,s": "pinion, wheel and belt go together",
            "a,NEMA17-40,,,,,1.1,s": "column efficiency: '1.1'",
        }
        for row, message in cases.items():
            (tmp_path / "drives.csv").write_text(f"{','.join(DRIVE_COLUMNS)}\n{row}\n")
            with pytest.raises(SpecError) as caught:
                load_drives(PARTS, tmp_path)
            assert message in str(caught.value)

    def test_steps(self) -> None:
        assert belt(teeth=120).steps_per_deg(16) == pytest.approx(200 * 16 * 6 / 360)
        stage = next(d for d in DRIVES if d.name == "stage-60")
        assert stage.steps_per_deg(1) == pytest.approx(200 * 90 / 360)

    def test_a_motor_yields_a_full_step_to_its_holding_torque(self) -> None:
        drive = belt(teeth=120)
        assert drive.wind_up_angle(np.array(0.0)) == 0
        assert np.degrees(drive.wind_up_angle(np.array(450.0 * 6))) == pytest.approx(1.8 / 6)
        assert drive.wind_up_angle(np.array(-450.0 * 3)) == pytest.approx(-math.asin(0.5) / 50 / 6)
        assert drive.wind_up_angle(np.array(1e9)) == drive.wind_up_angle(np.array(450.0 * 6))

    def test_belts_are_tight_and_wheels_clear_each_other(self) -> None:
        assert centre_distance(300, 20, 20) == pytest.approx((300 - math.pi * 20) / 2)
        for drive in (d for d in DRIVES if d.pinion and d.wheel and d.belt):
            small, large = pitch_diameter(drive.pinion), pitch_diameter(drive.wheel)
            assert drive.centre_mm > (small + large) / 2 + 2
            length = belt_length(drive.centre_mm, small, large)
            assert length == pytest.approx(2 * drive.belt["teeth"])
            wrap = math.pi - 2 * math.asin((large - small) / 2 / drive.centre_mm)
            assert drive.pinion["teeth"] * wrap / (2 * math.pi) > 6

    def test_a_short_belt_and_none_that_holds(self) -> None:
        drive = replace(belt(teeth=120), belt=PARTS["GT2-200-6"])
        with pytest.raises(SpecError, match="too short for wheels"):
            _ = drive.centre_mm
        words = r"no drive nema17-direct bears 1000 N mm .* NEMA17-60, holds 650 N mm of 2000"
        with pytest.raises(SpecError, match=words):
            choose_drive("nema17-direct", twice(1000.0), DRIVES)
        with pytest.raises(SpecError, match="use one of nema17-belt, nema17-direct, stage-60"):
            choose_drive("servo", twice(1.0), DRIVES)

    @given(torque=st.floats(1, 2300))
    def test_the_chosen_one_is_the_first_without_a_fault(self, torque: float) -> None:
        drive = choose_drive("nema17-belt", twice(torque), DRIVES)
        before = DRIVES[: DRIVES.index(drive)]
        assert not list(drive_loads(drive, twice(torque)).faults())
        assert all(list(drive_loads(one, twice(torque)).faults()) for one in before)


class TestLoads:
    def test_a_belt_under_its_rating_is_chosen(self) -> None:
        """26.2 N are the rating of a GT2 belt of 6 mm: 111 N on an inch (SDP/SI)."""
        radius = pitch_diameter(belt(teeth=120).wheel) / 2  # type: ignore[arg-type]
        assert choose_drive("nema17-belt", twice(26.0 * radius), DRIVES).belt == PARTS["GT2-300-6"]
        assert choose_drive("nema17-belt", twice(27.0 * radius), DRIVES).belt == PARTS["GT2-300-15"]

    def test_fewer_teeth_in_mesh_bear_less(self) -> None:
        assert loads(belt(teeth=120)).teeth_in_mesh > 6
        assert loads(belt(teeth=120)).belt_rating == PARTS["GT2-300-6"]["rating_n"]
        few = replace(belt(teeth=120), pinion=replace(PARTS["GT2-16"], sizes=(12.0, 2.0, 7.0, 5.0)))
        assert math.floor(loads(few).teeth_in_mesh) == 4
        assert loads(few).belt_rating == pytest.approx(0.6 * PARTS["GT2-300-6"]["rating_n"])

    def test_the_tone_of_a_string(self) -> None:
        """f = sqrt(T / mu) / (2 L): a belt's own mass and length."""
        some = loads(belt())
        density = PARTS["GT2-240-6"].mass_g * 1e-3 / 0.24
        expected = math.sqrt(some.belt_tension / density) / (2 * some.drive.span_mm * 1e-3)
        assert some.belt_tone == pytest.approx(expected)

    def test_heat_goes_with_the_square_of_the_current_and_a_worm_needs_none(self) -> None:
        some = loads(belt(teeth=120), gravity=1000.0)
        share = HOLD_MARGIN * 1000 / (450 * 6 * 0.95)
        assert some.hold_current == pytest.approx(2 * share)
        assert some.hold_loss == pytest.approx(2 * 1.1 * (2 * share) ** 2)
        assert some.motor_rise == pytest.approx(80 * share**2)
        # A small safety factor leaves a motor that must have much of its current at rest.
        hot = drive_loads(belt(), BaseTorques(1200.0, 1210.0, 1210.0))
        assert any("warmer by" in fault for fault in hot.faults())
        worm = loads(next(d for d in DRIVES if d.name == "stage-60"))
        assert worm.self_locking
        assert worm.hold_current == worm.hold_loss == worm.motor_rise == worm.belt_wind_up == 0

    def test_a_weaker_current_yields_more(self) -> None:
        some = loads(belt(teeth=120), gravity=800.0)
        expected = math.asin(0.95 / HOLD_MARGIN) / 50 / 6
        assert some.motor_wind_up == pytest.approx(expected)
        assert some.motor_wind_up > some.drive.wind_up_angle(np.array(800.0))

    def test_belt_stretch(self) -> None:
        """Both sides are springs of EA / L: the stretch under the pull over the radius."""
        drive = belt(teeth=120)
        radius = 120 / math.pi
        stiffness = 2 * 9807 / drive.span_mm
        assert loads(drive, gravity=800.0).belt_wind_up == pytest.approx(
            800 / radius / stiffness / radius
        )

    def test_both_sides_of_the_belt_pull_at_the_shaft(self) -> None:
        """Side by side they add up; where they lean, their difference pulls across."""
        some = loads(belt(teeth=120))
        lean = math.acos(some.drive.span_mm / some.drive.centre_mm)
        tight, slack = (some.belt_tension + sign * some.belt_pull / 2 for sign in (1, -1))
        sides = tight * np.exp(1j * lean) + slack * np.exp(-1j * lean)
        assert some.motor_radial == pytest.approx(abs(sides))
        assert loads(next(d for d in DRIVES if d.name == "nema17-direct")).motor_radial == 0

    def test_bearings_of_the_motor_last(self) -> None:
        """ISO 281: twice the load leaves an eighth of the life."""
        wide = next(d for d in DRIVES if d.belt == PARTS["GT2-300-15"])
        limit = loads(wide).motor_radial_limit
        assert 30_000 * (wide.motor["radial_n"] / limit) ** 3 == pytest.approx(500)
        at_limit = 500.0 * limit / loads(wide).motor_radial
        words = "loads its motor's shaft"
        assert any(words in fault for fault in loads(wide, at_limit * 1.01).faults())
        assert not any(words in fault for fault in loads(wide, at_limit * 0.99).faults())
