"""tbcad camera: the sheet, its exit code, and users' lists."""

import json
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.core.camera.sheet import CAMERA_COLUMNS


def test_lines_of_the_sheet(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["camera", "--n", "6"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "cameras do with a lens of the list" in lines[0]
    assert all(len(line) <= 80 for line in lines)


def test_a_users_camera_is_a_candidate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.csv"
    file.write_text(",".join(CAMERA_COLUMNS) + "\nMine,Sony E,36,24,30000,20000,usb,me\n")
    assert run(["camera", "--n", "6", "--cameras", str(file), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["candidates"][0]["camera"] == "Mine"
    assert record["requirements"]["near_mm"] < record["requirements"]["far_mm"]


def test_a_sensor_that_no_camera_has(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["camera", "--n", "6", "--set", "width_px=32768", "--set", "height_px=24000"]) == 1
    out = capsys.readouterr().out
    assert out.startswith("no camera of the list does: ")
    assert "pixels across the mirrors" in out


def test_a_list_that_is_missing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["camera", "--n", "6", "--lenses", str(tmp_path / "none.csv")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "none.csv" in error
