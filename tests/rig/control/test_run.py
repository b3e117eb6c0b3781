"""The command against a controller's double, with a camera that sees what it shows."""

import re
import shutil
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tbcad.app.cli import run as tbcad
from tbcad.errors import InputError
from tbcad.rig.control.grbl import STATUS_S, Grbl
from tbcad.rig.control.plan import read_control_plan
from tbcad.rig.control.selection import chosen_frames, chosen_phases
from tbcad.rig.runs import read_run
from tests.exported_files import Rows, edit_csv
from tests.rig.control.conftest import Told
from tests.rig.control.rig import ALL, Rig, check_every_photograph, events


def test_every_photograph_of_a_run(either_rig: Rig, cli: Callable[..., Any]) -> None:
    told = cli(*either_rig.words()).out
    check_every_photograph(either_rig.out, ALL)
    assert events(either_rig.out) == ["started", *["taken"] * ALL, "finished"]
    assert told.startswith(f"COMPLETE: {ALL} of {ALL} photographs")


def test_what_the_controller_is_sent(rig: Rig) -> None:
    """Stops are reached from below."""
    assert tbcad(rig.words("--phases", "dark,lit", "--runs", "b", stops="2,5")) == 0
    lines = rig.controller.lines
    assert "$C" not in lines
    assert lines.index("$H") < lines.index("M64 P0")
    assert [line for line in lines if line in ("M64 P0", "M8")] == ["M64 P0"] * 2
    moves = [index for index, line in enumerate(lines) if line.startswith("G1 ")]
    assert all(lines[index + 1].startswith("G4 P") for index in moves)
    start, second, fifth, end = (float(lines[at].split("X")[1].split()[0]) for at in moves)
    assert start < second < fifth
    assert end == 0
    run = read_run(rig.out)
    assert [(one.object_turn_deg, one.stop) for one in run.record.frames] == [(180, 2), (180, 5)]
    assert not rig.controller.machine.lights
    assert rig.controller.machine.angle == pytest.approx(0, abs=0.01)


def test_board_that_begins_anew_when_its_port_is_opened(rig: Rig) -> None:
    rig.controller.boots = True
    assert tbcad(rig.words("--phases", "dark", stops="1")) == 0
    check_every_photograph(rig.out, 2)


def test_status_is_asked_for_five_times_a_second_at_most(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tbcad.rig.control.grbl.STATUS_S", STATUS_S)  # as it is
    ask, asked = Grbl._ask, list[float]()

    def recorded(grbl: Grbl, *arguments: float) -> bool:
        """By the driver's own clock: when a busy machine delivers a question tells nothing."""
        if done := ask(grbl, *arguments):
            asked.append(grbl._asked)
        return done

    monkeypatch.setattr(Grbl, "_ask", recorded)
    assert tbcad(rig.words("--phases", "dark")) == 0
    assert len(asked) > 5
    assert min(b - a for a, b in pairwise(asked)) >= STATUS_S


def test_plain_grbl_photographs_the_lit_object_only(plain_rig: Rig) -> None:
    assert tbcad(plain_rig.words()) == 0
    run = read_run(plain_rig.out)
    assert run.record.phases == ("lit",)
    assert len(run.exposures) == 4
    assert not any(re.match(r"\$H|M6[45]", line) for line in plain_rig.controller.lines)


def test_folder_that_the_released_camera_fills(either_rig: Rig) -> None:
    camera = either_rig.released()
    (either_rig.folder / "pictures" / "old.jpg").write_bytes(b"of another day")
    assert tbcad(either_rig.words("--phases", "dark,lit", camera=camera, stops="1")) == 0
    check_every_photograph(either_rig.out, 4)


def test_release_that_brings_no_photograph(rig: Rig, stopped: Told) -> None:
    """The first release is for the trial; the third and fourth are for the second photograph."""
    phases, camera = ("--phases", "dark,led_1,lit"), rig.released(missed=(3, 4))
    out = stopped(rig.words(*phases, "--timeout", "1", camera=camera, stops="1"))
    pictures = camera.removeprefix("folder:")
    assert f"missing: a_0001_led_1: no photograph came into {pictures} within 1 s" in out
    assert set(read_run(rig.out).faults) == {"a_0001_led_1"}


def test_operator_is_asked(
    rig: Rig, monkeypatch: pytest.MonkeyPatch, cli: Callable[..., Any]
) -> None:
    words = [word for word in rig.words("--phases", "dark", stops="1") if word != "--yes"]
    assert "use --yes" in cli(*words, code=2).err
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    asked: list[str] = []

    def confirm(text: str, **_: object) -> bool:
        asked.append(text)
        return len(asked) != 2

    monkeypatch.setattr("typer.confirm", confirm)
    assert "stopped: the operator did not go on" in cli(*words, code=1).out
    assert asked == [
        "zero pin out, object straight: done?",
        "turn the object by 180 degrees about z: done?",
    ]
    assert tbcad([*words[:-2], "--resume"]) == 0
    assert asked[-1] == "zero pin out, object turned by 180 degrees about z: done?"
    check_every_photograph(rig.out, 2)


def test_dry_run_needs_no_machine(
    control_export: Path, tmp_path: Path, cli: Callable[..., Any]
) -> None:
    out = tmp_path / "run"
    text = cli("run", control_export, "--dry-run", "--out", out, "--stops", "3").out
    assert text.startswith("12 photographs at 2 positions would be taken")
    assert "dark, led_1, led_2, led_3, led_4, lit" in text
    assert "1.8 MB of disk" in text
    assert not out.exists()


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
