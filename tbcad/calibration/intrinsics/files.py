"""A lens read from a file of OpenCV, ROS, Kalibr, mrcal or COLMAP, recognised by what is in it."""

import ast
import re
from pathlib import Path
from typing import Any

from tbcad.calibration.intrinsics.camera_tree import camera_lens
from tbcad.calibration.intrinsics.lens import USABLE, Lens, lens_of
from tbcad.calibration.intrinsics.trees import xml_tree, yaml_tree
from tbcad.errors import InputError
from tbcad.spec.files import read_text

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


def read_lens(path: Path) -> Lens:
    """The lens in a file.

    Raises:
        InputError: the file cannot be read, is none of these, or has another model of the lens.
    """
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


def _mrcal(text: str, name: str) -> Lens:
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


def _colmap(lines: list[str], name: str) -> Lens:
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
    return Lens(
        lens.focal, lens.principal - COLMAP_CENTRE, lens.distortion, lens.width_px, lens.height_px
    )
