"""tbcad show from the command line."""

import json
import re
import shutil
import signal
import subprocess
import sys
import webbrowser
from http.client import HTTPConnection
from pathlib import Path

import numpy as np
import pytest

import tbcad
from tbcad.output.manifest import REPORT_BEGIN
from tests.app.cli.commands import Command
from tests.exported_files import contents, read_csv


def test_a_report_is_opened_or_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cli: Command
) -> None:
    opened, page = list[str](), tmp_path / "report.html"
    page.write_text(REPORT_BEGIN + "<p>", encoding="utf-8")
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or True)
    assert cli("show", tmp_path).out == f"{page}\n"
    assert opened == [page.as_uri()]
    assert json.loads(cli("show", tmp_path, "--no-open", "--json").out) == {"report": str(page)}
    assert len(opened) == 1
    monkeypatch.setattr(webbrowser, "open", lambda _: False)
    assert "no browser was found: open this address in one" in cli("show", tmp_path).err


def test_a_turntable_is_written_and_not_replaced(
    captured: Path, tmp_path: Path, cli: Command
) -> None:
    file = tmp_path / "knot.html"
    words = ["show", captured, "--turntable", file, "--frames", "4", "--rows", "2"]
    words += ["--width", "64", "--height", "48"]
    told = json.loads(cli(*words, "--json").out)
    assert told == {"turntable": str(file), "bytes": file.stat().st_size, "views": 8}
    assert "exists" in cli(*words, code=2).err
    assert "8 views by method depth, 0.0 MB" in cli(*words, "--force").out


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent otherwise")
def test_a_light_field_is_served_until_ctrl_c(captured: Path) -> None:
    words = [sys.executable, "-m", "tbcad", "show", str(captured), "--no-open"]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    ) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.fullmatch(
            r"http://127\.0\.0\.1:(\d+)(/[\w-]+/) shows .*; Ctrl-C ends it\n", line
        )
        assert found, line
        connection = HTTPConnection("127.0.0.1", int(found[1]), timeout=60)
        connection.request("GET", f"{found[2]}view?width=64&height=48")
        assert connection.getresponse().read().startswith(b"\xff\xd8")
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=60)
    assert (process.returncode, out) == (0, "")
    assert error.splitlines()[1:] == ["ended"]  # after the one stage


@pytest.mark.parametrize("target", ["nerfstudio", "colmap", "ngp-rays", "rays"])
def test_the_same_bytes_again(captured: Path, tmp_path: Path, target: str, cli: Command) -> None:
    for name in ("one", "other", "one"):  # replaced, folders and all
        cli("dataset", captured, "--to", target, "--every", "20", "--out", tmp_path / name)
    assert contents(tmp_path / "one") == contents(tmp_path / "other")
    listed = json.loads((tmp_path / "one" / "manifest.json").read_text())["files"]
    assert listed.keys() | {"manifest.json"} == contents(tmp_path / "one").keys()


def test_prints_what_is_in_the_record(captured: Path, tmp_path: Path, cli: Command) -> None:
    out = tmp_path / "data"
    export = ["dataset", captured, "--to", "colmap", "--every", "9", "--size", "48", "--out", out]
    record = json.loads(cli(*export, "--json").out)
    assert record == json.loads((out / "dataset.json").read_text())
    assert record["size_px"] == 48
    rows = read_csv(out / "cameras.csv")
    assert len(rows) == record["virtual_cameras"]
    for column, name in (
        ("rms_mm", "rms_distance_from_common_point_mm"),
        ("worst_mm", "worst_distance_from_common_point_mm"),
        ("central_error_mm", "central_error_at_capture_radius_mm"),
        ("pitch_mm", "pixel_pitch_mm"),
    ):
        values = np.array([float(row[column]) for row in rows])
        figures = record["fit"][name]
        assert [np.median(values), values.max()] == pytest.approx([*figures.values()], abs=1e-5)
    said = cli(*export).out
    assert said.startswith(f"{len(rows)} virtual cameras, 48 x 48 pixels each\n")
    assert f"{record['reprojection_error_px']['median']:.3f} pixels (median)" in said


def test_reprojection_falls_with_the_error_of_the_pinhole(captured: Path, tmp_path: Path) -> None:
    """A point in the sphere is off by at most the central error, in pixels of the picture."""
    figures = tbcad.dataset(captured, "nerfstudio", out=tmp_path / "data", every=5, size=60)
    most = figures["fit"]["central_error_at_capture_radius_mm"]["max"]
    errors = figures["reprojection_error_px"]
    assert 0 < errors["median"] < errors["percentile_95"] < 2 * most  # pixels are 1 mm or so
    fine = tbcad.dataset(captured, "nerfstudio", out=tmp_path / "fine", every=5, size=120)
    ratio = fine["reprojection_error_px"]["median"] / errors["median"]
    assert ratio == pytest.approx(2, rel=1e-3)


def test_real_captures_come_without_the_object(captured: Path, tmp_path: Path) -> None:
    real = tmp_path / "real"
    shutil.copytree(captured, real)
    (real / "object.npz").unlink()
    figures = tbcad.dataset(real, "nerfstudio", out=tmp_path / "data", cameras="a", every=10)
    assert "reprojection_error_px" not in figures
    names = [path.stem for path in (tmp_path / "data" / "images").iterdir()]
    assert names
    assert all(name.startswith("a") for name in names)
    by_file = tbcad.dataset(
        real / "lightfield.h5", "nerfstudio", out=tmp_path / "file", cameras="a", every=10
    )
    assert by_file == figures


def test_captures_by_the_prototype(export_folder: Path, tmp_path: Path, cli: Command) -> None:
    """Both write the same kind of light field, in which a mirror may have no pixels."""
    cli("capture", export_folder, "--out", tmp_path / "balls", "--prototype")
    cli("capture", export_folder, "--out", tmp_path / "shell")
    balls, shell = (
        tbcad.dataset(tmp_path / name, "colmap", out=tmp_path / f"{name}-data", cameras="a")
        for name in ("balls", "shell")
    )
    assert balls["capture"]["geometry"] == "prototype"
    expected = shell["virtual_cameras"]
    assert balls["virtual_cameras"] + len(balls["left_out"]) == expected
    assert balls["virtual_cameras"] > 0.8 * expected
    errors, others = (one["fit"]["central_error_at_capture_radius_mm"] for one in (balls, shell))
    assert 0 < errors["median"] < 2 * others["median"]
    assert balls["reprojection_error_px"]["median"] < 1
