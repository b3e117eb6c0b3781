"""A lens read from a file of OpenCV, ROS, Kalibr, mrcal or COLMAP, recognised by what is in it."""

import ast
import re
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import yaml

from tbcad.core.spec.csv_rows import read_text
from tbcad.errors import InputError
from tbcad.rig.calibration.intrinsics.camera_tree import Tree, camera_lens
from tbcad.rig.calibration.intrinsics.lens import USABLE, CalibratedLens, lens_of

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
