"""The light field's file: what is written is read, in parts too; other files are refused."""

import gc
import shutil
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.app.cli import run
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.errors import InputError
from tbcad.light.simulate.capture.files import create_light_field, read_object, write_camera
from tbcad.light.simulate.capture.light_field import PIXEL_ARRAYS, LightField, traced_light_field
from tbcad.light.simulate.capture.photograph import photograph, subpixel_shifts
from tbcad.light.simulate.capture.sequence import sequence_frame
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays, prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.studies.low_pass import defocus_shifts, low_pass_shifts
from tests.app.cli.commands import Command
from tests.light.viewer.fields import write_ball

Cameras = tuple[Reflector, Reflector]
FRAMES, TURN_DEG = 4, 120.0
SMALL = ["--width", "96", "--height", "72"]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory, cameras: Cameras, knot: Scene) -> Path:
    path = tmp_path_factory.mktemp("field") / "lightfield.h5"
    with create_light_field(path, 60.0, {"object": "knot"}) as store:
        for at in cameras:
            write_camera(store, at, photograph(at.camera, exact_tracer(at), knot))
    return path


def test_round_trip(file: Path, cameras: Cameras, light_field: LightField) -> None:
    with LightField.open(file.parent) as source:  # the folder will do
        assert source.facts == {"object": "knot"}
        assert source.capture_mm == 60.0
        assert len(source) == len(light_field)
        for at, frame in zip(cameras, source.frames.values(), strict=True):
            memory = light_field.frames[at.camera_id]
            part = frame.read(slice(50, 90), slice(100, 333))
            for name in PIXEL_ARRAYS:
                assert np.array_equal(frame.planes[name][:], memory.planes[name])
                assert np.array_equal(part[name], memory.planes[name][50:90, 100:333])
            assert np.array_equal(frame.u, at.u)
            assert np.array_equal(frame.boxes, at.boxes())
            assert np.array_equal(frame.camera.pinhole, at.camera.pinhole)
            assert frame.camera.hfov == at.camera.hfov
            assert np.array_equal(frame.mirrors.curvature, at.mirrors.curvature)


def test_it_is_compressed(file: Path) -> None:
    raw = sum(np.dtype(kind).itemsize * int(np.prod(last)) for last, kind in PIXEL_ARRAYS.values())
    assert file.stat().st_size < 0.8 * 2 * 416 * 310 * raw


@pytest.mark.parametrize(
    ("name", "value", "wrong"),
    [
        ("a/mirror", np.zeros((310, 415), "u2"), "another shape"),
        ("a/mirror", np.zeros((310, 416), "f8"), "another shape or kind"),
        ("a/direction", None, "damaged"),
        ("a/mirrors/boxes", np.tile([0, 417, 0, 5], (103, 1)), "boxes"),
        ("a/mirrors/u", np.full((103, 3), np.nan), "not finite"),
        ("facts", "{", "damaged"),
        ("cameras", None, "without cameras"),
    ],
)
def test_damaged_files_are_refused(
    file: Path, tmp_path: Path, name: str, value: object, wrong: str
) -> None:
    path = tmp_path / "changed.h5"
    with pytest.raises(InputError, match="give a light field"), LightField.open(path):
        pass
    path.write_bytes(file.read_bytes())
    with h5py.File(path, "r+") as store:
        for one in ("a", "b") if name == "cameras" else (name,):
            store.pop(one, None)
        if value is not None:
            (store.attrs if name == "facts" else store)[name] = value
    with pytest.raises(InputError, match=wrong) as error, LightField.open(path):
        pass
    assert "\n" not in str(error.value)


def test_a_file_stays_open_while_it_is_used(file: Path, light_field: LightField) -> None:
    frames = LightField.open(str(file)).frames
    gc.collect()
    part = frames["b"].read(slice(50, 60))["origin"]
    assert np.array_equal(part, light_field.frames["b"].planes["origin"][50:60])
    with LightField.open(file) as source:
        kept = source.frames["a"]
    with pytest.raises(InputError, match="the file is closed"):
        kept.image()
    source.close()


