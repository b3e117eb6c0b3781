"""The overview of a build: a dozen lines, or a record, and nothing written."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tbcad.app.cli.app import app

run = CliRunner().invoke


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_lines(tmp_path: Path) -> None:
    result = run(app, ["build", "--n", "4", "--dry-run"])
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert len(lines) <= 12
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith("mirrors           98 (89 virtual cameras), radius ")
    assert any(line.startswith("prototype ") for line in lines)
    assert list(tmp_path.iterdir()) == []


def test_record() -> None:
    result = run(app, ["build", "--n", "4", "--parts", "shell", "--dry-run", "--json"])
    record = json.loads(result.stdout)
    assert (record["mirrors"], record["virtual_cameras"], record["prototype"]) == (98, 89, None)
    assert record["minimum_coverage_mm"] > 60
    assert record["spec"]["camera"]["hfov_deg"] == record["view_angle_deg"]


def test_planar_mirrors_have_no_radius_and_no_prototype() -> None:
    result = run(app, ["build", "--n", "3", "--radius-rule", "flat", "--dry-run"])
    assert "planar" in result.stdout
    assert "prototype" not in result.stdout
