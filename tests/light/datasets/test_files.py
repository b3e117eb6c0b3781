"""What other programs read, read as their documentation says, by code of the tests' own."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial.transform import Rotation

from tbcad.core.optics.camera import Camera
from tbcad.light.datasets.virtual_cameras import Crop, MirrorId, read_crop
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays
from tbcad.light.simulate.scene.rays import view_directions

Document = dict[str, Any]


def picture_of(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path))


def opengl_pixels(document: Document, frame: Document, points: np.ndarray) -> np.ndarray:
    """Where nerfstudio and instant-ngp see points: x right, y up, looking along -z, (n, 2).

    In pixels from the picture's corner: the middle of the first pixel is (0.5, 0.5).
    """
    value = {**document, **frame}
    local = np.c_[points, np.ones(len(points))] @ np.linalg.inv(frame["transform_matrix"]).T
    x, y, z = local[:, 0], local[:, 1], local[:, 2]
    assert (z < 0).all()
    return np.stack(
        [value["cx"] + value["fl_x"] * x / -z, value["cy"] - value["fl_y"] * y / -z], axis=1
    )


def ray_traced(scene: Scene, camera: Camera, shift: tuple[float, float]) -> np.ndarray:
    """The mean of 2 x 2 rays a pixel, all of them shifted by parts of a pixel."""
    total = np.zeros((camera.height_px, camera.width_px, 3))
    for x in (-0.25, 0.25):
        for y in (-0.25, 0.25):
            direction = view_directions(camera, (x + shift[0], y + shift[1])).reshape(-1, 3)
            start = np.broadcast_to(camera.pinhole, direction.shape)
            total += cast_rays(scene, start, direction).colour.reshape(total.shape) / 4
    return total


class TestNerfstudio:
    def test_what_its_reader_asks_for(
        self, transforms: Document, exported: dict[str, Path]
    ) -> None:
        """Keys by its documentation; with one mask every frame needs one."""
        assert transforms["camera_model"] == "OPENCV"
        assert transforms["orientation_override"] == "none"
        assert all(transforms[name] == 0 for name in ("k1", "k2", "p1", "p2"))
        folder = exported["nerfstudio"]
        names = [frame["file_path"] for frame in transforms["frames"]]
        assert names == sorted(set(names))
        for frame in transforms["frames"]:
            picture, mask = (picture_of(folder / frame[key]) for key in ("file_path", "mask_path"))
            assert picture.shape == (transforms["h"], transforms["w"], 3)
            assert mask.shape == picture.shape[:2]
            assert set(np.unique(mask)) <= {0, 255}
            assert not picture[mask == 0].any()
            matrix = np.array(frame["transform_matrix"])
            assert matrix[:3, :3].T @ matrix[:3, :3] == pytest.approx(np.eye(3), abs=1e-9)
            assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1)
            assert matrix[3].tolist() == [0, 0, 0, 1]

    def test_pictures_are_centred_to_a_part_of_a_pixel(
        self, transforms: Document, exported: dict[str, Path], scene: Scene
    ) -> None:
        """Truth a quarter of a pixel aside, in any direction, resembles them less, a flip much."""
        size = transforms["w"]
        assert (transforms["cx"], transforms["cy"]) == (size / 2, transforms["h"] / 2)
        shifts = ((0.0, 0.0), (0.25, 0.0), (-0.25, 0.0), (0.0, 0.25), (0.0, -0.25))
        errors = []
        for frame in transforms["frames"][::10]:
            picture, mask = (
                picture_of(exported["nerfstudio"] / frame[key]).astype(float)
                for key in ("file_path", "mask_path")
            )
            matrix, focal = np.array(frame["transform_matrix"]), frame["fl_x"]
            hfov = 2 * np.arctan(size / 2 / focal)
            camera = Camera(matrix[:3, 3], -matrix[:3, 2], matrix[:3, 0], size, size, hfov)
            truths = [ray_traced(scene, camera, shift) for shift in shifts]
            truths.append(truths[0][:, ::-1])
            errors.append([((truth - picture) ** 2)[mask > 0].mean() for truth in truths])
        centred, *aside, flipped = np.median(errors, axis=0)
        assert centred < min(aside)
        assert centred < flipped / 10


class TestColmap:
    def test_it_is_what_nerfstudio_gets(
        self, exported: dict[str, Path], transforms: Document
    ) -> None:
        """World to camera with y down against camera to world with y up, by its text form."""
        model = exported["colmap"] / "sparse" / "0"
        cameras, images, points = (
            [line.split() for line in _lines(model / f"{name}.txt")]
            for name in ("cameras", "images", "points3D")
        )
        table = np.array(points, dtype=float)
        cloud = trimesh.load(exported["nerfstudio"] / transforms["ply_file_path"])
        assert len(cloud.vertices) > 1000
        assert np.asarray(cloud.vertices) == pytest.approx(table[:, 1:4], abs=1e-4)
        assert (np.asarray(cloud.colors)[:, :3] == table[:, 4:7]).all()
        assert images[1::2] == [[]] * len(cameras)  # points without tracks
        for frame, camera, image in zip(transforms["frames"], cameras, images[::2], strict=True):
            number, *pose, own, name = image
            assert (number, own) == (camera[0], camera[0])
            assert name == Path(frame["file_path"]).name
            w, x, y, z, *shift = map(float, pose)
            turn = Rotation.from_quat([x, y, z, w]).as_matrix()
            assert -turn.T @ shift == pytest.approx(np.array(frame["transform_matrix"])[:3, 3])
            assert camera[1] == "PINHOLE"
            width, height, fx, fy, cx, cy = map(float, camera[2:])
            point = np.array([7.0, -4.0, 5.0])
            local = turn @ point + shift
            pixel = [cx + fx * local[0] / local[2], cy + fy * local[1] / local[2]]
            assert pixel == pytest.approx(opengl_pixels(transforms, frame, point[None])[0])
            assert (width, height) == (transforms["w"], transforms["h"])

    def test_pictures_are_those_for_nerfstudio(self, exported: dict[str, Path]) -> None:
        """COLMAP names the mask of a0001.png a0001.png.png."""
        folders = [exported[name] for name in ("nerfstudio", "colmap")]
        names = sorted(path.name for path in (folders[0] / "images").iterdir())
        for name in names:
            one, other = ((folder / "images" / name).read_bytes() for folder in folders)
            assert one == other
            mask = (folders[0] / "masks" / name).read_bytes()
            assert mask == (folders[1] / "masks" / f"{name}.png").read_bytes()

    @pytest.mark.clients
    @pytest.mark.parametrize("suffix", ["bin", "txt"])
    def test_pycolmap_reads_it(
        self, exported: dict[str, Path], transforms: Document, tmp_path: Path, suffix: str
    ) -> None:
        pycolmap = pytest.importorskip("pycolmap")
        for path in (exported["colmap"] / "sparse" / "0").glob(f"*.{suffix}"):
            (tmp_path / path.name).write_bytes(path.read_bytes())
        model = pycolmap.Reconstruction(tmp_path)
        assert len(model.images) == len(model.cameras) == len(transforms["frames"])
        assert len(model.points3D) == len(_lines(exported["colmap"] / "sparse/0/points3D.txt"))
        frames = {Path(frame["file_path"]).name: frame for frame in transforms["frames"]}
        points = np.array([[7.0, -4.0, 5.0], [-11.0, 3.0, -9.0]])
        for image in model.images.values():
            frame = frames[image.name]
            centre = np.array(frame["transform_matrix"])[:3, 3]
            assert image.projection_center() == pytest.approx(centre)
            pixels = [image.project_point(point) for point in points]
            assert np.array(pixels) == pytest.approx(opengl_pixels(transforms, frame, points))


def crop_of(field: LightField, name: str) -> Crop:
    crop = read_crop(field, MirrorId(name[0], int(name[1:]) - 1))
    assert crop is not None
    return crop


def rays_in(folder: Path, frame: Document) -> tuple[np.ndarray, np.ndarray]:
    """The rays (h, w, 6) of a frame for instant-ngp, and whether its pixels are used."""
    path, shape = folder / frame["file_path"], (frame["h"], frame["w"], 6)
    table = np.fromfile(path.parent / f"rays_{path.stem}.dat", "<f4").reshape(shape)
    return table, picture_of(path.parent / f"dynamic_mask_{path.stem}.png") == 0


class TestRays:
    def test_instant_ngp_gets_every_ray_as_captured(
        self, exported: dict[str, Path], field: LightField
    ) -> None:
        folder = exported["ngp-rays"]
        document = json.loads((folder / "transforms.json").read_text())
        assert document["aabb"] == [[-30.0] * 3, [30.0] * 3]
        rays = 0
        for frame in document["frames"]:
            path = folder / frame["file_path"]
            crop = crop_of(field, path.stem)
            picture = picture_of(path)
            assert picture.shape == (frame["h"], frame["w"], 3)
            table, used = rays_in(folder, frame)
            assert np.array_equal(used[:, ::-1], crop.meets)
            expected = np.concatenate([crop.origin, crop.direction], axis=2)[crop.meets]
            assert np.array_equal(table[:, ::-1][crop.meets], expected.astype(np.float32))
            assert np.array_equal(picture[:, ::-1][crop.meets], crop.colour[crop.meets])
            length = np.linalg.norm(table[..., 3:], axis=2)
            assert length == pytest.approx(np.ones_like(length), abs=1e-5)
            rays += int(used.sum())
        assert rays == sum(_meeting(field, frame) for frame in field.frames)

    def test_its_poses_are_about_those_of_the_rays(self, exported: dict[str, Path]) -> None:
        """A plain pinhole fits a raw crop but for a pixel or so; a flipped one not at all."""
        folder = exported["ngp-rays"]
        document = json.loads((folder / "transforms.json").read_text())
        errors, flipped = [], []
        for frame in document["frames"]:
            table, used = rays_in(folder, frame)
            rows, columns = np.nonzero(used)
            origin, way = np.split(table[used].astype(float), 2, axis=1)
            points = origin - (origin * way).sum(axis=1, keepdims=True) * way
            pixels = opengl_pixels(document, frame, points)
            for found, column in ((errors, columns), (flipped, frame["w"] - 1 - columns)):
                off = pixels - np.stack([column + 0.5, rows + 0.5], axis=1)
                found.append(np.sqrt((off**2).sum(axis=1).mean()))
        assert np.median(errors) < 1
        assert np.median(flipped) > 8 * np.median(errors)

    def test_numpy_reads_all_rays(self, exported: dict[str, Path], field: LightField) -> None:
        """From both files."""
        with np.load(exported["rays"] / "rays.npz", allow_pickle=False) as table:
            arrays = {name: table[name] for name in table.files}
        with h5py.File(exported["rays"] / "rays.h5") as store:
            for name, values in arrays.items():
                stored = store[name].asstr()[:] if name == "name" else store[name][:]
                assert np.array_equal(stored, values)
                assert name == "name" or stored.dtype == values.dtype
        assert set(arrays) == {"origin", "direction", "colour", "camera", "name", "centre"}
        assert len(arrays["origin"]) == sum(_meeting(field, frame) for frame in field.frames)
        for k in (0, 17, len(arrays["name"]) - 1):
            crop = crop_of(field, str(arrays["name"][k]))
            mine = arrays["camera"] == k
            assert np.array_equal(arrays["colour"][mine], crop.colour[crop.meets])
            for key, expected in zip(("origin", "direction"), crop.rays, strict=True):
                assert np.array_equal(arrays[key][mine], expected.astype(np.float32))
            off = np.cross(crop.rays[0] - arrays["centre"][k], crop.rays[1])
            assert np.linalg.norm(off, axis=1).max() < 3


def _meeting(field: LightField, name: str) -> int:
    """Number of rays of a frame that pass the origin by less than the sphere's radius."""
    planes = field.frames[name].planes
    on = planes["mirror"] > 0
    origin, way = planes["origin"][on].astype(float), planes["direction"][on].astype(float)
    return int((np.linalg.norm(np.cross(origin, way), axis=1) <= 30).sum())


def _lines(path: Path) -> list[str]:
    return [one for one in path.read_text("utf-8").split("\n")[:-1] if not one.startswith("#")]
