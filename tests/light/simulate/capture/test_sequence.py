"""Frames of an object that turns, against captures of the turned object."""

import shutil
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tbcad.app.cli import run
from tbcad.errors import InputError
from tbcad.light.simulate.capture.files import read_object
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.capture.photograph import photograph
from tbcad.light.simulate.capture.sequence import sequence_frame
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import Reflector
from tests.light.viewer.fields import write_ball

FRAMES, TURN_DEG = 4, 120.0
SMALL = ["--width", "96", "--height", "72"]


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


def test_a_frame_is_shown_by_its_own_field(
    captured: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "turning"
    shutil.copytree(captured, folder)
    with LightField.open(folder) as source:
        write_ball(sequence_frame(source, folder, 1), folder, frame=1)
    for number, method in (("0", "depth"), ("1", "field")):
        words = ["view", str(folder), *SMALL, "--frame", number, "--force"]
        assert run([*words, "--out", str(tmp_path / "v.png")]) == 0
        assert f"method {method}: " in capsys.readouterr().out
