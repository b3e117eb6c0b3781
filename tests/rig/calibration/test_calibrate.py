"""A random build by fused filament, recovered from its highlights, and the files of that."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

import tbcad.rig.calibration.run
from tbcad.app.cli import run as command
from tbcad.common.screen import WIDTH
from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import unit
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.prototype.stage.leds import MIN_SEEN
from tbcad.records.calibration import HalvesRecord
from tbcad.records.run import DARK, exposure_name
from tbcad.rig.calibration.calibrate import (
    MachineCalibration,
    Setup,
    calibrate,
    cross_validation,
    prepared_setup,
    unbiased_estimate,
)
from tbcad.rig.calibration.detection.detection import Detection
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.estimate.solve import estimate
from tbcad.rig.calibration.led_layout import (
    best_layout,
    layout_cost,
    led_room,
    shell_information,
    with_partners,
)
from tbcad.rig.calibration.report.record import (
    angles_table,
    rays_table,
    residuals_table,
    spheres_table,
)
from tbcad.rig.calibration.report.recovered import (
    BESIDES,
    Kind,
    place_mm,
    ray_errors,
    recovered_errors,
    turn_mrad,
)
from tbcad.rig.calibration.report.verdict import Answer, verdict, verdict_text
from tbcad.rig.calibration.run import write_calibration
from tbcad.rig.calibration.study import whole_errors
from tbcad.rig.calibration.uncertainty import RayCovariance
from tbcad.rig.machine.designed import BuiltPrototype
from tbcad.rig.machine.machine import TRUTH, Highlights, read_machine, write_machine
from tests.photographed_runs import write_run
from tests.rig.calibration.conftest import ERRORS, FAULT
from tests.rig.calibration.machines import drawn, every_highlight

AXES = ("x", "y", "z")


@pytest.fixture(scope="module")
def kinds(calibrated: MachineCalibration, built: BuiltPrototype) -> tuple[Kind, ...]:
    return recovered_errors(calibrated, built.machine)


def _named(kinds: tuple[Kind, ...], name: str) -> Kind:
    return next(kind for kind in kinds if kind.name == name)


def test_centres_and_angles_are_those_of_the_tables(
    kinds: tuple[Kind, ...],
    calibrated: MachineCalibration,
    built: BuiltPrototype,
) -> None:
    assert len(kinds) == 11
    rows, centres = spheres_table(calibrated).records(), _named(kinds, "centres")
    for figure, name in (("recovered", "difference"), ("sigma", "sigma")):
        expected = [1000 * float(row[f"{name}_{axis}_mm"] or 0) for row in rows for axis in AXES]
        assert getattr(centres, figure) == pytest.approx(expected, rel=1e-6)
    off = built.machine.centre - calibrated.setup.designed.centre
    assert centres.injected == pytest.approx(1000 * off.ravel())
    angles, table = _named(kinds, "base angles"), angles_table(calibrated)
    assert angles.recovered == pytest.approx(table.column("difference_deg"))
    assert angles.sigma == pytest.approx(table.column("sigma_deg"))


def test_a_motion_and_growth_of_all_centres_is_taken_off(
    calibrated: MachineCalibration, built: BuiltPrototype
) -> None:
    """A build that is moved, turned and larger has other errors, but not besides that."""
    true = built.machine
    turn = unit(np.array([1.0, 2.0, 3.0]))
    centre = 1.001 * rotated(true.centre, turn, np.full(len(true.centre), 1e-4)) + [0.1, 0.2, 0.0]
    one, other = (
        recovered_errors(calibrated, machine) for machine in (true, replace(true, centre=centre))
    )
    assert np.abs(_named(one, "centres").injected - _named(other, "centres").injected).max() > 100
    rest = _named(one, BESIDES).injected
    assert _named(other, BESIDES).injected == pytest.approx(rest, abs=0.5)
    assert np.abs(rest).max() > 10


def test_errors_of_rays_are_those_predicted(
    calibrated: MachineCalibration, built: BuiltPrototype
) -> None:
    rays = calibrated.rays.known
    relative, in_run = ray_errors(calibrated.found, built.machine, rays.frame, rays.sphere)
    for found, place, turn in (
        (relative, rays.relative.place_mm, rays.relative.turn_mrad),
        (in_run, rays.in_run.place_mm, rays.in_run.turn_mrad),
    ):
        for off, sigma in ((place_mm(found), place), (turn_mrad(found), turn)):
            assert np.sqrt((off**2).mean()) < 3 * np.sqrt((sigma**2).mean())


def test_rays_that_a_motion_fits_wholly_have_no_error() -> None:
    """Those of one stop are so few: their variances are zero but for rounding, of either sign."""
    rays = RayCovariance(np.diag([-1e-20, 1e-21, -1e-22, 0.0])[None])
    assert rays.place_mm == pytest.approx([0.0], abs=1e-12)
    assert rays.turn_mrad.tolist() == [0.0]


@pytest.mark.slow
def test_errors_of_many_machines_are_normal(calibrated: MachineCalibration) -> None:
    """Machines drawn from the prior: every kind's errors, in their deviations, are as wide as 1.

    Figures of one machine share errors, so a kind's mean square varies as that of a few figures.
    """
    squares: dict[str, list[float]] = {}
    within: list[float] = []
    for seed in range(MACHINES):
        prior = calibrated.found.prior
        true = drawn(prior, 300 + seed)[1]
        found = estimate(prior, every_highlight(true, seed))
        for kind in recovered_errors(replace(calibrated, found=found), true):
            squares.setdefault(kind.name, []).append(float((kind.sigmas_off**2).mean()))
            within.append(kind.within)
    low, high = chi2.ppf([1e-4, 1 - 1e-4], MACHINES) / MACHINES
    for name, values in squares.items():
        assert low < np.mean(values) < high, name
    assert np.mean(within) == pytest.approx(0.954, abs=0.05)


BASIS = (
    *("run", "exports", "export_sha256", "source", "geometry", "camera"),
    *("photographs", "process", "lens", "measured_radii"),
)
NOISE_PX, SIGMA_MM = 0.05, 0.025
BUILDS = 3
MACHINES = 6  # of two of which a run shows halves


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


def test_a_slipped_ball_is_doubted(setup: Setup, detection: Detection) -> None:
    """Between both runs: no state of the machine explains both."""
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
    few = h.only(np.arange(0, len(h), 60))
    noisy = replace(few, sigma=np.full(len(few), 20.0))
    errors = replace(ERRORS, seat=replace(ERRORS.seat, spread=3.0))
    result = calibrate(setup, replace(detection, highlights=noisy), setup.prior(errors))
    judged = verdict(result)
    assert judged.answer is Answer.NOT_GOOD
    assert any("--measured" in step for step in judged.steps)


def test_frames_that_are_not_photographed_are_missing_mirrors(setup: Setup) -> None:
    half = tuple(frame for frame in setup.frames if frame.object_turn_deg == 0)
    size = setup.designed.camera.width_px, setup.designed.camera.height_px
    again = prepared_setup(setup.export, half, size, None)
    seen = Detection(every_highlight(again.designed, 1), {}, ())
    result = calibrate(again, seen, again.prior(ERRORS))
    assert {name[0] for name in result.rays.ids} == {"a"}
    assert {name[0] for name in result.rays.absent} == {"b"}


def test_what_sampling_adds_is_found_and_taken_off(setup: Setup, detection: Detection) -> None:
    """Of a lens that passes 0.4 of lines of a cycle a pixel."""
    prior, whole = setup.prior(ERRORS), detection.highlights
    shift = 0.03 * np.sin(2 * np.pi * whole.pixel)
    off = replace(whole, pixel=whole.pixel + 0.4 * shift)
    found = unbiased_estimate(prior, replace(detection, highlights=off, sampling=shift))
    assert found.highlights.pixel == pytest.approx(whole.pixel, abs=2e-3)


def test_another_size_of_photographs(setup: Setup) -> None:
    with pytest.raises(InputError, match="the run's photographs have 640 x 480"):
        prepared_setup(setup.export, setup.frames, (640, 480), None)


@pytest.fixture(scope="module")
def run_folder(
    setup: Setup, built: BuiltPrototype, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A run that is said to be simulated, with the machine that took it."""
    camera = setup.designed.camera
    picture = np.zeros((camera.height_px, camera.width_px, 3), np.uint8)
    names = [exposure_name(frame, "lit") for frame in setup.frames]
    folder = tmp_path_factory.mktemp("runs") / "first"
    write_run(folder, setup.export, setup.frames, dict.fromkeys(names, picture), (DARK,))
    write_machine(folder / TRUTH, built.machine, setup.frames)
    return folder


