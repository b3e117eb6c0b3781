"""Drives other than the default: the verification knows them as the parts lists do."""

from __future__ import annotations

from pathlib import Path

import pytest
from tbcad_verify import verify
from tbcad_verify.prototype.drive_checks import EFFICIENCY, FULL_STEPS, MOTORS_NMM, STAGE_RATIO

from tbcad.cli import run
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.purchased.parts import load_parts

DRIVES = load_drives(load_parts())
PRINT = "afternoon-print"


@pytest.mark.parametrize("drive", DRIVES, ids=lambda drive: f"{drive.name} {drive.motor.name}")
def test_torque_and_ratio_are_those_of_the_lists(drive: Drive) -> None:
    holding = MOTORS_NMM[drive.motor.name]
    ratio = STAGE_RATIO if drive.name == "stage-60" else drive.ratio
    assert drive.holds_nmm == pytest.approx(holding * ratio * EFFICIENCY[drive.name])
    assert drive.steps_per_deg(8) == pytest.approx(FULL_STEPS * 8 * ratio / 360)


@pytest.mark.designs
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
    assert report.prototype
