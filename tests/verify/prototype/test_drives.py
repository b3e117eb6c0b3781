"""What a drive bears, in closed form; motors and gears as the parts lists have them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tbcad_verify import verify
from tbcad_verify.prototype import drive_checks
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.drive_checks import EFFICIENCY, FULL_STEPS, MOTORS, WORM_RATIO, Gear

from tbcad.app.cli import run
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.purchased.parts import load_parts

DRIVES = load_drives(load_parts())
PRINT = "afternoon-print"


@pytest.mark.parametrize("drive", DRIVES, ids=lambda drive: f"{drive.name} {drive.motor.name}")
def test_torque_and_ratio_are_those_of_the_lists(drive: Drive) -> None:
    holding = MOTORS[drive.motor.name]
    ratio = WORM_RATIO if drive.name == "stage-60" else drive.ratio
    assert drive.holds_nmm == pytest.approx(holding * ratio * EFFICIENCY[drive.name])
    assert drive.steps_per_deg(8) == pytest.approx(FULL_STEPS * 8 * ratio / 360)


MASS_G, OUT_MM = 800.0, 50.0
GRAVITY = 9.80665
BELT = Gear(3.0, 19.0986, 6.3662, 78.9713, 20, 6.0)
EQUAL = Gear(1.0, 10.0, 10.0, 90.0, 31, 6.0)


def context(drive: str = "nema17-belt", safety: float = 2.0) -> PrototypeContext:
    """A base about the level x axis that homing takes from -90 to 60 degrees."""
    spec = SimpleNamespace(base=SimpleNamespace(drive=drive), motion=SimpleNamespace(safety=safety))
    prototype = SimpleNamespace(
        home=SimpleNamespace(switch=-90.0, travel=150.0),
        stops=SimpleNamespace(angle=np.array([-20.0, 30.0])),
    )
    found = SimpleNamespace(
        frame=np.eye(3),
        base_rotation=lambda angle: Rotation.from_rotvec(angle[:, None] * [1.0, 0.0, 0.0]),
        export=SimpleNamespace(spec=SimpleNamespace(prototype=spec)),
        prototype=prototype,
    )
    return cast(PrototypeContext, found)


ABOVE = drive_checks.Balance(MASS_G, np.array([7.0, 0.0, OUT_MM]), MASS_G * OUT_MM**2)
WEIGHT_NMM = 1e-3 * MASS_G * GRAVITY * OUT_MM


def test_gravity_pulls_by_the_sine_of_the_angle() -> None:
    angle = np.radians([0.0, 30.0, -90.0])
    torque = ABOVE.torque(context(), angle)
    assert torque == pytest.approx(WEIGHT_NMM * np.sin(angle))
    worst = drive_checks._worst_torque(context(), ABOVE)
    assert worst == pytest.approx(WEIGHT_NMM * 0.5)


@pytest.mark.parametrize(("drive", "falls"), [("nema17-belt", True), ("stage-60", False)])
def test_a_fall_from_above_the_axis_to_its_height(drive: str, falls: bool) -> None:
    energy, speed = drive_checks._fall(context(drive), ABOVE)
    assert energy == pytest.approx(falls * 1e-3 * WEIGHT_NMM)
    assert speed == pytest.approx(falls * np.degrees(np.sqrt(2 * GRAVITY / (1e-3 * OUT_MM))))


@pytest.mark.parametrize(("times", "faults"), [(0.99, 0), (1.01, 1)])
def test_the_pin_bears_the_largest_torque(times: float, faults: int) -> None:
    """20 MPa on 4 x 5 mm, 44 mm from the axis, come before the steel's shear."""
    heavy = replace(ABOVE, mass=times * MASS_G * 20 * 4 * 5 * 44 / WEIGHT_NMM)
    assert len([*drive_checks._pin_faults(context(), heavy)]) == faults


@pytest.mark.parametrize(
    ("gear", "worst", "peak", "words"),
    [
        (BELT, 150.0, 160.0, ""),
        (BELT, 150.0, 642.0, "the drive holds 1282 N mm of 1284"),
        (replace(BELT, distance=79.5), 150.0, 160.0, "no belt has the"),
        (replace(BELT, width=1.0), 150.0, 160.0, "pulled by 8.4 N and rated for 4.4 N"),
        (replace(BELT, teeth=10), 150.0, 350.0, "rated for 15.7 N"),
        (Gear(1.0), 228.0, 210.0, "the motor gets 40 K warmer"),
    ],
)
def test_what_motor_and_belt_do_not_bear(gear: Gear, worst: float, peak: float, words: str) -> None:
    some = context("nema17-belt" if gear.width else "nema17-direct")
    faults = "; ".join(drive_checks._faults(some, MOTORS["NEMA17-40"], gear, worst, peak))
    assert words in faults
    assert bool(words) == bool(faults)


def test_motor_and_belt_yield() -> None:
    """A motor of 1.4 times its load, with a gear of 0.95, turns by asin(0.95/1.4) / 50."""
    soft = replace(EQUAL, width=0.6)
    assert drive_checks._stretch(soft, 100.0) == pytest.approx(
        100.0 * 90.0 / (2 * drive_checks.STIFFNESS_N_MM * 0.6) / 10.0**2
    )
    own = np.degrees(np.arcsin(0.95 / 1.4)) / 50
    more = np.degrees(drive_checks._stretch(soft, 100.0))
    faults = [*drive_checks._faults(context(), MOTORS["NEMA17-40"], soft, 100.0, 100.0)]
    assert f"yield by {own + more:.2f} deg" in "; ".join(faults)


def test_both_sides_of_a_belt_pull_at_the_shaft() -> None:
    """Of equal wheels in one direction: 1.2 and 0.2 of the pull; life by the cube (ISO 281)."""
    assert drive_checks._shaft_load(EQUAL, 500.0) == pytest.approx(1.4 * 50.0)
    assert drive_checks._shaft_limit("NEMA17-40") == pytest.approx(22 * 60 ** (1 / 3))


@pytest.mark.designs
@pytest.mark.usefixtures("standing")
@pytest.mark.parametrize(
    ("drive", "lock"), [("nema17-direct", "clamp"), ("stage-60", "set-screws")]
)
def test_a_build_with_another_drive_is_verified(drive: str, lock: str, tmp_path: Path) -> None:
    """Seats of this design end behind the disc that a hub on a stage would have."""
    folder = tmp_path / "export"
    keys = (f"prototype.base.drive={drive}", f"prototype.base.lock={lock}")
    options = [word for key in keys for word in ("--set", key)]
    words = ["build", PRINT, "--parts", "prototype", "--no-verify", *options, "--out", str(folder)]
    assert run(words) == 0
    report = verify(folder)
    assert report.passed, report.verdict
    assert report.balls
