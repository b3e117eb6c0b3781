"""Lenses in the files of other programs, against what these programs say of them."""

import re
import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.core.optics.camera import Camera, without_distortion
from tbcad.errors import InputError
from tbcad.rig.calibration.intrinsics.files import read_lens
from tbcad.rig.calibration.intrinsics.lens import CalibratedLens, opencv_text

LENS = CalibratedLens(
    focal=np.array([1058.3, 1057.9]),
    principal=np.array([1040.25, 770.5]),
    distortion=np.array([-0.05, 0.01, 1e-3, -5e-4, 1e-3]),
    width_px=2080,
    height_px=1552,
)
TABLE = tomllib.loads((Path(__file__).parent / "refused.toml").read_text("utf-8"))
FILES = Path(__file__).parent / "lens_files"
"""As other programs write the same lens."""
ROS = (FILES / "ros_k3.yaml").read_text()
KALIBR = (FILES / "kalibr.yaml").read_text()
MRCAL = (FILES / "mrcal.cameramodel").read_text()


def mrcal(model: str, more: str) -> str:
    """The same of another model, with other coefficients."""
    return MRCAL.replace("OPENCV4", model).replace("-0.05, 0.01, 1e-3, -5e-4", more)


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


@pytest.mark.parametrize("extension", ["yml", "xml", "json"])
def test_opencv(tmp_path: Path, extension: str) -> None:
    _same(read_lens(_written(tmp_path, extension)), LENS.distortion)


def test_own_file_is_read_by_opencv_and_here(tmp_path: Path) -> None:
    file = tmp_path / "camera.yml"
    file.write_text(opencv_text(LENS, {"rms_px": 0.1}))
    store = cv2.FileStorage(str(file), cv2.FileStorage_READ)
    coefficients = store.getNode("distortion_coefficients").mat()
    assert coefficients.ravel() == pytest.approx(LENS.distortion, abs=0)
    _same(read_lens(file), LENS.distortion)


def _same(found: CalibratedLens, distortion: np.ndarray) -> None:
    assert found.focal == pytest.approx(LENS.focal)
    assert found.principal == pytest.approx(LENS.principal)
    assert found.distortion == pytest.approx(distortion)
    assert (found.width_px, found.height_px) == (2080, 1552)


REFUSED = {
    **TABLE["whole"],
    "splines": (mrcal("SPLINED_STEREOGRAPHIC_order=3", ""), "SPLINED_STEREOGRAPHIC"),
    "rational in mrcal": (
        mrcal("OPENCV8", "0, 0, 0, 0, 0, .1, 0, 0"),
        "mrcal-convert-lensmodel LENSMODEL_OPENCV5",
    ),
    "few in mrcal": (mrcal("OPENCV8", "0, 0, 0, 0"), "has 8 numbers"),
    "overflow in mrcal": (mrcal("OPENCV4", f"{'9' * 400}, 0, 0, 0"), "no finite number"),
    "digits in mrcal": (mrcal("OPENCV4", f"{'9' * 5000}, 0, 0, 0"), "no .cameramodel"),
    "signs in mrcal": (mrcal("OPENCV4", "-" * 100_000 + "1"), "nested too deeply"),
    "deep list": ("camera_matrix: " + "[" * 100_000, "no YAML"),
    "deep blocks": ("- " * 50_000, "nested too deeply"),
    "deep elements": ("<a>" * 50_000 + "</a>" * 50_000, "nested too deeply"),
    "lines": ("\n" * 100_000 + "1 PINHOLE", "is no lens"),
    "skewed": (opencv_text(LENS, {}).replace("[ 1058.3, 0.0,", "[ 1058.3, 5.0,"), "skewed pixels"),
    "fisheye in OpenCV": (opencv_text(LENS, {"fisheye_model": 1}), "lens model fisheye_model: 1"),
}


@pytest.mark.parametrize("file", sorted(FILES.iterdir()), ids=lambda file: str(file.name))
def test_files_of_other_programs(file: Path) -> None:
    k3 = 1e-3 if "k3" in file.stem else 0
    _same(read_lens(file), np.array([-0.05, 0.01, 1e-3, -5e-4, k3]))


@pytest.mark.parametrize(("encoding", "end"), [("utf-8-sig", "\r\n"), ("utf-16", "\r")])
def test_encodings(tmp_path: Path, encoding: str, end: str) -> None:
    file = tmp_path / "camera.yaml"
    file.write_bytes(ROS.replace("\n", end).encode(encoding))
    _same(read_lens(file), LENS.distortion)


def _read(folder: Path, text: str) -> CalibratedLens:
    file = folder / "camera.yaml"
    file.write_text(text)
    return read_lens(file)


@pytest.mark.parametrize("model", ["equidistant", "FISHEYE", "thin_prism", "kannala_brandt4"])
def test_other_models_and_keys_that_may_name_them_are_refused(tmp_path: Path, model: str) -> None:
    for key in ("distortion_model", "camera_model", "lensType"):
        says = "the key 'lensType'" if key == "lensType" else f"the lens model {key}: {model}: use"
        with pytest.raises(InputError, match=says):
            _read(tmp_path, ROS.replace("distortion_model: plumb_bob", f"{key}: {model}"))


PIECES = (*ROS.split("\n"), *KALIBR.split("\n"), *MRCAL.split("\n"), "<a>", "</a>", "\x85", "&a *a")


@settings(max_examples=40)
@given(
    st.one_of(
        st.binary(max_size=60),
        st.text(max_size=60).map(lambda text: (ROS + text).encode("utf-8", "replace")),
        st.lists(st.sampled_from(PIECES), max_size=12).map(lambda rows: "\n".join(rows).encode()),
    )
)
def test_any_file_is_a_lens_or_a_message_of_one_line(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    file = tmp_path_factory.getbasetemp() / "lens"
    file.write_bytes(content)
    try:
        read_lens(file)
    except InputError as error:
        assert str(error).isprintable()  # noqa: PT017


WRONG = {
    **REFUSED,
    **{tail: (f"{ROS}{tail}\n", message) for tail, message in TABLE["tail"].items()},
    **{f"{old} {new:.9}": (ROS.replace(old, new), text) for old, new, text in TABLE["changed"]},
    "two documents": (f"{ROS}---\n{ROS}\n", "2 documents"),
    "no model": (KALIBR.replace("  distortion_model: radtan\n", ""), "names no camera_model and"),
    "two of Kalibr": (KALIBR + KALIBR.replace("cam0", "cam1"), "2 cameras (cam0, cam1): which"),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG)
def test_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as error:
        _read(tmp_path, text)
    assert "\n" not in str(error.value)


def test_another_size_than_the_run() -> None:
    forward, right = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
    camera = without_distortion(Camera(np.zeros(3), forward, right, 1040, 776, 1.5))
    with pytest.raises(InputError, match="2080 x 1552 pixels, the run's have 1040 x 776"):
        LENS.on(camera)
