"""The light field's file: what is written is read, in parts too; other files are refused."""

import gc
from pathlib import Path

import h5py
import numpy as np
import pytest

from tbcad.errors import InputError
from tbcad.light.simulate.capture.files import create_light_field, write_camera
from tbcad.light.simulate.capture.light_field import PIXEL_ARRAYS, LightField
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector

Cameras = tuple[Reflector, Reflector]


def write_light_field(path: Path, cameras: Cameras, scene: Scene) -> Path:
    with create_light_field(path, 60.0, {"object": "knot"}) as store:
        for at in cameras:
            write_camera(store, at, photograph(at.camera, exact_tracer(at), scene))
    return path


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory, cameras: Cameras, knot: Scene) -> Path:
    return write_light_field(tmp_path_factory.mktemp("field") / "lightfield.h5", cameras, knot)


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


def test_boxes_hold_all_of_each_mirror(light_field: LightField) -> None:
    for frame in light_field.frames.values():
        rows, columns = np.nonzero(frame.planes["mirror"])
        box = frame.boxes[frame.planes["mirror"][rows, columns].astype(int) - 1]
        assert ((columns >= box[:, 0]) & (columns < box[:, 1])).all()
        assert ((rows >= box[:, 2]) & (rows < box[:, 3])).all()


def test_compressed_and_the_same_each_time(
    file: Path, tmp_path: Path, cameras: Cameras, knot: Scene
) -> None:
    again = write_light_field(tmp_path / "again.h5", cameras, knot)
    assert again.read_bytes() == file.read_bytes()
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
