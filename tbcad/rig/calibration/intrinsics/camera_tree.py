"""The one camera that a file of OpenCV, ROS or Kalibr describes, and the lens that it has."""

import re
from collections.abc import Iterator
from typing import TypeAlias

import numpy as np

from tbcad.errors import InputError
from tbcad.rig.calibration.intrinsics.lens import USABLE, CalibratedLens, lens_of, numbers_of
from tbcad.types import Floats

Tree: TypeAlias = "dict[str, Tree] | list[Tree] | str"
Node = dict[str, Tree]

SIDE = r"(?P<side>_?(\d|left|right|l|r))?"  # which of several cameras a key is of
MATRIX = re.compile(
    rf"(camera_?(matrix|mat)|(camera_?)?intrinsics?_?matrix|intrinsics?|mtx|k|m){SIDE}", re.I
)
COEFFICIENTS = re.compile(
    rf"(dist(ortion)?|(dist(ortion)?_?)?(coeff?s?|coefficients|vector|parameters)|d){SIDE}", re.I
)
WIDTH, HEIGHT = (re.compile(rf"((image|img)_?)?{side}", re.I) for side in ("width", "height"))
SIZE = re.compile(r"((image|img|picture)_?)?size|resolution", re.I)
BINNING = re.compile(r"binning(_[xy])?", re.I)
KALIBR = re.compile(r"intrinsics", re.I)
# Keys that may name a model, those that do if they are not 0, and words that name another one.
MODEL_KEY = re.compile(r".*model.*|.*(type|projection)|distortion|dist", re.I)
OTHER_KEY = re.compile(
    r".*(fish_?eye|omni|equi_?dist|kannala|scaramuzza|ocam|thin_?prism|tilt).*|xi", re.I
)
OTHER_VALUE = re.compile(
    r"fish.?eye|equi|omni|\bfov\b|\bmei\b|kannala|brandt|scaramuzza|ocam|\be?ucm\b|double.?sphere"
    r"|thin.?prism|tilted|division|cahvor|spline|stereographic|spherical|unified|f.?theta",
    re.I,
)
NO_MODEL_KEY = re.compile(r".*(name|time|comment|note|serial|description|path|file|topic|id)", re.I)
NO_TYPE_KEY = re.compile(r"dtype|.*(board|target|pattern|sensor|pixel|file|data|image).*", re.I)
SUPPORTED = {"pinhole", "perspective", "plumbbob", "radtan", "radialtangential", "opencv"}
SUPPORTED |= {"rationalpolynomial", "pinholeradtan", "pinholeplumbbob"}  # by the coefficients
OFF, UNNAMED = {"0", "false", "no", "off"}, {"", "none", "null", "~"}
COUNTS = (0, 4, 5, 8, 12, 14)
SKEW = 1e-6  # of the focal length, that is taken for none
FULL = {"0", "1"}  # binning of a picture of all pixels


def camera_lens(tree: Node, name: str) -> CalibratedLens:
    """The lens of the only camera of a file's tree of mappings, lists and texts.

    InputError: it has no camera or several, another model of the lens, or a part of the picture's
    pixels.
    """
    cameras = list(_cameras(tree, ""))
    if len(cameras) > 1:
        raise InputError(
            f"{name} has {len(cameras)} cameras ({', '.join(label for label, *_ in cameras):.80}): "
            "which took the photographs? keep its part of the file"
        )
    models = list(_models(tree, name))
    if not cameras:
        raise InputError(f"{name} has no camera_matrix of 3 x 3 numbers: export it again")
    _, camera, key, side = cameras[0]
    _check_all_pixels({**tree, **camera}, name)
    coefficients = _coefficients(camera, side, name)
    focal_and_principal = _intrinsics(camera, key, models, name)
    if UNNAMED & {model.lower() for model in models} and numbers_of(coefficients, name).any():
        raise InputError(f"{name} names no model of its distortion: {USABLE}")
    return lens_of(focal_and_principal, coefficients, _size({**tree, **camera}, name), name)


def _cameras(node: Tree, label: str) -> Iterator[tuple[str, Node, str, str]]:
    """Label, mapping, key of the matrix and its side, for each camera in a tree."""
    if isinstance(node, list):
        for number, inner in enumerate(node):
            yield from _cameras(inner, f"{label}[{number}]")
    if not isinstance(node, dict):
        return
    for key, value in node.items():
        found = MATRIX.fullmatch(key)
        if found and (isinstance(value, list) or (isinstance(value, dict) and "data" in value)):
            yield label or key, node, key, found["side"] or ""
        else:
            yield from _cameras(value, key)


def _models(node: Tree, name: str, key: str = "") -> Iterator[str]:
    """Names of models in a tree, all of which are supported."""
    if isinstance(node, str):
        yield from _model(key, node.strip(), name)
    elif isinstance(node, dict):
        for inner, value in node.items():
            if OTHER_KEY.fullmatch(inner) and isinstance(value, dict):
                raise _other(inner, "", name)
            yield from _models(value, name, key if inner == "data" else inner)
    else:
        for value in node:
            yield from _models(value, name, key)


