"""A lens read from a file of OpenCV, ROS, Kalibr, mrcal or COLMAP, recognised by what is in it."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias
from xml.etree import ElementTree

import numpy as np
import yaml

from tbcad.core.spec.csv_rows import read_text
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


MAX_BYTES = 2_000_000
COLMAP_CENTRE = 0.5
"""COLMAP's pixels begin at whole numbers, so their centres are half a pixel farther."""
COLMAP_CAMERA = re.compile(r"\d+[ \t]+[A-Z][A-Z_]+[ \t]+\d+[ \t]+\d+([ \t]|$)")
# Each model's parameters in the order focal x, focal y, principal x and y, k1, k2, p1, p2, k3 ...
COLMAP = {
    "SIMPLE_PINHOLE": (0, 0, 1, 2),
    "PINHOLE": (0, 1, 2, 3),
    "SIMPLE_RADIAL": (0, 0, 1, 2, 3),
    "RADIAL": (0, 0, 1, 2, 3, 4),
    "OPENCV": (0, 1, 2, 3, 4, 5, 6, 7),
    "FULL_OPENCV": tuple(range(12)),
}
MRCAL = re.compile(r"LENSMODEL_(PINHOLE|OPENCV(4|5|8|12))")
MRCAL_FILE = re.compile(r"['\"]lens_?model['\"]\s{0,9}:\s{0,9}b?['\"](LENSMODEL|CAHV)")
LOADER = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
MAX_DEPTH = 20  # a list of Kalibr is four deep


def read_lens(path: Path) -> CalibratedLens:
    """The lens in a file; InputError: it is none of these, or has another model of the lens."""
    text, name = read_text(path, str(path), "lens", MAX_BYTES), str(path)
    lines = [line for line in map(str.strip, text.split("\n")) if line and line[0] != "#"]
    if MRCAL_FILE.search(text):
        lens = _mrcal(text, name)
    elif lines and COLMAP_CAMERA.match(lines[0]):
        lens = _colmap(lines, name)
    else:
        reader = xml_tree if text.lstrip().startswith("<") else yaml_tree
        tree = reader(text, name)
        if not isinstance(tree, dict):
            raise InputError(
                f"{name} is no lens: name a file of OpenCV (YAML, XML), ROS or Kalibr (YAML), "
                "mrcal (.cameramodel), COLMAP (cameras.txt) or tbcad intrinsics"
            )
        lens = camera_lens(tree, name)
    return lens.checked(name)


def _mrcal(text: str, name: str) -> CalibratedLens:
    try:
        found: Any = ast.literal_eval(text.strip())
        model = str(found.get("lensmodel", found.get("lens_model")))
        numbers, (width, height) = [*found["intrinsics"]], found["imagersize"]
    except (ValueError, SyntaxError, KeyError, TypeError, AttributeError):
        raise InputError(f"{name} is no .cameramodel that mrcal wrote: export it again") from None
    except (RecursionError, MemoryError):
        raise InputError(f"{name} is nested too deeply for a lens: export it again") from None
    known = MRCAL.fullmatch(model)
    if known is None or any(numbers[9:]):  # k4 and what follows
        raise InputError(
            f"{name} has the lens model {model:.60}: {USABLE} (mrcal-convert-lensmodel "
            "LENSMODEL_OPENCV5)"
        )
    if len(numbers) != 4 + int(known[2] or 0):
        raise InputError(f"{name} has {len(numbers)} numbers, {model} others: export it again")
    return lens_of(numbers[:4], numbers[4:], (width, height), name)


def _colmap(lines: list[str], name: str) -> CalibratedLens:
    if len(lines) != 1:
        raise InputError(f"{name} has {len(lines)} cameras: keep the line of the run's")
    _, model, width, height, *given = lines[0].split()
    order = COLMAP.get(model)
    if order is None:
        raise InputError(f"{name} has the lens model {model:.60}: {USABLE} (model OPENCV)")
    if len(given) != max(order) + 1:
        raise InputError(
            f"{name}: {model} has {max(order) + 1} parameters, found {len(given)}: export it again"
        )
    numbers = [given[place] for place in order]
    lens = lens_of(numbers[:4], numbers[4:], (width, height), name)
    return CalibratedLens(
        lens.focal, lens.principal - COLMAP_CENTRE, lens.distortion, lens.width_px, lens.height_px
    )


def yaml_tree(text: str, name: str) -> Tree:
    """A document of YAML or JSON without references or keys twice; every scalar is a text."""
    if text.startswith("%YAML"):  # OpenCV writes "%YAML:1.0", which is no directive of YAML
        text = "\n" + text.partition("\n")[2]
    found: list[Tree] = []
    open_nodes: list[list[Tree]] = [found]
    try:
        for event in yaml.parse(text, Loader=LOADER):
            _take(event, open_nodes, name)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise InputError(f"{name}, line {line}: no YAML: {error.problem}: correct it") from None
    except (yaml.YAMLError, ValueError):
        raise InputError(f"{name} is no lens: it has characters that no text has") from None
    found = [document for document in found if document]  # rostopic ends each with ---
    if len(found) > 1:
        raise InputError(f"{name} has {len(found)} documents: keep that of the run's camera")
    return found[0] if found else ""


def _take(event: yaml.Event, open_nodes: list[list[Tree]], name: str) -> None:
    """Add an event of the parser to the node that is open."""
    if isinstance(event, yaml.AliasEvent):
        raise InputError(f"{name} has references (*{event.anchor:.40}): write what they stand for")
    if isinstance(event, yaml.ScalarEvent):
        open_nodes[-1].append(event.value)
    elif isinstance(event, yaml.CollectionStartEvent):
        if len(open_nodes) > MAX_DEPTH:
            raise InputError(f"{name} is nested too deeply for a lens: export it again")
        open_nodes.append([])
    elif isinstance(event, yaml.CollectionEndEvent):
        node = open_nodes.pop()
        mapping = isinstance(event, yaml.MappingEndEvent)
        open_nodes[-1].append(_mapping(node, name) if mapping else node)


def _mapping(node: list[Tree], name: str) -> Tree:
    keys = [key if isinstance(key, str) else "?" for key in node[::2]]
    key, count = next(iter(Counter(keys).most_common(1)), ("", 0))
    if count > 1:
        raise InputError(f"{name} has {key:.40} twice: remove one")
    return dict(zip(keys, node[1::2], strict=True))


def xml_tree(text: str, name: str) -> Tree:
    """A document of XML: elements and attributes by name, each once; several words as a list."""
    if re.search(r"<!(DOCTYPE|ENTITY)", text):
        raise InputError(f"{name} has a document type, which no lens has: remove it")
    try:
        root = ElementTree.fromstring(text.strip())
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError(f"{name} is no XML: {error}: correct it") from None
    return _element(root, name, 0)


def _element(element: ElementTree.Element, name: str, depth: int) -> Tree:
    if depth > MAX_DEPTH:
        raise InputError(f"{name} is nested too deeply for a lens: export it again")
    items: list[Any] = [(key, value) for key, value in element.items() if key != "type_id"]
    items += [(child.tag, _element(child, name, depth + 1)) for child in element]
    words = (element.text or "").split()
    several = len(words) > 1 or element.tag == "data"
    value: Tree = [*words] if several else " ".join(words)
    if not items:
        return value
    items += [(element.tag, value)] if value else []
    if all(key == "_" for key, _ in items):
        return [value for _, value in items]
    return _mapping([part for item in items for part in item], name)
