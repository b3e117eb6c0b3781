"""What commands refuse: exit code 2, one line in plain words last, and nothing is written."""

import os
import shlex
import shutil
from pathlib import Path

import pytest

from tbcad.app.cli import run
from tbcad.light.simulate.capture.light_field import LightField
from tests.ball_captures import ball, four  # noqa: F401
from tests.light.viewer.fields import write_ball

# A command and a part of its line. RECORD is a build's record, EXPORT one with a prototype, SAMPLE
# a whole build, CHANGED one with another bit, KNOT a capture, FIELD one with a field beside it,
# BALL one of two frames.
CASES = (Path(__file__).parent / "refusals.txt").read_text(encoding="utf-8")
LAMP = "x_mm,y_mm,z_mm\n"
GIVEN = {
    "old.png": "mine",
    "old.npz": "mine",
    "page/report.html": "<!doctype html>mine",
    "broken/lightfield.h5": "no",
    "folder.png/mine": "mine",
    "design.toml": "optics.n = 3\n",
    "mine.toml": 'based_on = "sla"\nball_grade = "G7"',
    "none.csv": LAMP,
    "inside.csv": LAMP + "1,2,3\n",
    "named.csv": "x,y,z\n1,2,300\n",
    "bad.mtl": "newmtl m\nPr 0.3\nNs shiny\n",
    "bad.obj": "mtllib bad.mtl\nusemtl m\nv 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n",
    "lost.obj": "mtllib lost.mtl\nusemtl m\nv 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n",
    "lamps.csv": LAMP + "1,2,300\n",
    "sky.hdr": "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" + 8 * "@@@\x7f",
}


@pytest.fixture(scope="module")
def folders(
    record: Path,
    export_with_wind_up: Path,
    captured: Path,
    ball: Path,  # noqa: F811
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, str]:
    """By their names in the cases."""
    field = tmp_path_factory.mktemp("field") / "knot"
    shutil.copytree(captured, field)
    with LightField.open(field) as source:
        write_ball(source, field)
    sample = Path(__file__).parents[3] / "docs" / "sample"
    changed = shutil.copytree(sample, tmp_path_factory.mktemp("changed") / "exports")
    data = bytearray((changed / "design.json").read_bytes())
    data[len(data) // 2] ^= 1  # one bit: the size is right
    (changed / "design.json").write_bytes(data)
    names = ("RECORD", "EXPORT", "SAMPLE", "CHANGED", "KNOT", "FIELD", "BALL")
    every = (record, export_with_wind_up, sample, changed, captured, field, ball)
    return dict(zip(names, map(str, every), strict=True))


@pytest.mark.parametrize("case", CASES.strip().splitlines())
def test_one_line_says_why_and_nothing_is_written(
    case: str,
    folders: dict[str, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in GIVEN.items():
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).write_text(text, encoding="utf-8")
    os.link(Path(folders["BALL"]) / "lightfield.h5", "lightfield.npz")
    words, _, said = case.partition(" | ")
    for name, folder in folders.items():
        words = words.replace(name, shlex.quote(folder))
    before = {path: sorted(os.listdir(path)) for path in (".", *folders.values())}
    assert run(shlex.split(words)) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.splitlines()[-1].startswith("tbcad: ")
    assert said in shown.err.splitlines()[-1]
    assert "Traceback" not in shown.err
    assert {path: sorted(os.listdir(path)) for path in (".", *folders.values())} == before
