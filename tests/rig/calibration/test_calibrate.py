"""A random build by fused filament, recovered from its highlights, and the files of that."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

import tbcad.rig.calibration.run
from tbcad.app.cli import run as command
from tbcad.common.screen import WIDTH
from tbcad.errors import InputError
from tbcad.records.exposure import DARK, exposure_name
from tbcad.rig.calibration.calibrate import MachineCalibration, Setup, calibrate, prepared_setup
from tbcad.rig.calibration.detection.detection import Detection
from tbcad.rig.calibration.estimate.jacobian import base_slopes
from tbcad.rig.calibration.estimate.parameters import covariance
from tbcad.rig.calibration.estimate.solve import Estimate, estimate
from tbcad.rig.calibration.report.files import write_calibration
from tbcad.rig.calibration.report.record import rays_table, residuals_table
from tbcad.rig.calibration.report.recovered import at_plane, centre_pixels, traced
from tbcad.rig.calibration.report.verdict import Answer, verdict, verdict_text
from tbcad.rig.machine.built import BuiltPrototype, random_build
from tbcad.rig.machine.machine import TRUTH, Machine, read_machine, write_machine
from tbcad.rig.runs import Run
from tests.photographed_runs import write_run
from tests.rig.calibration.conftest import ERRORS, FAULT
from tests.rig.calibration.machines import every_highlight

BUILDS = 12
FILES = {
    "angles.csv",
    "calibration.json",
    "covariance.npz",
    "machine.json",
    "manifest.json",
    "rays.csv",
    "rays.png",
    "residual_distribution.png",
    "residuals.csv",
    "residuals.png",
    "spheres.csv",
    "spheres.png",
}


def _off(found: Estimate, true: Machine) -> np.ndarray:
    """Errors of centres and radii, (k, 4)."""
    machine = found.machine
    return np.column_stack([machine.centre - true.centre, machine.radius - true.radius])


def test_injected_errors_are_recovered(
    calibrated: MachineCalibration, built: BuiltPrototype
) -> None:
    """Spheres are off together as their covariance says, and rays as far as predicted."""
    found = calibrated.found
    slopes = base_slopes(found.prior, found.values).matrix(found.prior).toarray()
    spread = slopes @ np.linalg.inv(found.information.toarray()) @ slopes.T
    off = _off(found, built.machine).ravel()
    assert off @ np.linalg.solve(spread, off) < chi2.ppf(0.999, len(off))
    known = calibrated.rays.known
    pixel = centre_pixels(found.machine, known.frame, known.sphere)
    missed = at_plane(*traced(built.machine, pixel, known.frame, known.sphere), known.direction)
    ratio = np.sqrt((missed**2).sum(axis=1).mean() / (known.whole.place_mm**2).mean())
    assert ratio < 2


@pytest.mark.slow
def test_most_figures_are_within_two_deviations(setup: Setup) -> None:
    """Builds of the process, not drawn from the prior: each shares errors among its balls."""
    inside = []
    for seed in range(BUILDS):
        machine, plan, still = setup.designed, setup.plan, np.zeros(len(setup.plan.angle))
        true = random_build(machine, plan, ERRORS, seed=100 + seed, wind_up=still).machine
        found = estimate(setup.prior(ERRORS), every_highlight(true, seed))
        known = covariance(found.prior, found.information)
        slopes = base_slopes(found.prior, found.values).matrix(found.prior)
        sigma = np.sqrt(np.diagonal(known.of(slopes, 4), axis1=1, axis2=2))
        inside.append(np.abs(_off(found, true)) < 2 * sigma)
    assert np.mean(inside) >= 0.93


def test_verdict_comes_first_and_fits_the_screen(calibrated: MachineCalibration) -> None:
    judged = verdict(calibrated)
    lines = verdict_text(calibrated, judged).splitlines()
    assert judged.answer is Answer.GOOD
    assert lines[0].startswith("good: rays at the object are known to")
    assert max(map(len, lines)) <= WIDTH
    assert any(FAULT in line for line in lines)


def test_outliers_are_named(setup: Setup, detection: Detection) -> None:
    h, wrong = detection.highlights, 17
    pixel = h.pixel.copy()
    pixel[wrong] += 30
    result = calibrate(
        setup, replace(detection, highlights=replace(h, pixel=pixel)), setup.prior(ERRORS)
    )
    name = exposure_name(setup.frames[h.frame[wrong]], f"led_{h.led[wrong] + 1}")
    text = " ".join(verdict_text(result, verdict(result)).split())
    assert f"left out (1): {name} ball {h.sphere[wrong] + 1} " in text
    rows = residuals_table(result).records()
    assert [row["photograph"] for row in rows if not row["used"]] == [name]


def test_a_machine_that_is_not_that_of_the_model_is_doubted(
    setup: Setup, detection: Detection
) -> None:
    """A ball that slips between both runs: no state of the machine explains both."""
    h = detection.highlights
    second = h.frame >= len(setup.frames) // 2
    pixel = h.pixel + np.where((second & (h.sphere % 2 == 0))[:, None], [0.6, -0.4], 0.0)
    slipped = replace(detection, highlights=replace(h, pixel=pixel))
    result = calibrate(setup, slipped, setup.prior(ERRORS))
    judged = verdict(result)
    assert judged.answer is not Answer.GOOD
    assert judged.doubts


def test_a_few_noisy_highlights_are_not_enough(setup: Setup, detection: Detection) -> None:
    """What the process leaves open stays open, and is said in the verdict."""
    h = detection.highlights
    few = np.arange(0, len(h), 60)
    noisy = replace(
        h,
        **{name: getattr(h, name)[few] for name in ("frame", "sphere", "led", "pixel")},
        sigma=np.full(len(few), 20.0),
    )
    errors = replace(ERRORS, seat=replace(ERRORS.seat, spread=3.0))
    result = calibrate(setup, replace(detection, highlights=noisy), setup.prior(errors))
    judged = verdict(result)
    assert judged.answer is Answer.NOT_GOOD
    assert any("--measured" in step for step in judged.steps)


BASIS = {
    **{"run": "run", "exports": "exports", "export_sha256": {}, "source": "camera"},
    **{"geometry": "prototype", "camera": "test", "lens": "estimated", "measured_radii": []},
    "photographs": {"expected": 1, "usable": 1},
    "process": {"name": "fdm", "title": "FDM", "given": False, "settings": []},
}


def test_files_are_the_same_each_time(calibrated: MachineCalibration, tmp_path: Path) -> None:
    judged = verdict(calibrated)
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_calibration(tmp_path / name, calibrated, judged, BASIS)
    assert {file.name for file in (tmp_path / "one").iterdir()} == FILES
    for name in FILES:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    machine, frames = read_machine(tmp_path / "one" / "machine.json")
    assert machine.centre == pytest.approx(calibrated.found.machine.centre, abs=0)
    assert frames == calibrated.setup.frames
    record = json.loads((tmp_path / "one" / "calibration.json").read_text())
    assert record["faults"] == [FAULT]
    assert record["rays"]["mirrors"] == len(rays_table(calibrated).rows)
    with np.load(tmp_path / "one" / "covariance.npz") as stored:
        assert stored["sphere"].shape == (len(machine.radius), 4, 4)
        assert len(stored["parameter"]) == len(calibrated.found.values)


def test_frames_that_are_not_photographed_are_missing_mirrors(setup: Setup) -> None:
    half = tuple(frame for frame in setup.frames if frame.object_turn_deg == 0)
    size = setup.designed.camera.width_px, setup.designed.camera.height_px
    again = prepared_setup(setup.export, half, size, None)
    seen = Detection(every_highlight(again.designed, 1), (), ())
    result = calibrate(again, seen, again.prior(ERRORS))
    assert {name[0] for name in result.rays.ids} == {"a"}
    assert {name[0] for name in result.rays.absent} == {"b"}


def test_another_size_of_photographs(setup: Setup) -> None:
    with pytest.raises(InputError, match="the run's photographs have 640 x 480"):
        prepared_setup(setup.export, setup.frames, (640, 480), None)


@pytest.fixture(scope="module")
def run_folder(setup: Setup, tmp_path_factory: pytest.TempPathFactory) -> Path:
    camera = setup.designed.camera
    picture = np.zeros((camera.height_px, camera.width_px, 3), np.uint8)
    frames = setup.frames
    names = [exposure_name(frame, "lit") for frame in frames]
    folder = tmp_path_factory.mktemp("runs") / "first"
    return write_run(folder, setup.export, frames, dict.fromkeys(names, picture), (DARK,))


def test_command(
    setup: Setup,
    detection: Detection,
    run_folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def found(run: Run, *_: object, **__: object) -> Detection:
        assert len(run.exposures) == len(setup.frames)
        return detection

    monkeypatch.setattr(tbcad.rig.calibration.run, "detect", found)
    out = tmp_path / "calibration"
    words = ["calibrate", str(run_folder), "--exports", str(setup.export.folder), "--out", str(out)]
    assert command(words) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("good: ")
    assert "process: fdm (the default)" in printed
    record = json.loads((out / "calibration.json").read_text())
    assert record["exports"] == str(setup.export.folder.resolve())
    assert record["process"]["name"] == "fdm"
    assert record["photographs"]["usable"] == len(setup.frames)
    assert command([*words, "--force", "--measured", "9=20"]) == 2
    assert re.search("allowed is ball 1 to 5", capsys.readouterr().err)
    assert {file.name for file in out.iterdir()} == FILES


def test_a_simulated_run_is_compared_with_its_build(
    setup: Setup,
    detection: Detection,
    built: BuiltPrototype,
    run_folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(tbcad.rig.calibration.run, "detect", lambda *_, **__: detection)
    run, out = Path(shutil.copytree(run_folder, tmp_path / "run")), tmp_path / "calibration"
    record = json.loads((run / "run.json").read_text())
    (run / "run.json").write_text(json.dumps({**record, "source": "simulated"}))
    write_machine(run / TRUTH, built.machine, setup.frames)
    words = ["calibrate", str(run), "--exports", str(setup.export.folder), "--out", str(out)]
    words += ["--format", "svg"]
    assert command(words) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert re.search(r"of \d+ errors that were simulated, (9\d|100)% are recovered", printed)
    files = {name.replace(".png", ".svg") for name in FILES | {"recovered.csv", "recovered.png"}}
    assert {file.name for file in out.iterdir()} == files
    assert all(file.read_text().startswith("<?xml") for file in out.glob("*.svg"))
    write_machine(run / TRUTH, built.machine, setup.frames[::-1])
    assert command(words) == 2
    assert "is a calibration already" in capsys.readouterr().err
    assert command([*words, "--force"]) == 2
    assert "truth.json is of another run" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere"], "name a folder that tbcad run or simulate-run wrote"),
        (["RUN", "--process", "casting"], "neither built in"),
        (["RUN", "--intrinsics", "none.yml"], "no such file"),
    ],
)
def test_refused(
    words: list[str],
    message: str,
    setup: Setup,
    run_folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    named = [str(run_folder) if word == "RUN" else word for word in words]
    out = tmp_path / "calibration"
    exports = ["--exports", str(setup.export.folder), "--out", str(out)]
    assert command(["calibrate", *named, *exports]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not out.exists()