def test_command_and_its_files(
    calibrated: MachineCalibration,
    detection: Detection,
    run_folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The build is recovered; the same calibration gives the same files."""
    setup, out = calibrated.setup, tmp_path / "calibration"
    monkeypatch.setattr(tbcad.rig.calibration.run, "detect", lambda *_, **__: detection)
    exports = ("--exports", str(setup.export.folder), "--out", str(out))
    words = ["calibrate", str(run_folder), *exports]
    assert command(words) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert printed.startswith("good: ")
    assert "process: fdm (the default)" in printed
    assert re.search(r"of \d+ errors that were simulated, (9\d|100)% are recovered", printed)
    record = json.loads((out / "calibration.json").read_text())
    assert record["exports"] == str(setup.export.folder.resolve())
    assert (record["process"]["name"], record["faults"]) == ("fdm", [FAULT])
    assert record["photographs"]["usable"] == len(setup.frames)
    assert record["rays"]["mirrors"] == len(rays_table(calibrated).rows)
    machine, frames = read_machine(out / "machine.json")
    assert machine.centre == pytest.approx(calibrated.found.machine.centre, abs=0)
    assert frames == setup.frames
    with np.load(out / "covariance.npz") as stored:
        assert stored["sphere"].shape == (len(machine.radius), 4, 4)
        assert len(stored["parameter"]) == len(calibrated.found.values)

    again = tmp_path / "again"
    again.mkdir()
    basis = {key: record[key] for key in BASIS}
    write_calibration(again, calibrated, verdict(calibrated), basis)
    files = {file.name for file in out.iterdir()} - {"recovered.csv", "recovered.svg"}
    assert {file.name for file in again.iterdir()} == files
    for name in files - {"manifest.json"}:
        assert (again / name).read_bytes() == (out / name).read_bytes(), name

    assert command([*words, "--force", "--measured", "9=20"]) == 2
    assert "allowed is ball 1 to 5" in capsys.readouterr().err
    write_machine(run_folder / TRUTH, calibrated.found.machine, setup.frames[::-1])
    for more, message in (((), "is a calibration already"), (("--force",), "of another run")):
        assert command([*words, *more]) == 2
        assert message in capsys.readouterr().err


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
    assert command(["calibrate", *named, "--exports", str(setup.export.folder), "--out", str(out)])
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not out.exists()


def test_best_layout_beats_others_and_keeps_to_the_room(export: ExportedDesign) -> None:
    room = led_room(export)
    places = room.places()
    information = shell_information(export, with_partners(places))
    best = best_layout(room, places, 4, lambda leds: layout_cost(information, leds))
    leds = with_partners(places)[best]
    assert np.sort(leds, axis=0) == pytest.approx(np.sort(leds * [-1, -1, 1], axis=0), abs=1e-9)
    assert (np.linalg.norm(leds, axis=1) <= room.outer).all()
    assert (np.hypot(leds[:, 0], leds[:, 1]) >= room.inner - 0.01).all()
    apart = np.linalg.norm(leds[:, None, :2] - leds[None, :, :2], axis=2)
    assert apart[np.triu_indices(4, 1)].min() >= room.apart
    cost = layout_cost(information, best)
    rng, p = np.random.default_rng(1), len(places)
    tried = [rng.choice(p, 2, replace=False) for _ in range(30)]
    fitting = [[*pair, *(pair + p)] for pair in tried if room.fits(places, [pair[0]], pair[1])]
    assert len(fitting) >= MIN_SEEN
    assert all(cost <= layout_cost(information, other) for other in fitting)


def test_less_noise_and_a_better_process_bound_rays_closer(setup: Setup) -> None:
    leds = setup.designed.leds
    usual = np.median(whole_errors(setup, leds, "fdm", 0.1).relative.place_mm)
    assert np.median(whole_errors(setup, leds, "fdm", 0.05).relative.place_mm) < usual
    assert np.median(whole_errors(setup, leds, "cnc", 0.1).relative.place_mm) < usual


def _halves(prior: Prior, highlights: Highlights) -> tuple[HalvesRecord, ...]:
    frame, sphere = np.zeros(len(prior.mean.radius), dtype=np.int64), np.arange(5)
    return cross_validation(estimate(prior, highlights), frame, sphere, lambda _: None)


def test_halves_differ_by_what_their_covariances_say(prior: Prior) -> None:
    """Mean squares over several machines: a handful of shared errors make each one vary."""
    ratios: dict[str, list[float]] = {}
    for seed in range(BUILDS):
        for half in _halves(prior, every_highlight(drawn(prior, seed)[1], 50 + seed)):
            ratios.setdefault(half.apart, []).append(half.ratio**2)
    assert set(ratios) == {"angles", "LEDs"}
    assert all(0.2 < np.mean(squares) < 3 for squares in ratios.values())


def _of_two_machines(one: Highlights, other: Highlights) -> Highlights:
    """Every other frame as the other machine shows it, where it has the same highlight."""
    places = zip(other.frame, other.led, other.sphere, strict=True)
    pixel, shown = one.pixel.copy(), dict(zip(places, other.pixel, strict=True))
    for k, place in enumerate(zip(one.frame, one.led, one.sphere, strict=True)):
        if place[0] % 2 == 0:
            pixel[k] = shown.get(place, pixel[k])
    return replace(one, pixel=pixel)


def test_halves_that_contradict_each_other_are_seen(prior: Prior) -> None:
    """The median over machines: the power of the flattest cap alone may differ by more."""
    grown = []
    for seed in range(MACHINES):
        one, other = (every_highlight(drawn(prior, s)[1], 2) for s in (seed, seed + 20))
        right, found = (_halves(prior, h)[0] for h in (one, _of_two_machines(one, other)))
        assert found.apart == "angles"
        grown.append(found.found_mm / right.found_mm)
    assert np.median(grown) > 2


def test_halves_of_too_few_highlights_are_left_out(prior: Prior) -> None:
    highlights = every_highlight(drawn(prior, 1)[1], 2)
    few = highlights.only(highlights.led == 0)
    assert [half.apart for half in _halves(prior, few)] == ["angles"]