def _model(key: str, value: str, name: str) -> Iterator[str]:
    plain = re.sub(r"[^a-z0-9]", "", value.lower())
    if OTHER_KEY.fullmatch(key) and plain not in OFF | UNNAMED:
        raise _other(key, value, name)
    if NO_MODEL_KEY.fullmatch(key) or OTHER_KEY.fullmatch(key):
        return
    if OTHER_VALUE.search(value):
        raise _other(key, value, name)
    if MODEL_KEY.fullmatch(key) and not NO_TYPE_KEY.fullmatch(key) and not _is_number(key, value):
        if plain not in SUPPORTED | UNNAMED:
            raise _other(key, value, name)
        yield value


def _is_number(key: str, value: str) -> bool:
    """Whether a text is a number that names no model; "distortion_model: 3" does."""
    try:
        float(value)
    except ValueError:
        return False
    return "model" not in key.lower()


def _other(key: str, value: str, name: str) -> InputError:
    said = f"{key:.40}: {value:.40}" if value else f"{key:.40}"
    return InputError(f"{name} has the lens model {said}: {USABLE}")


def _check_all_pixels(camera: Node, name: str) -> None:
    """Refuse a matrix of all pixels where the pictures have some of them."""
    for key, value in camera.items():
        if BINNING.fullmatch(key) and value not in FULL:
            raise InputError(
                f"{name} has {key}, so the matrix is of another picture: calibrate the photographs "
                "as they are"
            )
    region = camera.get("roi", {})
    if isinstance(region, dict) and any(
        text not in ("", "0", "false", "False") for text in region.values()
    ):
        raise InputError(
            f"{name} has a roi, so the matrix is of another picture: calibrate the photographs as "
            "they are"
        )


def _coefficients(camera: Node, side: str, name: str) -> list[str]:
    found = [
        value
        for key, value in camera.items()
        if (match := COEFFICIENTS.fullmatch(key)) and (match["side"] or "") == side
        if not isinstance(value, str)  # the name of a model
    ]
    flat = [
        # A mapping without data holds them beside their model.
        _coefficients(value, "", name)
        if isinstance(value, dict) and "data" not in value
        else _numbers(value, name)
        for value in found
    ]
    if not flat or any(one != flat[0] for one in flat):
        what = "no distortion_coefficients" if not flat else "two lists of distortion coefficients"
        raise InputError(f"{name} has {what}: give k1, k2, p1, p2, k3, of a lens without, zeros")
    if len(flat[0]) not in COUNTS:
        raise InputError(
            f"{name} has {len(flat[0])} coefficients of distortion, OpenCV's are "
            f"{', '.join(map(str, COUNTS))}: give k1, k2, p1, p2, k3"
        )
    return flat[0]


def _intrinsics(camera: Node, key: str, models: list[str], name: str) -> list[float]:
    """Focal lengths and principal point, from a matrix or Kalibr's four numbers."""
    numbers = numbers_of(_numbers(camera[key], name), name)
    if KALIBR.fullmatch(key) and len(numbers) == 4:
        if len(models) < 2:
            raise InputError(f"{name} names no camera_model and distortion_model: {USABLE}")
        return list(map(float, numbers))
    if len(numbers) != 9:
        raise InputError(f"{name} has no camera_matrix of 3 x 3 numbers: export it again")
    return _of_matrix(numbers.reshape(3, 3), name)


def _of_matrix(matrix: Floats, name: str) -> list[float]:
    if abs(matrix[0, 1]) > SKEW * abs(matrix[0, 0]):
        raise InputError(f"{name} has skewed pixels, which are not supported: calibrate without")
    if matrix[1, 0] != 0 or not np.array_equal(matrix[2], [0, 0, 1]):
        raise InputError(
            f"{name}: the camera matrix is not fx 0 cx, 0 fy cy, 0 0 1: export it again"
        )
    return [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]]


def _numbers(node: Tree, name: str) -> list[str]:
    """Numbers of a matrix: OpenCV's mapping, or lists in lists."""
    if isinstance(node, str):
        return [node]
    if isinstance(node, list):
        return [text for value in node for text in _numbers(value, name)]
    values = _numbers(node.get("data", []), name)
    shape = [node.get(side) for side in ("rows", "cols")]
    if None not in shape and np.prod(numbers_of(shape, name)) != len(values):
        raise InputError(f"{name}: a matrix has {len(values)} numbers, not rows times cols")
    return values


def _size(camera: Node, name: str) -> tuple[Tree, Tree]:
    widths, heights = _all(camera, WIDTH), _all(camera, HEIGHT)
    sizes: list[list[Tree]] = [list(pair) for pair in zip(widths, heights, strict=False)]
    sizes += [[]] if len(widths) != len(heights) else []
    sizes += [size if isinstance(size, list) else [] for size in _all(camera, SIZE)]
    if not sizes or any(size != sizes[0] for size in sizes) or len(sizes[0]) != 2:
        what = "no size" if not sizes else "no clear size"
        raise InputError(
            f"{name} has {what} of its pictures: add image_width and image_height, in pixels"
        )
    width, height = sizes[0]
    return width, height


def _all(camera: Node, key: re.Pattern[str]) -> list[Tree]:
    return [value for name, value in camera.items() if key.fullmatch(name)]
