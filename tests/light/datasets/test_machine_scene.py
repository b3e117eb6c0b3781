"""Scenes of the machine: what Mitsuba and Blender render of them is what a capture shows."""

import ast
import io
import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree as Xml

import numpy as np
import pytest
import trimesh
from PIL import Image

from tbcad.app.cli import run
from tbcad.light.datasets.machine_scene import object_mesh
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.rays import exact_tracer
from tbcad.light.simulate.scene.reflector import read_export

N, SIZE_PX, CROP_PX = 4, (416, 310), 100


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("machine") / "exports"
    words = ["build", "--n", str(N), "--parts", "shell", "--no-verify", "--out", str(out)]
    sizes = ["--set", f"camera.width_px={SIZE_PX[0]}", "--set", f"camera.height_px={SIZE_PX[1]}"]
    assert run([*words, *sizes]) == 0
    return out


@pytest.fixture(scope="module")
def shown(built: Path) -> Path:
    out = built.parent / "knot"
    assert run(["capture", str(built), "--samples", "4", "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def scenes(built: Path, shown: Path) -> Path:
    out = built.parent / "scene"
    words = ["dataset", str(shown), "--to", "mitsuba", "--exports", str(built), "--out", str(out)]
    assert run(words) == 0
    ast.parse((out / "blender.py").read_text(encoding="utf-8"))
    return out


class Crop(NamedTuple):
    """A square of a photograph: where, colours (s, s, 3), and where a mirror is seen (s, s)."""

    left: int
    top: int
    colours: np.ndarray
    seen: np.ndarray

    def of(self, picture: np.ndarray) -> np.ndarray:
        """The same square of another picture or map."""
        return picture[self.top : self.top + CROP_PX, self.left : self.left + CROP_PX]


def crop_at_the_object(shown: Path, built: Path, camera: str) -> Crop:
    """Amid the pixels that see the object by a mirror."""
    picture = np.asarray(Image.open(shown / f"camera_{camera}.png")).astype(float)
    reflector = read_export(built).reflectors["ab".index(camera)]
    mirror = exact_tracer(reflector)(range(SIZE_PX[1]), (0.0, 0.0)).mirror
    rows, columns = np.nonzero((picture.max(axis=2) > 30) & (mirror > 0))
    top = int(np.clip(np.median(rows) - CROP_PX / 2, 0, SIZE_PX[1] - CROP_PX))
    left = int(np.clip(np.median(columns) - CROP_PX / 2, 0, SIZE_PX[0] - CROP_PX))
    place = Crop(left, top, picture, mirror > 0)
    return place._replace(colours=place.of(picture), seen=place.of(mirror > 0))


def check_same(rendered: np.ndarray, crop: Crop) -> None:
    """The same colours but at edges, and mirrors in the same places."""
    assert (crop.colours.max(axis=2) > 30).mean() > 0.1
    # With the facets' own normals: more than 4.
    assert np.abs(rendered - crop.colours)[crop.seen].mean() < 1.5
    assert edge_shift(rendered, crop.colours, crop.seen) < 0.005


@pytest.mark.slow
@pytest.mark.clients
@pytest.mark.parametrize("camera", ["a", "b"])
def test_mitsuba_sees_what_the_capture_shows(
    scenes: Path, shown: Path, built: Path, camera: str
) -> None:
    crop = crop_at_the_object(shown, built, camera)
    check_same(crop_by_mitsuba(scenes / f"camera_{camera}.xml", crop.left, crop.top), crop)


@pytest.fixture(scope="module")
def by_blender(scenes: Path) -> Path:
    """The folder that Blender has written its photographs to."""
    command = shlex.split(os.environ.get("BLENDER", ""))
    if not command:
        pytest.skip("BLENDER does not name a Python with bpy")
    subprocess.run([*command, scenes / "blender.py"], check=True)
    return scenes


@pytest.mark.slow
@pytest.mark.clients
@pytest.mark.parametrize("camera", ["a", "b"])
def test_blender_sees_what_the_capture_shows(
    by_blender: Path, shown: Path, built: Path, camera: str
) -> None:
    crop = crop_at_the_object(shown, built, camera)
    picture = np.asarray(Image.open(by_blender / f"camera_{camera}.png")).astype(float)
    assert picture.shape == (SIZE_PX[1], SIZE_PX[0], 3)
    check_same(crop.of(picture), crop)


RENDER = """
import sys, mitsuba, numpy
mitsuba.set_variant("scalar_rgb")
numpy.save(sys.argv[2], numpy.array(mitsuba.render(mitsuba.load_file(sys.argv[1]))))
"""


def crop_by_mitsuba(path: Path, left: int, top: int) -> np.ndarray:
    """A crop (s, s, 3) of a scene, 0 to 255, by a process of its own: tbcad has another Embree."""
    scene = Xml.parse(path)
    film: Any = scene.getroot().find("sensor/film")
    names = "offset_x", "offset_y", "width", "height"
    for name, value in zip(names, (left, top, CROP_PX, CROP_PX), strict=True):
        Xml.SubElement(film, "integer", name=f"crop_{name}", value=str(value))
    cropped, result = path.with_name(f"cropped_{path.name}"), path.with_suffix(".npy")
    scene.write(cropped)
    subprocess.run([sys.executable, "-c", RENDER, cropped, result], check=True)
    return np.asarray(np.minimum(255 * np.load(result)[..., :3], 255))


def edge_shift(rendered: np.ndarray, expected: np.ndarray, seen: np.ndarray) -> float:
    """How far, in pixels, one picture is moved against the other, by least squares (Lucas 1981)."""
    grey, other = expected.mean(axis=2), rendered.mean(axis=2)
    down, across = np.gradient(grey)
    table = np.stack([across[seen], down[seen]], axis=1)
    shift = np.linalg.lstsq(table, (grey - other)[seen], rcond=None)[0]
    return float(np.abs(shift).max())


def test_patterns_are_sampled_finely() -> None:
    corners = np.array([[0.0, 0, 0], [20, 0, 0], [0, 20, 0]])
    up = np.tile([0.0, 0, 1], (3, 1))
    subject = SceneObject(
        "plate", corners, np.array([[0, 1, 2]]), up, np.full((1, 3, 3), 0.5), patterned=True
    )
    mesh = object_mesh(prepared_scene(subject))
    area = np.cross(
        mesh.points[mesh.faces[:, 1]] - mesh.points[mesh.faces[:, 0]],
        mesh.points[mesh.faces[:, 2]] - mesh.points[mesh.faces[:, 0]],
    )
    for side in (1, -1):  # a plate is seen from both
        assert (side * area[:, 2]).clip(0).sum() / 2 == pytest.approx(200)
    assert sorted({float(z) for z in mesh.points[:, 2]}) == pytest.approx([-0.001, 0])
    sides = mesh.points[mesh.faces] - np.roll(mesh.points[mesh.faces], 1, axis=1)
    assert np.linalg.norm(sides, axis=2).max() <= 1.0
    cloud = trimesh.load(io.BytesIO(mesh.ply()), file_type="ply", process=False)
    assert len(cloud.faces) == len(mesh.faces)
