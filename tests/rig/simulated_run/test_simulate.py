"""The folder of a simulated run, and what is refused."""

import hashlib
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.core.camera.sheet import write_camera_sheet
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.options.machines import SimulateRunOptions
from tbcad.rig.machine.machine import TRUTH, read_machine
from tbcad.rig.runs import check_same_export, read_photograph, read_run
from tbcad.rig.simulated_run import simulate
from tbcad.rig.simulated_run.photographs import SimulatedRun
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.prototype.gravity import read_gravity
from tests.exported_files import contents
from tests.prototype_records import printed_part, write_prototype
from tests.simulated_runs import Small, fdm_errors, small_run

PHASES = ("dark", "led_1", "lit")


@pytest.fixture(scope="module")
def small(export_folder: Path) -> Small:
    return small_run(export_folder, (3,))


def test_a_folder_that_is_read_back(
    small: Small, export_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And is the same with any number of threads."""
    out = tmp_path / "run"
    steps: list[str] = []
    simulate.write_run((small.run,), PHASES, export_folder, out, steps.append)
    run = read_run(out)
    assert not run.faults
    assert run.record.frames == small.run.frames
    assert len(run.exposures) == len(small.run.frames) * len(PHASES)
    frame = run.record.frames[1]
    exposure = run.exposure(frame, "led_1")
    assert exposure is not None
    image = read_photograph(run, exposure)
    assert (image == small.run.frame_photographs(1, ("led_1",))["led_1"]).all()
    truth, frames = read_machine(out / TRUTH)
    assert frames == small.run.frames
    assert truth.centre == pytest.approx(small.machine.centre, abs=0)
    assert steps[-1] == "frame 2 of 2, 0 s left"
    digest = hashlib.sha256((export_folder / "balls.csv").read_bytes()).hexdigest()
    assert run.record.export_sha256["balls.csv"] == digest
    monkeypatch.setattr(simulate, "THREADS", simulate.THREADS + 1)
    simulate.write_run((small.run,), PHASES, export_folder, tmp_path / "again", lambda _: None)
    assert contents(tmp_path / "again") == contents(out)


def test_photographs_are_not_replaced(small: Small, export_folder: Path, tmp_path: Path) -> None:
    kept = tmp_path / "mine.txt"
    kept.write_text("precious")
    with pytest.raises(InputError, match="holds files, and photographs are not replaced"):
        simulate.write_run((small.run,), PHASES, export_folder, tmp_path, lambda _: None)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_run_depends_on_the_weight_of_its_export(
    small: Small, export_folder: Path, tmp_path: Path
) -> None:
    """A run without the file is read with any."""
    folder = Path(shutil.copytree(export_folder, tmp_path / "export"))
    (folder / "sag.csv").unlink(missing_ok=True)
    without = simulate._record((small.run,), PHASES, folder)
    (folder / "sag.csv").write_text("one")
    record = simulate._record((small.run,), PHASES, folder)
    check_same_export(tmp_path, record, folder)
    (folder / "sag.csv").write_text("of a stiffer carrier")
    check_same_export(tmp_path, without, folder)
    with pytest.raises(InputError, match=r"sag\.csv is not the file that .* was photographed with"):
        check_same_export(tmp_path, record, folder)


def test_nothing_is_left_of_a_run_that_fails(
    small: Small, export_folder: Path, tmp_path: Path
) -> None:
    def fail(_: str) -> None:
        raise OSError(28, "No space left on device")

    with pytest.raises(InputError, match="No space left"):
        simulate.write_run((small.run,), PHASES, export_folder, tmp_path / "run", fail)
    assert not list(tmp_path.iterdir())


Prepared = tuple[tuple[SimulatedRun, ...], tuple[str, ...]]


def prepared(folder: Path, errors: Errors | None = None, **options: Any) -> Prepared:
    """Runs of an export with the object that fits in, and their phases."""
    export = read_export(folder)
    subject = simulate.run_object(export, None)
    assert subject.radius <= export.spec.prototype.stage.object_diameter_mm / 2
    asked = SimulateRunOptions("exports", **options)
    return simulate.prepare_run(export, errors or fdm_errors(), subject, asked)


def test_options_choose_stops_and_phases(export_with_wind_up: Path) -> None:
    options = {"seed": 1, "stops": "2,3", "phases": "led_2,dark", "perfect": True}
    (run,), phases = prepared(export_with_wind_up, **options)
    assert phases == ("dark", "led_2")
    assert [(f.object_turn_deg, f.stop) for f in run.frames] == [(0, 2), (0, 3), (180, 2), (180, 3)]
    assert not run.built.machine.camera.distortion.any()


def test_real_optics_are_in_the_record(
    export_with_wind_up: Path, low_resolution_design: MirrorDesign, tmp_path: Path
) -> None:
    """By the lens of camera.json; nothing of it is in the record of any other run."""
    options = {"stops": "30", "optics": "real", "gloss": 0.3, "bits": 16, "phases": "dark,lit"}
    with pytest.raises(InputError, match=r"camera\.json is not there: build it again"):
        prepared(export_with_wind_up, **options)
    export = Path(shutil.copytree(export_with_wind_up, tmp_path / "export"))
    write_camera_sheet(export, low_resolution_design.arrays[0], 30.0)
    (run,), phases = prepared(export, **options)
    assert run.scene.microfacets is not None
    simulate.write_run((run,), phases, export, tmp_path / "run", lambda _: None)
    found = read_run(tmp_path / "run")
    lit = read_photograph(found, found.exposures["a_0030_lit"])
    assert lit.max() > 1000
    told = found.record.real
    assert told is not None
    assert (told.gloss, told.bits, told.rays_a_pixel) == (0.3, 16, 4)
    assert not any("dust" in one for one in told.left_out)
    (ideal,), phases = prepared(export, stops="30", phases="dark")
    assert "real" not in simulate._record((ideal,), phases, export).document()


def test_exposures_and_brightness(export_with_wind_up: Path, tmp_path: Path) -> None:
    """A dark photograph for each exposure; sidecars say it; a bright LED takes a short one."""
    usual = {"stops": "30", "phases": "dark,led_1,lit"}
    bright = {"led_brightness": 100.0, "exposure_leds": 0.01, "exposure_lit": "1/2"}
    folders = [tmp_path / name for name in ("usual", "bright")]
    for folder, options in zip(folders, (usual, usual | bright), strict=True):
        runs, phases = prepared(export_with_wind_up, **options)
        simulate.write_run(runs, phases, export_with_wind_up, folder, lambda _: None)
    before, after = (read_run(folder) for folder in folders)
    assert after.record.phases == ("dark", "led_1", "dark_lit", "lit")
    times = {one.phase: one.exposure_s for one in after.exposures.values()}
    assert times == {"dark": 0.01, "led_1": 0.01, "dark_lit": 0.5, "lit": 0.5}
    images = [
        read_photograph(run, run.exposures[name]).astype(int)
        for run in (before, after)
        for name in ("a_0030_led_1", "a_0030_lit")
    ]
    led, lit, same, darker = images
    assert np.abs(led - same).max() < 20  # noise
    assert led.max() > 50
    assert darker.max() == pytest.approx(lit.max() / 2, rel=0.1)


def test_seeds_make_different_builds(export_with_wind_up: Path) -> None:
    one, two, again = (
        prepared(export_with_wind_up, seed=seed, stops="1")[0][0].built.machine.centre
        for seed in (1, 2, 1)
    )
    assert (one == again).all()
    assert np.abs(one - two).max() > 0.01


def test_gravity_turns_the_base_as_the_export_says(export_with_wind_up: Path, plan: Plan) -> None:
    (run,), _ = prepared(export_with_wind_up, Errors(wind_up=Error(mean=1.0)))
    wind_up = read_gravity(read_export(export_with_wind_up), plan).wind_up
    assert wind_up.max() > 0
    assert run.built.machine.angle == pytest.approx(np.tile(plan.angle + wind_up, 2), abs=1e-12)


def test_the_stage_hides_leds_as_it_stands(tmp_path: Path) -> None:
    import trimesh

    box = trimesh.creation.box((4.0, 6.0, 8.0))
    axes = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    origin, middle = np.array([1.0, 2.0, 3.0]), np.array([30.0, -10.0, 5.0])
    # A point x of the prototype is x @ axes + origin on the printer's bed.
    box.vertices = (box.vertices + middle) @ axes + origin
    box.export(tmp_path / "post.stl")
    place = {"axes": axes.tolist(), "origin_mm": origin.tolist()}
    write_prototype(tmp_path, parts=[printed_part("post", "stage", **place)])
    stage = simulate.stage_scene(tmp_path)
    way = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    hits = stage.run(
        np.tile(middle + np.array([10.0, 0.0, 0.0]), (2, 1)).astype(np.float32),
        way.astype(np.float32),
        output=1,
    )
    assert hits["tfar"][0] == pytest.approx(8.0)  # ten less half of four
    assert hits["primID"][1] < 0
