"""OpenCV, and its files of a camera's lens: written by hand for the same bytes."""

from typing import Any

from tbcad.calibration.intrinsics.lens import Lens
from tbcad.errors import InputError

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
