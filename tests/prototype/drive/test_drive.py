import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from tbcad.prototype.drive.drive import (
    DRIVE_COLUMNS,
    Drive,
    belt_length,
    centre_distance,
    choose_drive,
    load_drives,
    pitch_diameter,
)
from tbcad.prototype.purchased.parts import load_parts
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import MotionSpec

PARTS = load_parts()
DRIVES = load_drives(PARTS)


def belt(motor: str = "NEMA17-40", teeth: int = 60) -> Drive:
    return next(d for d in DRIVES if d.motor.name == motor and d.ratio == teeth / 20)


def refusal(folder: Path, *lines: str) -> str:
    (folder / "drives.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(SpecError) as caught:
        load_drives(PARTS, folder)
    return str(caught.value)


class TestDrives:
    @pytest.mark.parametrize(
        ("row", "message"),
        [
            ("a,,,,,,1,s", "drives.csv, line 2, column motor: empty"),
            ("a,NEMA99,,,,,1,s", "'NEMA99' is not in motors.csv or stages.csv"),
            ("a,608-2Z,,,,,1,s", "column motor: '608-2Z' is not in"),
            ("a,NEMA17-40,,GT2-60,,,1,s", "pinion, wheel and belt go together"),
            ("a,NEMA17-40,,,,,1.1,s", "column efficiency: '1.1'"),
        ],
    )
    def test_wrong_cells_are_named(self, tmp_path: Path, row: str, message: str) -> None:
        assert message in refusal(tmp_path, ",".join(DRIVE_COLUMNS), row)

    def test_steps(self) -> None:
        assert belt(teeth=120).steps_per_deg(16) == pytest.approx(200 * 16 * 6 / 360)
        stage = next(d for d in DRIVES if d.name == "stage-60")
        assert stage.steps_per_deg(1) == pytest.approx(200 * 90 / 360)

    def test_torque_on_the_base(self) -> None:
        assert belt().holds_nmm == pytest.approx(450 * 3 * 0.95)

    def test_a_motor_yields_a_full_step_to_its_holding_torque(self) -> None:
        drive = belt(teeth=120)
        assert drive.wind_up_angle(0) == 0
        assert np.degrees(drive.wind_up_angle(450 * 6)) == pytest.approx(1.8 / 6)
        assert drive.wind_up_angle(-450 * 3) == pytest.approx(math.asin(0.5) / 50 / 6)
        assert drive.wind_up_angle(1e9) == drive.wind_up_angle(450 * 6)

    def test_pull_is_torque_over_radius(self) -> None:
        assert belt().belt_pull(1000) == pytest.approx(1000 / (60 / math.pi))
        assert next(d for d in DRIVES if d.name == "stage-60").belt_pull(1000) == 0

    def test_equal_wheels(self) -> None:
        assert centre_distance(300, 20, 20) == pytest.approx((300 - math.pi * 20) / 2)

    def test_belts_are_tight_and_wheels_clear_each_other(self) -> None:
        for drive in (d for d in DRIVES if d.pinion and d.wheel and d.belt):
            small, large = pitch_diameter(drive.pinion), pitch_diameter(drive.wheel)
            assert drive.centre_mm > (small + large) / 2 + 2
            assert belt_length(drive.centre_mm, small, large) == pytest.approx(
                2 * drive.belt["teeth"]
            )
            wrap = math.pi - 2 * math.asin((large - small) / 2 / drive.centre_mm)
            assert drive.pinion["teeth"] * wrap / (2 * math.pi) > 6

    def test_short_belt(self) -> None:
        drive = replace(belt(teeth=120), belt=PARTS["GT2-200-6"])
        with pytest.raises(SpecError, match="too short for wheels"):
            _ = drive.centre_mm

    def test_the_first_that_holds(self) -> None:
        assert choose_drive("nema17-belt", 1000, DRIVES) == belt()
        assert choose_drive("nema17-belt", 3000, DRIVES).motor.name == "NEMA17-48"

    def test_none_holds(self) -> None:
        with pytest.raises(SpecError, match=r"no drive nema17-direct holds 2000 N mm .* 650: bal"):
            choose_drive("nema17-direct", 2000, DRIVES)
        with pytest.raises(SpecError, match="use one of nema17-belt, nema17-direct, stage-60"):
            choose_drive("servo", 1, DRIVES)

    @given(torque=st.floats(1, 4600))
    def test_the_chosen_one_holds(self, torque: float) -> None:
        drive = choose_drive("nema17-belt", torque, DRIVES)
        assert drive.holds_nmm >= torque
        before = DRIVES[: DRIVES.index(drive)]
        assert all(d.holds_nmm < torque for d in before)


class TestMotion:
    def test_unknown_and_wrong_keys(self) -> None:
        for key, value in {
            **{"speed": 1.0, "axis": "Y", "safety": 0.5, "microsteps": 0, "trigger_s": 0.0},
            **{"home_deg": 200.0, "approach_deg": -1.0, "feed_deg_min": float("nan")},
        }.items():
            with pytest.raises(ValidationError):
                MotionSpec.model_validate({key: value})
