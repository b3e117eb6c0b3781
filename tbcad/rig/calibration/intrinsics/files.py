"""A lens read from a file of OpenCV, ROS, Kalibr, mrcal or COLMAP, recognised by what is in it.

A file of keys may have those of lens_files.toml and no others: another one may name a model of the
lens that is not read here.
"""

import ast
import re
import tomllib
from collections import Counter
from importlib.resources import files
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

TABLE = tomllib.loads(files(__package__).joinpath("lens_files.toml").read_text("utf-8"))
KEYS, MODELS = TABLE["keys"], TABLE["models"]
OFF = {"", "0", "false", "no", "off"}
COUNTS = (0, 4, 5, 8, 12, 14)
SKEW = 1e-6  # of the focal length, that is taken for none
NO_MATRIX = "has no camera_matrix of 3 x 3 numbers: export it again"


def camera_lens(tree: Node, name: str) -> CalibratedLens:
    """The lens of the only camera of a file's tree of mappings, lists and texts.

    InputError: it has no camera or several, another model of the lens, or a part of the picture's
    pixels.
    """
    inner = {key: node for key, node in tree.items() if isinstance(node, dict)}
    nodes = {"": tree, **inner}
    cameras = {label: node for label, node in nodes.items() if node.keys() & {*KEYS["matrix"]}}
    if len(cameras) > 1:
        raise InputError(
            f"{name} has {len(cameras)} cameras ({', '.join(filter(None, cameras)):.80}): "
            "which took the photographs? keep its part of the file"
        )
    if not cameras:
        raise InputError(f"{name} {NO_MATRIX}")
    ((label, camera),) = cameras.items()
    if label:
        camera = {key: one for key, one in tree.items() if key != label} | camera
    _check_keys(camera, name)
    coefficients = _only(camera, "coefficients", name, "distortion_coefficients")
    if len(coefficients) not in COUNTS:
        raise InputError(
            f"{name} has {len(coefficients)} coefficients of distortion, OpenCV's are "
            f"{', '.join(map(str, COUNTS))}: give k1, k2, p1, p2, k3, of a lens without, zeros"
        )
    models = [_plain(str(camera[key])) for key in KEYS["model"] if key in camera]
    focal_and_principal = _intrinsics(camera, models, name)
    if {*MODELS["unnamed"]} & {*models} and numbers_of(coefficients, name).any():
        raise InputError(f"{name} names no model of its distortion: {USABLE}")
    return lens_of(focal_and_principal, coefficients, _size(camera, name), name)


def _plain(text: str) -> str:
    return re.sub(r"[^a-z0-9]", "", text.lower())


def _check_keys(camera: Node, name: str) -> None:
    """Refuse keys that are not known, other models, and a part of the picture's pixels."""
    kinds = {key: kind for kind, keys in KEYS.items() for key in keys}
    models = {*MODELS["supported"], *MODELS["unnamed"]}
    for key, value in camera.items():
        kind, text = kinds.get(key), str(value).strip()
        if kind is None:
            raise InputError(
                f"{name} has the key {key!r:.40}, which may name another lens model: remove it if "
                f"it does not; {USABLE}"
            )
        if (kind == "model" and _plain(text) not in models) or (
            kind == "fisheye" and text.lower() not in OFF
        ):
            raise InputError(f"{name} has the lens model {key}: {text:.40}: {USABLE}")
        parts = value.values() if isinstance(value, dict) else [value]
        whole = OFF if key == "roi" else OFF | {"1"}
        if kind == "part" and any(str(part).lower() not in whole for part in parts):
            raise InputError(
                f"{name} has {key}, so the matrix is of another picture: calibrate the photographs "
                "as they are"
            )


def _only(camera: Node, what: str, name: str, usual: str) -> list[str]:
    """Numbers under the one key of a kind that a camera has."""
    found = [key for key in KEYS[what] if key in camera]
    if len(found) != 1:
        told = f"two of {', '.join(found)}: keep one" if found else f"no {usual}: export it again"
        raise InputError(f"{name} has {told}")
    return _numbers(camera[found[0]], name)


def _intrinsics(camera: Node, models: list[str], name: str) -> list[float]:
    """Focal lengths and principal point, from a matrix or Kalibr's four numbers."""
    numbers = numbers_of(_only(camera, "matrix", name, "camera_matrix"), name)
    if "intrinsics" in camera and len(numbers) == 4:
        if len(models) < 2:
            raise InputError(f"{name} names no camera_model and distortion_model: {USABLE}")
        return list(map(float, numbers))
    if len(numbers) != 9:
        raise InputError(f"{name} {NO_MATRIX}")
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
    values = _numbers(node.get("data", "no data"), name)
    shape = [node.get(side) for side in ("rows", "cols")]
    if None not in shape and np.prod(numbers_of(shape, name)) != len(values):
        raise InputError(f"{name}: a matrix has {len(values)} numbers, not rows times cols")
    return values


def _size(camera: Node, name: str) -> list[Tree]:
    """Columns and rows, which may be told in several ways that agree."""
    widths, heights, pairs = (
        [camera[key] for key in KEYS[what] if key in camera] for what in ("width", "height", "size")
    )
    sizes = [[*widths, *heights]] if widths or heights else []
    sizes += [one if isinstance(one, list) else [] for one in pairs]
    if not sizes or any(size != sizes[0] for size in sizes) or len(sizes[0]) != 2:
        what = "no size" if not sizes else "no clear size"
        raise InputError(
            f"{name} has {what} of its pictures: add image_width and image_height, in pixels"
        )
    return sizes[0]


MAX_BYTES = 2_000_000
COLMAP_CENTRE = 0.5
"""COLMAP's pixels begin at whole numbers, so their centres are half a pixel farther."""
COLMAP_CAMERA = re.compile(r"\d+[ \t]+[A-Z][A-Z_]+[ \t]+\d+[ \t]+\d+([ \t]|$)")
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
    order = TABLE["colmap"].get(model)
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
