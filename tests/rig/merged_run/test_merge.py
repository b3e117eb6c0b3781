"""Merged photographs against the merge that is simulated, and what a real run may lack."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.app.api import merge
from tbcad.common.figure_files import srgb, srgb_light
from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField, light_field_in_memory
from tbcad.light.simulate.prototype.merge import merge_run
from tbcad.light.simulate.prototype.run import Plan, ball_reflector, prototype_runs
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.records.run import DARK, DARK_LIT, LIT, PHOTOGRAPHS, Frame, exposure_name
from tbcad.rig.machine.machine import Machine, write_machine
from tests.exported_files import edit_json
from tests.machine_states import frames_of, machine_of
from tests.photographed_runs import photographs_of, write_exposure, write_run

CAPTURE_MM = 60.0
FIRST = Frame(object_turn_deg=0, stop=1, base_angle_deg=0.0)


@dataclass(frozen=True)
class Setting:
    """A machine as designed, its perfect photographs, and a folder for runs and calibrations."""

    export: ExportedDesign
    plan: Plan
    machine: Machine
    frames: tuple[Frame, ...]
    perfect: dict[str, np.ndarray]
    simulated: LightField
    folder: Path

    @property
    def calibration(self) -> Path:
        return self.folder / "calibration"

    def calibrated(self, machine: Machine, frames: tuple[Frame, ...]) -> None:
        self.calibration.mkdir(exist_ok=True)
        write_machine(self.calibration / "machine.json", machine, frames)

    def run(self, phases: tuple[str, ...] = (LIT,), **how: Any) -> Path:
        return write_run(self.folder / "run", self.export, self.frames, self.perfect, phases, **how)

    def merged(self, run: Path, **options: Any) -> tuple[dict[str, Any], LightField]:
        """What is recorded and found; these photographs have no loss of light toward the edge."""
        out = self.folder / "merged"
        wanted = {"vignetting": "off"} | options
        return merge(run, self.calibration, self.export.folder, out=out, **wanted), LightField.read(
            out
        )

    def off(self, found: LightField) -> np.ndarray:
        """Largest difference of colours from the simulated ones, at pixels on mirrors of both."""
        result = []
        for camera, frame in self.simulated.frames.items():
            both = on_mirrors(frame) & on_mirrors(found.frames[camera])
            difference = frame.image().astype(int) - found.frames[camera].image()
            result.append(np.abs(difference).max(axis=2)[both])
        return np.concatenate(result)

    def refused(self, run: Path, message: str, **options: Any) -> None:
        out = self.folder / "merged"
        with pytest.raises(InputError, match=message) as caught:
            merge(run, self.calibration, self.export.folder, out=out, **options)
        assert "\n" not in str(caught.value)
        assert not out.exists()


@pytest.fixture(scope="module")
def whole(export: ExportedDesign, plan: Plan) -> Setting:
    scene = prepared_scene(built_in_object(CAPTURE_MM))
    frames = frames_of(plan)
    machine = machine_of(export, plan)
    perfect = photographs_of(export, plan, machine, frames, scene)
    runs = prototype_runs(export.reflectors, plan)
    bands = ((ball_reflector(run), merge_run(run, scene)) for run in runs)
    simulated = light_field_in_memory(bands, CAPTURE_MM)
    return Setting(export, plan, machine, frames, perfect, simulated, Path())


@pytest.fixture
def setting(whole: Setting, tmp_path: Path) -> Setting:
    found = replace(whole, folder=tmp_path)
    found.calibrated(whole.machine, whole.frames)
    return found


def on_mirrors(frame: CameraFrame) -> np.ndarray:
    return np.asarray(frame.planes["mirror"]) > 0


def expose(run: Path, frame: Frame, phase: str, seconds: float) -> None:
    path = run / PHOTOGRAPHS / f"{exposure_name(frame, phase)}.json"
    edit_json(path, lambda record: record.update(exposure_s=seconds))


@pytest.mark.parametrize(("suffix", "factor"), [("png", 1), ("tif", 257)])
def test_same_as_the_simulated_capture(setting: Setting, suffix: str, factor: int) -> None:
    def deeper(image: np.ndarray, _frame: Frame, _phase: str) -> np.ndarray:
        return image if factor == 1 else image.astype(np.uint16) * factor

    record, found = setting.merged(setting.run(change=deeper, suffix=suffix))
    for camera, frame in setting.simulated.frames.items():
        same = found.frames[camera]
        assert (same.planes["mirror"] == frame.planes["mirror"]).mean() > 1 - 1e-4
        both = on_mirrors(frame) & on_mirrors(same)
        for name in ("origin", "direction"):
            assert np.abs(same.planes[name] - frame.planes[name])[both].max() < 1e-4
        half = record["based_on"][camera]
        assert half["mirrors_with_rays"] == half["mirrors"] == len(frame.u)
        assert not half["mirrors_missing"]
        assert not half["photographs_not_used"]
    off = setting.off(found)
    assert off.max() <= 1
    assert (off > 0).mean() < 1e-4


def test_corrections_restore_what_a_camera_does(setting: Setting) -> None:
    """Stray light, other exposures at some stops, and cos^4; in 16 bits, so little is lost."""
    camera = setting.machine.camera
    pixels = np.stack(np.meshgrid(np.arange(416.0), np.arange(310.0)), axis=-1)
    fall = (camera.directions(pixels) @ camera.axes[2])[..., None] ** 4
    stray = np.linspace(1000, 3000, 416)[:, None]

    def taken(image: np.ndarray, frame: Frame, phase: str) -> np.ndarray:
        light = 100.0 * image * fall if phase == LIT else 0.0 * image
        return np.rint(light * exposure_of(frame) + stray).astype(np.uint16)

    def exposure_of(frame: Frame) -> float:
        return 2.0 if frame.stop == 5 else 1.0

    run = setting.run((DARK, LIT), change=taken)
    for frame in setting.frames:
        for phase in (DARK, LIT):
            expose(run, frame, phase, exposure_of(frame))
    _, found = setting.merged(run, vignetting="cos4", brightness=2.57)
    assert setting.off(found).max() <= 1


def test_srgb_and_flat_field(setting: Setting) -> None:
    shade = np.linspace(1, 0.5, 416)[:, None]

    def taken(image: np.ndarray, _frame: Frame, _phase: str) -> np.ndarray:
        return np.rint(65535 * srgb(srgb_light(image / 255) * shade)).astype(np.uint16)

    white = np.full((310, 416, 3), 255, dtype=np.uint8)
    write_exposure(setting.folder, FIRST, LIT, taken(white, FIRST, LIT), "a_0001_lit.png")
    run, flat = setting.run(change=taken), setting.folder / "a_0001_lit.png"
    _, found = setting.merged(run, vignetting="cos4", flat=(flat,), encoding="srgb")
    # Between pixels light is interpolated instead of its code.
    assert np.median(setting.off(found)) <= 1


def test_missing_and_damaged_photographs(setting: Setting) -> None:
    """Their mirrors have no rays; the rest goes on, and nothing in the run is changed."""
    run, plan = setting.run(), setting.plan
    lost, damaged = (int(np.bincount(plan.stop[0]).argsort()[-i]) for i in (1, 2))
    names = [f"a_{stop + 1:04d}_lit" for stop in (lost, damaged)]
    (run / PHOTOGRAPHS / f"{names[0]}.png").unlink()
    (run / PHOTOGRAPHS / f"{names[0]}.json").unlink()
    (run / PHOTOGRAPHS / f"{names[1]}.png").write_bytes(b"no picture")
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    record, field = setting.merged(run)
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before
    half, found = record["based_on"]["a"], field.frames["a"]
    absent = np.flatnonzero(np.isin(plan.stop[0], [lost, damaged])) + 1
    named = {name for names in half["mirrors_missing"].values() for name in names}
    assert named == {f"a{mirror:04d}" for mirror in absent}
    assert half["stops_used"] == len(plan.angle) - 2
    assert set(half["photographs_not_used"]) == set(names)
    mirror = np.asarray(found.planes["mirror"])
    assert not np.isin(mirror, absent).any()
    assert len(np.unique(mirror[mirror > 0])) == len(found.u) - len(absent)
    assert record["based_on"]["b"]["mirrors_with_rays"] == len(found.u)


def test_a_stop_that_the_calibration_does_not_know(setting: Setting) -> None:
    stop = int(np.bincount(setting.plan.stop[0]).argmax())
    few = replace(setting.machine, angle=np.delete(setting.machine.angle, stop))
    setting.calibrated(few, setting.frames[:stop] + setting.frames[stop + 1 :])
    record, _ = setting.merged(setting.run())
    (reason,) = record["based_on"]["a"]["mirrors_missing"]
    assert reason == "the calibration has no angle of this stop"


@pytest.mark.parametrize("dark", [DARK, DARK_LIT])
def test_dark_photographs(setting: Setting, dark: str) -> None:
    """Stray light grows with the exposure; `dark` beside `dark_lit` would take off too much.

    At the third and fourth stop the dark one is exposed otherwise than the lit one, at the sixth it
    is missing; `dark_lit` is always as long as the lit one.
    """
    times = {3: 2.0, 4: 0.01} if dark == DARK else {}

    def seconds(frame: Frame, phase: str) -> float:
        return times.get(frame.stop, 1.0) if phase == dark else 1.0

    def taken(image: np.ndarray, frame: Frame, phase: str) -> np.ndarray:
        light = 50_000 if phase == DARK != dark else 1000.0 * seconds(frame, phase)
        return np.rint(100.0 * image + light).astype(np.uint16)

    phases = tuple(dict.fromkeys((DARK, dark, LIT)))
    run = setting.run(phases, change=taken)
    for frame in setting.frames:
        for phase in phases:
            expose(run, frame, phase, seconds(frame, phase))
    if dark == DARK:
        (run / PHOTOGRAPHS / "a_0006_dark.png").write_bytes(b"")
    record, found = setting.merged(run, brightness=2.57)
    half, off = record["based_on"]["a"], setting.off(found)
    assert half["without_dark"] == (["a_0003_lit", "a_0004_lit", "a_0006_lit"] if times else [])
    assert (off.max() > 1) == bool(times)
    assert np.median(off) <= 1


def test_one_run_of_two(setting: Setting) -> None:
    run = replace(setting, frames=setting.frames[: len(setting.plan.angle)]).run()
    head = "mirror,sigma_mm,sigma_mrad,pixel_mm"
    rays = f"{head}\na0001,0.04,2,1\nb0001,0.04,2,1\n"  # 2 mrad at 15 mm
    (setting.calibration / "rays.csv").write_text(rays, encoding="utf-8")
    record, field = setting.merged(run)
    assert list(record["based_on"]) == list(field.frames) == ["a"]
    told = field.facts["ray_sigma_mm"]
    assert told == {"a": [0.05, *[None] * (len(field.frames["a"].u) - 1)]}
    at = camera_around_object(0.0, 0.6, 640.0, CAPTURE_MM, (64, 64))
    assert synthesise(MirrorTiles(field), at).image.any()


def test_refused(setting: Setting) -> None:
    run = setting.run()
    machine = setting.calibration / "machine.json"
    edit_json(machine, lambda record: record["camera"].update(width_px=417))
    setting.refused(run, "416 x 310 pixels, the camera of .* 417 x 310")
    setting.calibrated(setting.machine, setting.frames)
    small = np.full((100, 200, 3), 255, np.uint8)
    write_exposure(setting.folder, FIRST, LIT, small, "a_0001_lit.png")
    message = "is 200 x 100 pixels, the run's photographs are 416 x 310"
    setting.refused(run, message, flat=(setting.folder / "a_0001_lit.png",))
    with pytest.raises(InputError, match="name it with exports"):
        merge(run, setting.calibration, out=setting.folder / "merged")
    edit_json(run / "run.json", lambda record: record["export_sha256"].update({"balls.csv": "0"}))
    setting.refused(run, "balls.csv is not the file that")
    dark = replace(setting, folder=setting.folder / "dark").run((DARK,))
    setting.refused(dark, "no photograph of the lit object")
