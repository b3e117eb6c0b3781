"""Profiles are data from users: read strictly, refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest
from tbcad_verify.printing.profile import MAX_BYTES, BadProfile, Profile, built_in, load

GOOD = """\
name = "mine"
process = "FDM"
bed_mm = [200, 210.5, 250]
spot_mm = 0.6
wall_mm = 1.8
hole_mm = 2
clearance_mm = 0.4
tolerance_mm = 0.3
overhang_deg = 50
material = "PETG"
density_g_cm3 = 1.27
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(GOOD)
    return path


def test_the_four_built_in_ones() -> None:
    assert built_in() == ("cnc", "fdm", "sla", "sls")
    profiles = {name: load(name) for name in built_in()}
    assert all(profile.name == name for name, profile in profiles.items())
    assert profiles["fdm"].bed_mm == (256, 256, 256)
    assert [p.overhang_deg is None for p in profiles.values()] == [True, False, False, True]
    assert [profile.process for profile in profiles.values()] == ["CNC", "FDM", "SLA", "SLS"]


def test_the_first_file_explains_every_key() -> None:
    folder = Path(__file__).parents[3] / "verify/tbcad_verify/printing/profiles"
    lines = (folder / "fdm.toml").read_text().splitlines()
    given = {line.split(" = ")[0] for line in lines if " = " in line and line[0] != "#"}
    assert given == set(Profile.model_fields)


BAD = [
    ("wall_mm", "wal_mm", "unknown key wal_mm: did you mean wall_mm\\? allowed are name, process"),
    ("wall_mm = 1.8", "", "wall_mm is missing: change it"),
    ("wall_mm = 1.8", "wall_mm = -1", "wall_mm is -1: it should be greater than or equal"),
    ("wall_mm = 1.8", "wall_mm = nan", "wall_mm is nan: it should be a finite number"),
    ("spot_mm = 0.6", "spot_mm = 0", "spot_mm is 0: it should be greater than 0:"),
    ('"FDM"', '"fdm"', "process is fdm: it should be 'FDM', 'SLA', 'SLS' or 'CNC'"),
    ("[200, 210.5, 250]", "[200, 210.5]", "bed_mm.2. is missing"),
    ("clearance_mm = 0.4", "clearance_mm = 100", "clearance_mm is 100, allowed is less than half"),
    ("overhang_deg = 50", "overhang_deg = 91", "overhang_deg is 91: it should be less than or"),
    ('"mine"', '"a\\nb"', "name is 'a.*: String should match"),
    ("hole_mm = 2", "hole_mm = 2\nhole_mm = 3", "no TOML"),
    ("hole_mm = 2", "hole_mm = 2\ncavities = 1", "cavities is 1: it should be a valid boolean"),
    ("hole_mm = 2", "hole_mm = 2\n'a\\u000ab' = 1", "unknown key"),
    ("hole_mm = 2", "wall = 2\nhol = 3", "and 2 more"),
    ("hole_mm = 2", f"hole_mm = {'[' * 3000}", "no TOML"),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD)
def test_broken_files_are_refused_in_one_line(file: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    file.write_text(GOOD.replace(old, new), encoding="utf-8")
    with pytest.raises(BadProfile, match=message) as caught:
        load(str(file))
    line = str(caught.value)
    assert line.startswith("profile ")
    assert "mine.toml" in line
    assert line.isprintable()
    assert len(line) < 400


NONE = [
    ("fmd", "did you mean fdm"),
    ("machined", "^profile machined: it is called cnc now: write cnc$"),
    ("a\0b", "neither built in nor a file"),
    ("/dev/null", "not a regular file"),
]


@pytest.mark.parametrize(("name", "message"), NONE)
def test_names_that_are_none(name: str, message: str) -> None:
    with pytest.raises(BadProfile, match=message) as caught:
        load(name)
    assert str(caught.value).isprintable()


def test_a_file_that_is_too_large(file: Path) -> None:
    file.write_text(GOOD + "#" * (MAX_BYTES - len(GOOD)), encoding="utf-8")
    assert load(str(file)).name == "mine"
    file.write_text(GOOD + "#" * (MAX_BYTES - len(GOOD) + 1), encoding="utf-8")
    with pytest.raises(BadProfile, match=f"larger than the {MAX_BYTES} bytes"):
        load(str(file))


def test_no_text(file: Path) -> None:
    file.write_bytes(GOOD.encode() + b"# \xff")
    with pytest.raises(BadProfile, match="not UTF-8 text"):
        load(str(file))
