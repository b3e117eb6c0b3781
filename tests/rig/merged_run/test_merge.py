"""Merged photographs against the merge that is simulated, and what a real run may lack."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.app.api import merge
from tbcad.errors import InputError
from tbcad.light.simulate.capture.light_field import CameraFrame, LightField, light_field_in_memory
from tbcad.light.simulate.prototype.merge import merge_run
from tbcad.light.simulate.prototype.plan import Plan
from tbcad.light.simulate.prototype.run import ball_reflector, prototype_runs
from tbcad.light.simulate.scene.exported import ExportedDesign
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.scene.viewpoint import camera_around_object
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.records.exposure import DARK, DARK_LIT, LIT, PHOTOGRAPHS, Frame, exposure_name
from tbcad.rig.machine.machine import Machine, write_machine
from tests.exported_files import edit_json
from tests.machine_states import frames_of, machine_of
from tests.photographed_runs import photographs_of, write_exposure, write_run

CAPTURE_MM = 60.0
FIRST = Frame(object_turn_deg=0, stop=1, base_angle_deg=0.0)
EVEN: dict[str, Any] = {"vignetting": "off"}
"""The photographs of these tests have no loss of light toward the edge, unless they say so."""
Photographs = dict[str, np.ndarray]


@pytest.fixture(scope="module")
def frames(plan: Plan) -> tuple[Frame, ...]:
    return frames_of(plan)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return prepared_scene(built_in_object(CAPTURE_MM))


@pytest.fixture(scope="module")
def designed(export: ExportedDesign, plan: Plan) -> Machine:
    return machine_of(export, plan)


@pytest.fixture(scope="module")
def simulated(export: ExportedDesign, plan: Plan, scene: Scene) -> LightField:
    runs = prototype_runs(export.reflectors, plan)
    bands = ((ball_reflector(run), merge_run(run, scene)) for run in runs)
    return light_field_in_memory(bands, CAPTURE_MM)


@pytest.fixture(scope="module")
def perfect(
    export: ExportedDesign,
    plan: Plan,
    designed: Machine,
    frames: tuple[Frame, ...],
    scene: Scene,
) -> Photographs:
    return photographs_of(export, plan, designed, frames, scene)


@pytest.fixture
def calibration(designed: Machine, frames: tuple[Frame, ...], tmp_path: Path) -> Path:
    return calibrated(tmp_path / "calibration", designed, frames)


def calibrated(folder: Path, machine: Machine, frames: tuple[Frame, ...]) -> Path:
    folder.mkdir()
    write_machine(folder / "machine.json", machine, frames)
    return folder


def on_mirrors(frame: CameraFrame) -> np.ndarray:
    return np.asarray(frame.planes["mirror"]) > 0


def apart(one: LightField, other: LightField) -> list[np.ndarray]:
    """Largest difference of colours at pixels on mirrors of both, for each camera."""
    result = []
    for camera, frame in one.frames.items():
        both = on_mirrors(frame) & on_mirrors(other.frames[camera])
        difference = frame.image().astype(int) - other.frames[camera].image()
        result.append(np.abs(difference).max(axis=2)[both])
    return result


class TestPerfectMachine:
    @pytest.mark.parametrize(("suffix", "factor"), [("png", 1), ("tif", 257)])
    def test_same_as_the_simulated_capture(
        self,
        export: ExportedDesign,
        frames: tuple[Frame, ...],
        perfect: Photographs,
        simulated: LightField,
        calibration: Path,
        tmp_path: Path,
        suffix: str,
        factor: int,
    ) -> None:
        def deeper(image: np.ndarray, _frame: Frame, _phase: str) -> np.ndarray:
            return image if factor == 1 else image.astype(np.uint16) * factor

        run = write_run(tmp_path / "run", export, frames, perfect, change=deeper, suffix=suffix)
        record = merge(run, calibration, export.folder, out=tmp_path / "merged", **EVEN)
        found = LightField.read(tmp_path / "merged")
        for camera, frame in simulated.frames.items():
            same = found.frames[camera]
            assert (same.planes["mirror"] == frame.planes["mirror"]).mean() > 1 - 1e-4
            both = on_mirrors(frame) & on_mirrors(same)
            for name in ("origin", "direction"):
                assert np.abs(same.planes[name] - frame.planes[name])[both].max() < 1e-4
            half = record["based_on"][camera]
            assert half["mirrors_with_rays"] == half["mirrors"] == len(frame.u)
            assert not half["mirrors_missing"]
            assert not half["photographs_not_used"]
        off = np.concatenate(apart(found, simulated))
        assert off.max() <= 1
        assert (off > 0).mean() < 1e-4

    def test_corrections_restore_what_a_camera_does(
        self,
        export: ExportedDesign,
        frames: tuple[Frame, ...],
        perfect: Photographs,
        simulated: LightField,
        calibration: Path,
        designed: Machine,
        tmp_path: Path,
    ) -> None:
        """Stray light, other exposures at some stops, and cos^4; in 16 bits, so little is lost."""
        camera = designed.camera
        pixels = np.stack(np.meshgrid(np.arange(416.0), np.arange(310.0)), axis=-1)
        fall = (camera.directions(pixels) @ camera.axes[2])[..., None] ** 4
        stray = np.linspace(1000, 3000, 416)[:, None]

        def taken(image: np.ndarray, frame: Frame, phase: str) -> np.ndarray:
            light = 100.0 * image * fall if phase == LIT else 0.0 * image
            return np.rint(light * exposure_of(frame) + stray).astype(np.uint16)

        def exposure_of(frame: Frame) -> float:
            return 2.0 if frame.stop == 5 else 1.0

        run = write_run(tmp_path / "run", export, frames, perfect, (DARK, LIT), taken)
        for frame in frames:
            for phase in (DARK, LIT):
                set_exposure(run, frame, phase, exposure_of(frame))
        options = {"vignetting": "cos4", "brightness": 2.57}
        merge(run, calibration, export.folder, out=tmp_path / "merged", **options)
        off = np.concatenate(apart(LightField.read(tmp_path / "merged"), simulated))
        assert off.max() <= 1

    def test_srgb_and_flat_field(
        self,
        export: ExportedDesign,
        frames: tuple[Frame, ...],
        perfect: Photographs,
        simulated: LightField,
        calibration: Path,
        tmp_path: Path,
    ) -> None:
        shade = np.linspace(1, 0.5, 416)[:, None]

        def taken(image: np.ndarray, _frame: Frame, _phase: str) -> np.ndarray:
            light = np.where(
                image <= 10, image / 255 / 12.92, ((image / 255 + 0.055) / 1.055) ** 2.4
            )
            dimmed = light * shade
            encoded = np.where(
                dimmed <= 0.0031308, 12.92 * dimmed, 1.055 * dimmed ** (1 / 2.4) - 0.055
            )
            return np.rint(65535 * encoded).astype(np.uint16)

        run = write_run(tmp_path / "run", export, frames, perfect, change=taken)
        flat = tmp_path / "a_0001_lit.png"
        white = np.full((310, 416, 3), 255, dtype=np.uint8)
        write_exposure(tmp_path, frames[0], LIT, taken(white, frames[0], LIT), flat.name)
        options = {"flat": (flat,), "encoding": "srgb"}
        merge(run, calibration, export.folder, out=tmp_path / "merged", **options)
        dark = np.concatenate(apart(LightField.read(tmp_path / "merged"), simulated))
        # Between pixels light is interpolated instead of its code.
        assert np.median(dark) <= 1


def set_exposure(run: Path, frame: Frame, phase: str, seconds: float) -> None:
    path = run / PHOTOGRAPHS / f"{exposure_name(frame, phase)}.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "exposure_s": seconds}))


@pytest.fixture
def run(
    export: ExportedDesign, frames: tuple[Frame, ...], perfect: Photographs, tmp_path: Path
) -> Path:
    return write_run(tmp_path / "run", export, frames, perfect)


class TestIncomplete:
    def test_missing_and_damaged_photographs(
        self, export: ExportedDesign, plan: Plan, run: Path, calibration: Path, tmp_path: Path
    ) -> None:
        """Their mirrors have no rays; the rest goes on."""
        images = run / PHOTOGRAPHS
        lost, damaged = (int(np.bincount(plan.stop[0]).argsort()[-i]) for i in (1, 2))
        (images / f"a_{lost + 1:04d}_lit.png").unlink()
        (images / f"a_{lost + 1:04d}_lit.json").unlink()
        (images / f"a_{damaged + 1:04d}_lit.png").write_bytes(b"no picture")
        before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
        record = merge(run, calibration, export.folder, out=tmp_path / "merged", **EVEN)
        assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before
        half = record["based_on"]["a"]
        expected = {f"a{m + 1:04d}" for m in np.flatnonzero(np.isin(plan.stop[0], [lost, damaged]))}
        named = {name for names in half["mirrors_missing"].values() for name in names}
        assert named == expected
        assert half["stops_used"] == len(plan.angle) - 2
        assert set(half["photographs_not_used"]) == {
            f"a_{lost + 1:04d}_lit",
            f"a_{damaged + 1:04d}_lit",
        }
        found = LightField.read(tmp_path / "merged").frames["a"]
        mirror = np.asarray(found.planes["mirror"])
        absent = np.flatnonzero(np.isin(plan.stop[0], [lost, damaged])) + 1
        assert not np.isin(mirror, absent).any()
        assert len(np.unique(mirror[mirror > 0])) == len(found.u) - len(absent)
        assert record["based_on"]["b"]["mirrors_with_rays"] == len(found.u)

    def test_a_stop_that_the_calibration_does_not_know(
        self,
        export: ExportedDesign,
        plan: Plan,
        run: Path,
        designed: Machine,
        frames: tuple[Frame, ...],
        tmp_path: Path,
    ) -> None:
        stop = int(np.bincount(plan.stop[0]).argmax())
        machine = Machine(**{**vars(designed), "angle": np.delete(designed.angle, stop)})
        few = tuple(frame for at, frame in enumerate(frames) if at != stop)
        calibration = calibrated(tmp_path / "few", machine, few)
        record = merge(run, calibration, export.folder, out=tmp_path / "merged", **EVEN)
        (reason,) = record["based_on"]["a"]["mirrors_missing"]
        assert reason == "the calibration has no angle of this stop"

    @pytest.mark.parametrize("dark", [DARK, DARK_LIT])
    def test_dark_photographs(
        self,
        export: ExportedDesign,
        frames: tuple[Frame, ...],
        perfect: Photographs,
        simulated: LightField,
        calibration: Path,
        tmp_path: Path,
        dark: str,
    ) -> None:
        """Stray light grows with the exposure; `dark` beside `dark_lit` would take off too much.

        At the third stop the dark one is exposed twice as long as the lit one, at the fourth far
        too short, at the sixth it is missing; `dark_lit` is always as long as the lit one.
        """
        times = {3: 2.0, 4: 0.01} if dark == DARK else {}

        def taken(image: np.ndarray, frame: Frame, phase: str) -> np.ndarray:
            own = times.get(frame.stop, 1.0) if phase == dark else 1.0
            light = 50_000 if phase == DARK != dark else 1000.0 * own
            return np.rint(100.0 * image + light).astype(np.uint16)

        phases = tuple(dict.fromkeys((DARK, dark, LIT)))
        run = write_run(tmp_path / "dark", export, frames, perfect, phases, taken)
        for frame in frames:
            for name in phases:
                set_exposure(run, frame, name, times.get(frame.stop, 1.0) if name == dark else 1.0)
        if dark == DARK:
            (run / PHOTOGRAPHS / "a_0006_dark.png").write_bytes(b"")
        options = {"vignetting": "off", "brightness": 2.57}
        record = merge(run, calibration, export.folder, out=tmp_path / "merged", **options)
        half = record["based_on"]["a"]
        assert half["without_dark"] == (["a_0004_lit", "a_0006_lit"] if times else [])
        assert half["dark_scaled"] == (["a_0003_lit"] if times else [])
        off = np.concatenate(apart(LightField.read(tmp_path / "merged"), simulated))
        assert (off.max() > 1) == bool(times)
        assert np.median(off) <= 1

    def test_one_run_of_two(
        self,
        export: ExportedDesign,
        plan: Plan,
        frames: tuple[Frame, ...],
        perfect: Photographs,
        calibration: Path,
        tmp_path: Path,
    ) -> None:
        first = frames[: len(plan.angle)]
        run = write_run(tmp_path / "half", export, first, perfect)
        head = "mirror,sigma_mm,sigma_mrad,pixel_mm"
        rays = f"{head}\na0001,0.04,2,1\nb0001,0.04,2,1\n"  # 2 mrad at 15 mm
        (calibration / "rays.csv").write_text(rays, encoding="utf-8")
        record = merge(run, calibration, export.folder, out=tmp_path / "merged", **EVEN)
        assert list(record["based_on"]) == ["a"]
        field = LightField.read(tmp_path / "merged")
        assert list(field.frames) == ["a"]
        told = field.facts["ray_sigma_mm"]
        assert told == {"a": [0.05, *[None] * (len(field.frames["a"].u) - 1)]}
        at = camera_around_object(0.0, 0.6, 640.0, CAPTURE_MM, (64, 64), None)
        assert synthesise(MirrorTiles(field), at, "nearest", None).image.any()


@pytest.mark.parametrize(
    ("file", "key", "value", "message"),
    [
        ("calibration/machine.json", "camera", {"width_px": 417}, "416 x 310 .* 417 x 310"),
        ("run/run.json", "export_sha256", {"balls.csv": "0"}, "balls.csv is not the file that"),
    ],
)
@pytest.mark.usefixtures("run", "calibration")
def test_what_does_not_belong_together(
    export: ExportedDesign,
    tmp_path: Path,
    file: str,
    key: str,
    value: dict[str, Any],
    message: str,
) -> None:
    edit_json(tmp_path / file, lambda record: record[key].update(value))
    refused(tmp_path / "run", tmp_path / "calibration", export, tmp_path, message)


def test_a_flat_field_of_another_size(
    export: ExportedDesign, run: Path, calibration: Path, tmp_path: Path
) -> None:
    name = "a_0001_lit.png"
    write_exposure(tmp_path, FIRST, LIT, np.full((100, 200, 3), 255, np.uint8), name)
    message = "is 200 x 100 pixels, the run's photographs are 416 x 310"
    refused(run, calibration, export, tmp_path, message, {"flat": (tmp_path / name,)})


def test_no_photograph_of_the_object(
    export: ExportedDesign,
    frames: tuple[Frame, ...],
    perfect: Photographs,
    calibration: Path,
    tmp_path: Path,
) -> None:
    dark = write_run(tmp_path / "dark", export, frames, perfect, (DARK,))
    refused(dark, calibration, export, tmp_path, "no photograph of the lit object")
    with pytest.raises(InputError, match="name it with --exports"):
        merge(dark, calibration, out=tmp_path / "merged")


def refused(
    run: Path,
    calibration: Path,
    export: ExportedDesign,
    tmp_path: Path,
    message: str,
    options: dict[str, Any] | None = None,
) -> None:
    with pytest.raises(InputError) as caught:
        merge(run, calibration, export.folder, out=tmp_path / "merged", **(options or {}))
    assert re.search(message, str(caught.value))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "merged").exists()
