"""OpenCV's files of a camera's lens: read by OpenCV, written by hand for the same bytes."""

from typing import TYPE_CHECKING, Any

import numpy as np

from tbcad.calibration.intrinsics.lens import Lens
from tbcad.errors import InputError
from tbcad.types import Floats

if TYPE_CHECKING:
    from collections.abc import Iterable

MATRICES = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M", "M1")
COEFFICIENTS = (
    "distortion_coefficients",
    "Distortion_Coefficients",
    "dist_coeffs",
    "distCoeffs",
    "dist_coeff",
    "D",
    "D1",
)
WIDTHS, HEIGHTS = ("image_width", "image_Width"), ("image_height", "image_Height")
SKEW = 1e-6  # of the focal length, that is taken for none
INSTALL = "pip install 'tbcad[machine]'"


def cv() -> Any:
    """OpenCV.

    Raises:
        InputError: it is not installed.
    """
    try:
        import cv2
    except ImportError:
        raise InputError(f"OpenCV is needed for this: {INSTALL}") from None
    return cv2


def opencv_lens(text: str, name: str) -> tuple[Floats, tuple[int, int] | None]:
    """Focal lengths, principal point and coefficients of a file's text, and the picture's size.

    Raises:
        InputError: it cannot be read, or names no camera matrix; a fisheye, or skewed pixels.
    """
    cv2 = cv()
    try:
        store = cv2.FileStorage(text, cv2.FileStorage_READ | cv2.FileStorage_MEMORY)
        matrix, coefficients = (_matrix(store, names) for names in (MATRICES, COEFFICIENTS))
        width, height = (_number(store, names) for names in (WIDTHS, HEIGHTS))
        fisheye = _number(store, ("fisheye_model",))
    except (cv2.error, SystemError) as error:
        first = str(error).strip().splitlines()[0] if str(error).strip() else "damaged"
        raise InputError(f"{name} cannot be read by OpenCV: {first:.120}") from None
    if matrix is None or matrix.shape != (3, 3):
        raise InputError(f"{name} has no camera_matrix of 3 x 3 numbers: export it again")
    if fisheye:
        raise InputError(f"{name} is of a fisheye lens: calibrate it without the fisheye model")
    if abs(matrix[0, 1]) > SKEW * abs(matrix[0, 0]):
        raise InputError(f"{name} has skewed pixels, which are not supported: calibrate without")
    rest = np.zeros(0) if coefficients is None else coefficients.ravel()
    values = np.concatenate([matrix[[0, 1], [0, 1]], matrix[:2, 2], rest])
    return values, (int(width), int(height)) if width and height else None


def _matrix(store: Any, names: "Iterable[str]") -> Floats | None:
    for name in names:
        node = store.getNode(name)
        if not node.empty() and (matrix := node.mat()) is not None:
            return np.asarray(matrix, dtype=np.float64)
    return None


def _number(store: Any, names: "Iterable[str]") -> float:
    for name in names:
        node = store.getNode(name)
        if not node.empty() and (node.isInt() or node.isReal()):
            return float(node.real())
    return 0.0


def opencv_text(lens: Lens, facts: dict[str, float | int | str]) -> str:
    """A lens as OpenCV's YAML, which cv2.FileStorage and `read_lens` read.

    Args:
        lens: with the size of its pictures.
        facts: further keys.
    """
    (fx, fy), (cx, cy) = lens.focal.tolist(), lens.principal.tolist()
    lines = [
        "%YAML:1.0",
        "---",
        f"image_width: {lens.width_px}",
        f"image_height: {lens.height_px}",
        *_yaml_matrix("camera_matrix", (3, 3), [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]),
        *_yaml_matrix("distortion_coefficients", (5, 1), lens.distortion.tolist()),
        *(f"{key}: {_yaml(value)}" for key, value in facts.items()),
    ]
    return "\n".join(lines) + "\n"


def _yaml(value: float | int | str) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _yaml_matrix(name: str, shape: tuple[int, int], values: list[float]) -> list[str]:
    numbers = ", ".join(repr(value) for value in values)
    return [
        f"{name}: !!opencv-matrix",
        f"   rows: {shape[0]}",
        f"   cols: {shape[1]}",
        "   dt: d",
        f"   data: [ {numbers} ]",
    ]
