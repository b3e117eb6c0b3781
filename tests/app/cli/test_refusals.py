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
# a whole build, KNOT a capture, FIELD one with a field beside it, BALL one of two frames.
CASES = """
build --n 99 | optics.n is 99, allowed is a whole number from 2 to 60
build --n 1 | no camera sees
build --set optics.nn=3 | unknown key optics.nn: did you mean optics.n
build --set wall_mm=-1 | shell.wall_mm is -1
build --parts shel | shell, prototype
build --parts prototype --radius-rule flat | radius_rule
build no-such-design.toml | no-such-design.toml
build --yield 0.95 | leave --yield out
build --for-process cnc --yield 95 | below 1
build --set semi_minor_mm=31 --set capture_diameter_mm=60 | make
build --parts shell --no-verify --full | leave --no-verify out
build --full --json | exclude each other
verify x -q --full | exclude each other
verify no-such-folder | no-such-folder
run SAMPLE --json | --json is about --dry-run
picture . --of cat | exploded
picture SAMPLE --of rig | prototype.json is missing
report SAMPLE --out report.pdf | name a .html file
report SAMPLE --out nowhere/report.html | in a folder that exists
drawings . | name a folder that tbcad build wrote
drawings RECORD | manifest.json is missing or no manifest
drawings SAMPLE --only optical_lay | optical_layout
init | FILE is missing
init . | is a folder
init no/such/folder.toml | cannot be written
init my.toml --from turtle | allowed is one of turtleback, afternoon-print
init my.toml --json | --json is about --list
optimize --for beauty | --for is 'beauty', allowed is one of minimum
optimize --max-size-mm -1 | --max-size-mm is -1, allowed is more than 0
tolerance . | design.json is not there: name a folder that tbcad build wrote
tolerance RECORD --process slaa | did you mean sla?
tolerance RECORD --yield 2 | --yield 2
tolerance RECORD --builds 1 | --builds 1: allowed is 10 to
tolerance RECORD --set nonsense | 'nonsense' is not kind=value
tolerance RECORD --set nonsense=3 | unknown key nonsense
tolerance RECORD --scheduler tcp://127.0.0.1:9 | --scheduler tcp://127.0.0.1:9: no Dask scheduler
tolerance RECORD --unit cm | give --object too, or leave them out
capture RECORD --unit cm | give --object too, or leave them out
capture RECORD --mesh | shell_a.stl
capture RECORD --prototype | prototype.json
capture RECORD --mesh --prototype | exclude each other
capture RECORD --frames 2 --samples 2 | leave out --samples
capture RECORD --object absent.ply | absent.ply
capture RECORD --lights none.csv | has no lamps
capture RECORD --lights inside.csv | inside.csv, line 2: a lamp in the capture sphere
capture RECORD --lights named.csv | x_mm
capture RECORD --lights lamps.csv --samples 2 | leave out --samples
capture RECORD --lights lamps.csv --every 2 | --every chooses
capture RECORD --lights projectors --prototype | leave out --prototype
view KNOT --elevation -3 | --elevation -3
view KNOT --distance 10 | --distance 10
view KNOT --out view.jpg | .png
view KNOT --method nearest --depth d.png | add --method depth
view KNOT --method nearest --surface depth | leave out --surface depth
view KNOT --method depth --surface object | leave out --surface object
view KNOT --method depth --depth d.gif | ends in .png or .ply
view KNOT --method depth --depth view.png | choose another name
view KNOT --light sky.hdr | capture again with --lights
view KNOT --light-turn 9 | add --light
view KNOT --method field | no such file; write it with `tbcad reconstruct`
view BALL --frame 4 | allowed is 0 to 1
view BALL --frame 1 --surface object | leave out --light and --surface
view FIELD --method field --surface plane | leave out --surface plane
view FIELD --method field --light sky.hdr | a field has its own light
view FIELD --method depth --normals n.png | only a field has that
view FIELD --opacity o.jpg | name a file that ends in .png
view FIELD --opacity o.png --normals o.png | another file of this command
refocus KNOT --aperture -1 | --aperture -1
show KNOT --no-open --elevation 100 | elevation 100 is not allowed: 0 to 90
show KNOT --no-open --width 4000 | width 4000 is not allowed: 16 to 2048
show KNOT --turntable knot.png | knot.png: give a file that ends in .html
show KNOT --turntable none/knot.html | in a folder that exists
show RECORD | no such file; write it with `tbcad report
show . | has neither report.html nor lightfield.h5: give a folder
show . --turntable t.html | no such file; --turntable is for a light field
export KNOT | --to
export KNOT --to rays --size 64 | as it was captured
export KNOT --to colmap --size 4096 | GiB
export KNOT --to colmap --cameras c0001 | no virtual camera
export KNOT --to rays --exports RECORD | leave it out
export KNOT --to mitsuba | give its folder by --exports
export KNOT --to mitsuba --exports RECORD --size 8 | leave out --size
export KNOT --to mitsuba --exports RECORD | shell_a.stl
export . --to colmap | lightfield.h5: no such file
reconstruct BALL --out field.txt | field.txt: name a file that ends in .npz
reconstruct BALL --out none/field.npz | field.npz: its folder does not exist
reconstruct BALL --out lightfield.npz | lightfield.npz is read by this command
reconstruct BALL --out BALL/object.npz --force | object.npz belongs to
reconstruct BALL --mesh a.obj | a.obj: name a file that ends in .glb or .ply or .stl
reconstruct BALL --mesh a.ply --mesh ./a.ply | is named twice
reconstruct BALL --volume a.vdb | a.vdb: name a file that ends in .vti
reconstruct BALL --preview a.jpg | a.jpg: name a file that ends in .png
reconstruct BALL --rays 12 | a pixel of this light field is a single ray: leave it out
reconstruct BALL --blur 0.4 | --blur 0.4 is for several rays a pixel: add --rays 12
reconstruct BALL --frame 2 | --frame 2 is not in the sequence: allowed is 0 to 1
reconstruct BALL --frame 0 --all-frames | --frame and --all-frames exclude each other
reconstruct BALL --resume --force | --force and --resume exclude each other
simulate-run EXPORT --bits 12 | --bits 12 is not written: allowed is 8 or 16
simulate-run EXPORT --stops 1-x | --stops '1-x'
simulate-run EXPORT --object no.ply | no.ply: no such file
simulate-run EXPORT --stops 999 | stop 999 is not in the plan: allowed is 1 to
simulate-run EXPORT --phases led_7 | phase led_7 is not photographed
study resolution --sensor 12 | 2080x1552
study resolution --from 9 --to 3 | --from or --to
study capture-area --to 61 | --from or --to
study elevation --set optics.m=3 | optics.m
study depth-of-field --blur-px 0 | blur-px
study low-pass RECORD --filter-px 0 | filter-px
study prototype RECORD --unit cm | give --object too, or leave them out
study ssim --sensor abc | 2080x1552
study ssim --azimuths 0 | --azimuths 0
study balance --n 1 | --n is 1
"""
LAMP = "x_mm,y_mm,z_mm\n"
GIVEN = {
    "none.csv": LAMP,
    "inside.csv": LAMP + "1,2,3\n",
    "named.csv": "x,y,z\n1,2,300\n",
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
    names = ("RECORD", "EXPORT", "SAMPLE", "KNOT", "FIELD", "BALL")
    every = (record, export_with_wind_up, sample, captured, field, ball)
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
        (tmp_path / name).write_text(text, encoding="utf-8")
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
