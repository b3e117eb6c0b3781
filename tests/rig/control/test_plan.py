"""What a run reads of an export, and what it refuses."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tbcad.errors import InputError
from tbcad.rig.control.plan import read_control_plan
from tbcad.rig.control.selection import chosen_frames, chosen_phases
from tests.exported_files import Rows, edit_csv


@pytest.fixture
def export(control_export: Path, tmp_path: Path) -> Path:
    """A copy to break."""
    return Path(shutil.copytree(control_export, tmp_path / "export"))


def test_frames_are_both_runs_in_order(control_export: Path) -> None:
    plan = read_control_plan(control_export)
    stops = len(plan.program.stops)
    assert [one.stop for one in plan.frames] == [*range(1, stops + 1)] * 2
    assert [one.object_turn_deg for one in plan.frames] == [0] * stops + [180] * stops
    for one in plan.frames:
        assert plan.program.stops[one.stop].angle_deg == pytest.approx(one.base_angle_deg, abs=1e-3)
    assert plan.program.known_angle[0] == "$H"
    assert plan.program.start.angle_deg < min(one.base_angle_deg for one in plan.frames)
    assert 3 not in plan.settings
    assert plan.settings[1] == 255


def replaced(name: str, old: str, new: str) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new))

    return change


def missing(name: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).unlink()


def of_stops(change: Callable[[Rows], object]) -> Callable[[Path], object]:
    return lambda folder: edit_csv(folder / "stops.csv", change)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (missing("prototype.json"), "prototype.json is not there"),
        (missing("rotation_plan.nc"), "rotation_plan.nc is not there"),
        (missing("balls.csv"), "balls.csv is not there"),
        (missing("grbl_settings.txt"), "grbl_settings.txt is not there"),
        (replaced("rotation_plan.nc", "(stop 2 of", "(stop 9 of"), "not numbered from 1"),
        (replaced("rotation_plan.nc", "M0 (MSG, turn", "M1 (MSG, turn"), "is no program of tbcad"),
        (replaced("rotation_plan.nc", "G92 X", "G92 Y"), "sets no angle"),
        (replaced("grbl_settings.txt", "$1=255", "motor on"), "line 5 is no setting"),
        (replaced("prototype.json", '"led_1"', '"lamp"'), "controller.phases.1.name"),
        (of_stops(lambda rows: rows.pop()), "another number of stops"),
        (of_stops(lambda rows: rows[2].update(base_angle_deg="3")), "does not drive to stop 3"),
    ],
)
def test_broken_export_is_refused(
    export: Path, change: Callable[[Path], object], says: str
) -> None:
    change(export)
    with pytest.raises(InputError, match=says):
        read_control_plan(export)


def test_phases_and_stops_that_are_chosen(control_export: Path) -> None:
    """Phases in the order of the plan, stops by numbers and ranges."""
    plan = read_control_plan(control_export)
    assert [one.name for one in chosen_phases(plan, "lit, dark")] == ["dark", "lit"]
    assert [one.output for one in chosen_phases(plan, "leds")] == [1, 2, 3, 4]
    found = chosen_frames(plan, "5,1-3", "ab")
    assert [one.stop for one in found] == [1, 2, 3, 5] * 2
    assert {one.object_turn_deg for one in chosen_frames(plan, None, "b")} == {180}


@pytest.mark.parametrize("text", ["0", "3-2", "1-", "a", "", "1,999"])
def test_stops_that_are_none(control_export: Path, text: str) -> None:
    with pytest.raises(InputError, match="allowed are 1 to"):
        chosen_frames(read_control_plan(control_export), text, "ab")
