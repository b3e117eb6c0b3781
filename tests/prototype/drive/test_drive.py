import math
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from tbcad.prototype.drive.drive import (
    COMMON,
    SIZES,
    Drive,
    belt_length,
    centre_distance,
    choose_drive,
    load_drives,
    load_parts,
    pitch_diameter,
)
from tbcad.spec.errors import SpecError
from tbcad.spec.motion_keys import MotionSpec

PARTS = load_parts()
DRIVES = load_drives(PARTS)
DRIVE_HEADER = "drive,motor,pinion,wheel,belt,coupling,efficiency,source"


def belt(motor: str = "NEMA17-40", teeth: int = 60) -> Drive:
    return next(d for d in DRIVES if d.motor.name == motor and d.ratio == teeth / 20)


def copied(folder: Path) -> Path:
    for path in Path(str(files("tbcad.prototype.purchased"))).glob("*.csv"):
        (folder / path.name).write_text(path.read_text(encoding="utf-8"), encoding="utf-8")
    return folder


def refusal(folder: Path, name: str, *lines: str) -> str:
    """What is said when a file of the lists is exchanged for these lines."""
    (copied(folder) / name).write_text("\n".join(lines) + "\n")
    with pytest.raises(SpecError) as caught:
        load_drives(load_parts(folder), folder)
    assert str(caught.value).isprintable()
    return str(caught.value)


class TestParts:
    def test_nema_17_has_its_pattern(self) -> None:
        for name in ("NEMA17-40", "NEMA17-48", "NEMA17-60"):
            motor = PARTS[name]
            assert [motor[size] for size in ("hole_square_mm", "thread_mm")] == [31, 3]
            assert [motor[size] for size in ("pilot_mm", "shaft_mm")] == [22, 5]

    def test_what_the_issue_names_is_there(self) -> None:
        assert {part.kind for part in PARTS.values()} == set(SIZES)
        bearing = PARTS["608-2Z"]
        assert [bearing[size] for size in ("bore_mm", "outer_mm", "width_mm")] == [8, 22, 7]

    @pytest.mark.parametrize(
        ("kind", "density", "size"),
        [("magnets", 7.5, "height_mm"), ("dowels", 7.85, "length_mm"), ("shafts", 7.85, None)],
    )
    def test_masses_of_rods(self, kind: str, density: float, size: str | None) -> None:
        for part in (part for part in PARTS.values() if part.kind == kind):
            volume = math.pi / 4 * part["diameter_mm"] ** 2 * part[size or "length_mm"]
            assert part.mass_g == pytest.approx(density * 1e-3 * volume, rel=1e-3)

    def test_longer_screws_are_heavier(self) -> None:
        screws = [part for part in PARTS.values() if part.kind == "screws"]
        for one in screws:
            for other in screws:
                if one["thread_mm"] == other["thread_mm"]:
                    longer = one["length_mm"] > other["length_mm"]
                    assert not longer or one.mass_g > other.mass_g

    @pytest.mark.parametrize(
        ("row", "told"),
        [
            (",w,m,1,3,3,s", "magnets.csv, line 3, column part: empty"),
            ("A,,m,1,3,3,s", "column what: empty"),
            ("A,w,m,0,3,3,s", "line 3, column mass_g: '0', allowed is a number above 0 to"),
            ("A,w,m,1,nan,3,s", "column diameter_mm: 'nan'"),
            ("A,w,m,1,3,3 mm,s", "column height_mm: '3 mm'"),
            ("A,w,m,1,3,1e9,s", "column height_mm: '1e9'"),
            ("A,w,m,1,3,3,", "column source: empty"),
            ("A,w,m,1,3,s", "line 3: 6 columns, not 7"),
            ("OK,w,m,1,3,3,s", "line 3, column part: 'OK' twice"),
            ("608-2Z,w,m,1,3,3,s", "column part: '608-2Z' twice"),
            ('"A"b,w,m,1,3,3,s', "line 3: "),
        ],
    )
    def test_wrong_cells_are_named(self, tmp_path: Path, row: str, told: str) -> None:
        header = ",".join([*COMMON, *SIZES["magnets"], "source"])
        assert told in refusal(tmp_path, "magnets.csv", header, "OK,w,m,1,3,3,s", row)

    def test_wrong_header(self, tmp_path: Path) -> None:
        assert "motors.csv, line 1: the columns must be" in refusal(tmp_path, "motors.csv", "part")

    def test_missing_or_not_text(self, tmp_path: Path) -> None:
        copied(tmp_path)
        (tmp_path / "leds.csv").write_bytes(b"\xff")
        with pytest.raises(SpecError, match=r"leds\.csv: cannot be read"):
            load_parts(tmp_path)
        (tmp_path / "leds.csv").unlink()
        with pytest.raises(SpecError, match=r"leds\.csv: cannot be read"):
            load_parts(tmp_path)