@pytest.fixture(scope="module")
def captured(record: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("captures") / "turning"
    words = ["capture", str(record), "--frames", str(FRAMES), "--turn", str(TURN_DEG)]
    assert run([*words, "--out", str(out)]) == 0
    return out


@pytest.mark.parametrize("number", [0, 3])
def test_a_frame_is_a_capture_of_the_turned_object(
    captured: Path, cameras: tuple[Reflector, Reflector], number: int
) -> None:
    """In light that stands still: its normals turn, the lamps do not."""
    turn = Rotation.from_rotvec([0, 0, np.radians(TURN_DEG) * number / FRAMES])
    subject = read_object(captured)
    points, normals = turn.apply(subject.points), turn.apply(subject.normals)
    scene = prepared_scene(replace(subject, points=points, normals=normals))
    with LightField.open(captured) as source:
        found = sequence_frame(source, captured, number)
        for camera in cameras:
            bands = photograph(camera.camera, exact_tracer(camera), scene)
            expected = np.concatenate([band.colour for band in bands]).astype(int)
            frame = found.frames[camera.camera_id]
            rays = frame.planes["mirror"][:] > 0
            apart = np.abs(frame.planes["colour"].astype(int) - expected)[rays].max(axis=1)
            assert expected[rays].max() > 100
            assert (apart > 1).mean() < 2e-3  # float32 rays past an edge


def test_damaged_sequences_are_refused(captured: Path, tmp_path: Path) -> None:
    with LightField.open(captured) as source:
        with pytest.raises(InputError, match="one frame only"):
            sequence_frame(source, tmp_path, 0)
        (tmp_path / "sequence.h5").write_bytes((captured / "sequence.h5").read_bytes())
        with h5py.File(tmp_path / "sequence.h5", "r+") as store:
            del store["a/pixel"]
        with pytest.raises(InputError, match="damaged sequence"):
            sequence_frame(source, tmp_path, 0)


def test_a_frame_is_shown_by_its_own_field(captured: Path, tmp_path: Path, cli: Command) -> None:
    folder = tmp_path / "turning"
    shutil.copytree(captured, folder)
    with LightField.open(folder) as source:
        write_ball(sequence_frame(source, folder, 1), folder, frame=1)
    for number, method in (("0", "depth"), ("1", "field")):
        words = ["view", folder, *SMALL, "--frame", number, "--force"]
        assert f"method {method}: " in cli(*words, "--out", tmp_path / "v.png").out


def picture(
    at: Reflector, scene: Scene, samples: int | tuple[tuple[float, float], ...] = 1
) -> tuple[np.ndarray, np.ndarray]:
    bands = list(photograph(at.camera, exact_tracer(at), scene, samples))
    return (
        np.concatenate([band.colour for band in bands]),
        np.concatenate([band.rays.mirror for band in bands]),
    )


def test_a_pixel_sees_what_its_ray_sees(cameras: Cameras, knot: Scene) -> None:
    at = cameras[0]
    colour, mirror = picture(at, knot)
    rays = exact_tracer(at)(range(at.camera.height_px), (0.0, 0.0))
    seen = cast_rays(knot, rays.origin.reshape(-1, 3), rays.direction.reshape(-1, 3))
    on = mirror.ravel() > 0
    assert np.array_equal(np.rint(seen.colour[on]), colour.reshape(-1, 3)[on])
    assert colour.reshape(-1, 3)[on].any(axis=1).sum() > 1000


def test_the_object_hides_what_is_behind_it(cameras: Cameras, knot: Scene) -> None:
    """Where the camera sees the object directly there is a colour and no mirror's ray."""
    at = cameras[0]
    colour, mirror = picture(at, knot)
    direct = colour.any(axis=2) & (mirror == 0)
    assert direct.sum() > 100
    middle = np.argwhere(direct).mean(axis=0)
    # The middle of the object appears where the camera sees the origin, above the seam.
    assert abs(middle[1] - at.camera.project(np.zeros(3))[0]) < 5
    assert middle[0] < at.camera.height_px / 4


def test_anti_aliasing_is_the_mean_of_finer_pixels(cameras: Cameras, knot: Scene) -> None:
    at = cameras[1]
    fine = [picture(at, knot, (shift,))[0].astype(float) for shift in subpixel_shifts(2)]
    smooth, mirror = picture(at, knot, 2)
    assert np.array_equal(picture(at, knot, tuple(subpixel_shifts(2)))[0], smooth)
    on = mirror > 0
    assert np.abs(smooth - np.mean(fine, axis=0))[on].max() <= 1.0
    plain, same = picture(at, knot)
    assert np.array_equal(mirror, same)  # rays are those of the pixels' centres
    assert not np.array_equal(plain, smooth)


def contrast(shifts: tuple[tuple[float, float], ...], frequency: float) -> float:
    """What is left of a sine along the rows, cycles a pixel."""
    x = np.array(shifts)[:, 0]
    return float(np.abs(np.exp(2j * np.pi * frequency * x).mean()))


@pytest.mark.parametrize("separation", [0.75, 1.0, 2.0])
@pytest.mark.parametrize("frequency", [0.1, 0.25, 0.4])
def test_low_pass_filter_passes_its_cosine(separation: float, frequency: float) -> None:
    """|cos(pi s f)|, times the pixel's own response."""
    pixel = contrast(tuple(subpixel_shifts(3)), frequency)
    expected = abs(np.cos(np.pi * separation * frequency)) * pixel
    assert contrast(low_pass_shifts(separation, 3), frequency) == pytest.approx(expected, abs=1e-12)


def test_defocus_fills_its_circle() -> None:
    """Radius of gyration: that of the circle and of the pixel, d^2 / 8 + 1 / 6."""
    places = np.array(defocus_shifts(6.0, 400))
    assert np.abs(places.mean(axis=0)).max() < 0.02
    assert (places**2).sum(axis=1).mean() == pytest.approx(36 / 8 + 1 / 6, rel=0.01)


def test_every_part_is_that_of_the_photograph(
    low_resolution_design: MirrorDesign, knot: Scene, light_field: LightField
) -> None:
    traced = traced_light_field(low_resolution_design, knot)
    assert traced.capture_mm == light_field.capture_mm
    for name, frame in light_field.frames.items():
        rows, columns = frame.planes["mirror"].shape
        parts = [np.s_[:rows, :columns], np.s_[rows // 3 : rows // 2, 7 : columns // 2]]
        for part in parts + [np.s_[box[2] : box[3], box[0] : box[1]] for box in frame.boxes[::40]]:
            expected, got = frame.read(*part), traced.frames[name].read(*part)
            for plane in PIXEL_ARRAYS:
                assert np.array_equal(got[plane], expected[plane]), plane
                assert got[plane].dtype == expected[plane].dtype
