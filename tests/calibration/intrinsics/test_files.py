"""Lenses in the files of OpenCV, mrcal and COLMAP, against what these programs say of them."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from tbcad.calibration.intrinsics.files import read_lens
from tbcad.calibration.intrinsics.lens import Lens
from tbcad.calibration.intrinsics.opencv import opencv_text
from tbcad.errors import InputError
from tbcad.optics.camera import Camera
from tbcad.optics.lens_camera import without_distortion

LENS = Lens(
    focal=np.array([1058.3, 1057.9]),
    principal=np.array([1040.25, 770.5]),
    distortion=np.array([-0.05, 0.01, 1e-3, -5e-4, 1e-3]),
    width_px=2080,
    height_px=1552,
)
FOUR = "1058.3 1057.9 1040.75 771.0"
MRCAL = """# mrcal camera model; comments may be anywhere
{{
    'lensmodel':  '{model}',
    'extrinsics': [ 0., 0, 0, 0, 0, 0,],
    'intrinsics': [ 1058.3, 1057.9, 1040.25, 770.5{more}],
    'imagersize': [ 2080, 1552,],
    'icam_intrinsics': 0,
}}
"""


def _written(path: Path, extension: str) -> Path:
    """By OpenCV itself, as its own program of calibration names the keys."""
    file = path / f"camera.{extension}"
    store = cv2.FileStorage(str(file), cv2.FileStorage_WRITE)
    (fx, fy), (cx, cy) = LENS.focal, LENS.principal
    store.write("image_width", 2080)
    store.write("image_height", 1552)
    store.write("camera_matrix", np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]))
    store.write("distortion_coefficients", LENS.distortion[:, None])
    store.release()
    return file


@pytest.mark.parametrize("extension", ["yml", "xml"])
def test_opencv(tmp_path: Path, extension: str) -> None:
    _same(read_lens(_written(tmp_path, extension)), LENS.distortion)


def test_own_file_is_read_by_opencv_and_here(tmp_path: Path) -> None:
    file = tmp_path / "camera.yml"
    file.write_text(opencv_text(LENS, {"rms_px": 0.1}))
    store = cv2.FileStorage(str(file), cv2.FileStorage_READ)
    coefficients = store.getNode("distortion_coefficients").mat()
    assert coefficients.ravel() == pytest.approx(LENS.distortion, abs=0)
    _same(read_lens(file), LENS.distortion)


def test_mrcal(tmp_path: Path) -> None:
    file = tmp_path / "camera.cameramodel"
    file.write_text(MRCAL.format(model="LENSMODEL_OPENCV4", more=", -0.05, 0.01, 1e-3, -5e-4"))
    _same(read_lens(file), np.array([-0.05, 0.01, 1e-3, -5e-4, 0]))


def test_colmap_counts_from_the_pixels_corner(tmp_path: Path) -> None:
    file = tmp_path / "cameras.txt"
    file.write_text(f"# Camera list\n1 OPENCV 2080 1552 {FOUR} -0.05 0.01 1e-3 -5e-4\n")
    _same(read_lens(file), np.array([-0.05, 0.01, 1e-3, -5e-4, 0]))


def _same(found: Lens, distortion: np.ndarray) -> None:
    assert found.focal == pytest.approx(LENS.focal)
    assert found.principal == pytest.approx(LENS.principal)
    assert found.distortion == pytest.approx(distortion)
    assert (found.width_px, found.height_px) == (2080, 1552)


REFUSED: dict[str, tuple[str, str]] = {
    "nothing": ("hello", "is no lens"),
    "splines": (
        MRCAL.format(model="LENSMODEL_SPLINED_STEREOGRAPHIC_order=3", more=""),
        "SPLINED_STEREOGRAPHIC",
    ),
    "rational": (
        MRCAL.format(model="LENSMODEL_OPENCV8", more=", 0, 0, 0, 0, 0, .1, 0, 0"),
        "more than five coefficients",
    ),
    "broken": ("{'lensmodel': 'LENSMODEL_PINHOLE', 'intrinsics': [", "no .cameramodel"),
    "fisheye": (f"1 OPENCV_FISHEYE 2080 1552 {FOUR} 0 0 0 0\n", "OPENCV_FISHEYE"),
    "two": (f"1 PINHOLE 2080 1552 {FOUR}\n2 PINHOLE 2080 1552 {FOUR}\n", "has 2 cameras"),
    "few": ("1 PINHOLE 2080 1552 1058.3 1040 770\n", "has 4 parameters, found 3"),
    "tiny": ("1 PINHOLE 2080 1552 3.5 3.5 1040 776\n", "do not fit a picture"),
    "folded": ("1 RADIAL 2080 1552 1058.3 1040 776 -0.9 0\n", "folds the picture"),
    "no matrix": ("%YAML:1.0\n---\nimage_width: 2080\n", "no camera_matrix"),
    "skewed": (
        opencv_text(LENS, {}).replace("[ 1058.3, 0.0,", "[ 1058.3, 5.0,"),
        "skewed pixels",
    ),
    "fisheye in OpenCV": (opencv_text(LENS, {"fisheye_model": 1}), "fisheye lens"),
    "damaged": ("%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: [", "read by OpenCV"),
}


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=REFUSED)
def test_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "lens"
    file.write_text(text)
    with pytest.raises(InputError, match=re.escape(message)) as error:
        read_lens(file)
    assert "\n" not in str(error.value)


def test_another_size_than_the_run() -> None:
    forward, right = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
    camera = without_distortion(Camera(np.zeros(3), forward, right, 1040, 776, 1.5))
    with pytest.raises(InputError, match="2080 x 1552 pixels, the run's have 1040 x 776"):
        LENS.on(camera)