class TestDrives:
    @pytest.mark.parametrize(
        ("row", "told"),
        [
            ("a,,,,,,1,s", "drives.csv, line 2, column motor: empty"),
            ("a,NEMA99,,,,,1,s", "'NEMA99' is not in motors.csv or stages.csv"),
            ("a,608-2Z,,,,,1,s", "column motor: '608-2Z' is not in"),
            ("a,NEMA17-40,,GT2-60,,,1,s", "pinion, wheel and belt go together"),
            ("a,NEMA17-40,,,,,1.1,s", "column efficiency: '1.1'"),
            ("a,NEMA17-40,,,,1,s", "7 columns, not 8"),
        ],
    )
    def test_wrong_cells_are_named(self, tmp_path: Path, row: str, told: str) -> None:
        assert told in refusal(tmp_path, "drives.csv", DRIVE_HEADER, row)

    def test_steps(self) -> None:
        assert belt(teeth=120).steps_per_deg(16) == pytest.approx(200 * 16 * 6 / 360)
        stage = next(d for d in DRIVES if d.name == "stage-60")
        assert stage.steps_per_deg(1) == pytest.approx(200 * 90 / 360)

    def test_torque_on_the_base(self) -> None:
        assert belt().holds_nmm == pytest.approx(450 * 3 * 0.95)

    def test_a_motor_under_its_holding_torque_gives_a_full_step(self) -> None:
        drive = belt(teeth=120)
        assert drive.sag(0) == 0
        assert np.degrees(drive.sag(450 * 6)) == pytest.approx(1.8 / 6)
        assert drive.sag(-450 * 3) == pytest.approx(math.asin(0.5) / 50 / 6)
        assert drive.sag(1e9) == drive.sag(450 * 6)

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

    def test_the_first_that_does(self) -> None:
        assert choose_drive("nema17-belt", 1000, DRIVES) == belt()
        assert choose_drive("nema17-belt", 3000, DRIVES).motor.name == "NEMA17-48"

    def test_none_does(self) -> None:
        with pytest.raises(SpecError, match=r"no drive nema17-direct holds 2000 N mm .* 650: bal"):
            choose_drive("nema17-direct", 2000, DRIVES)
        with pytest.raises(SpecError, match="use one of nema17-belt, nema17-direct, stage-60"):
            choose_drive("servo", 1, DRIVES)

    @given(needed=st.floats(1, 4600))
    def test_what_is_chosen_holds(self, needed: float) -> None:
        drive = choose_drive("nema17-belt", needed, DRIVES)
        assert drive.holds_nmm >= needed
        before = DRIVES[: DRIVES.index(drive)]
        assert all(d.holds_nmm < needed for d in before)


class TestMotion:
    def test_unknown_and_wrong_keys(self) -> None:
        for key, value in {
            **{"speed": 1.0, "axis": "Y", "safety": 0.5, "microsteps": 0, "trigger_s": 0.0},
            **{"home_deg": 200.0, "approach_deg": -1.0, "feed_deg_min": float("nan")},
        }.items():
            with pytest.raises(ValidationError):
                MotionSpec.model_validate({key: value})
