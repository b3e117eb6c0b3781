"""The field beside a light field: its file, and whether it is of that light field."""

import json
import warnings
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError, PlausibilityWarning
from tbcad.reconstruction.field import NAME, Field, read_field
from tbcad.simulate.capture.light_field import NAME as LIGHT_FIELD
from tbcad.simulate.capture.light_field import SCHEMA, Frame, LightField

FACT = "light_field"  # of a field: the fingerprint of what it was fitted to
ROWS_APART = 64  # of those whose rays are part of a fingerprint


def light_field_fingerprint(source: LightField) -> str:
    """SHA-256 of what was photographed, and of where: another light field has another one.

    Of the colours each pixel counts. Rays count by the cameras, the mirrors and one row in 64.
    """
    digest = sha256(json.dumps([SCHEMA, source.capture_mm, sorted(source.frames)]).encode())
    for _, frame in sorted(source.frames.items()):
        for values in _content(frame):
            digest.update(np.ascontiguousarray(values).data)
    return digest.hexdigest()


def _content(frame: Frame) -> list[NDArray[np.generic]]:
    camera, mirrors = frame.camera, frame.mirrors
    rows = [np.asarray(frame.planes[name][::ROWS_APART]) for name in ("origin", "direction")]
    place = np.stack([camera.pinhole, camera.forward, camera.right])
    shapes = [place, frame.u, mirrors.apex, mirrors.normal, mirrors.curvature]
    return [frame.image(), *rows, *(np.asarray(one, dtype=np.float64) for one in shapes)]


def field_file(folder: Path, frame: int | None = None) -> Path:
    """Where the field of a capture lies, or of one frame of its sequence."""
    name = NAME if frame is None else NAME.replace(".", f"-{frame}.")
    return folder / name


def field_of(file: Path, source: LightField) -> Field:
    """Read the field of a light field.

    Raises:
        InputError: there is none, it is damaged, or it is of another light field.
    """
    made = read_field(file)
    again = "write it again with `tbcad reconstruct`"
    if FACT not in made.facts:
        raise InputError(f"{file} does not say of which light field it is: {again}")
    if made.facts[FACT] != light_field_fingerprint(source):
        raise InputError(f"{file} is of another capture, or of an older one: {again}")
    return made


def wanted_field(
    method: str | None, capture: Path, source: LightField, frame: int | None = None
) -> Field | None:
    """The field that views are made from; None: the light field itself.

    Args:
        method: "field", None for the default, or another one.
        capture: folder of the capture, or its light field's file.
        source: the light field, or a frame of it.
        frame: its number; None: there is one only.

    By default a field that lies beside the light field; one that is of no use is told in a warning.

    Raises:
        InputError: as `field_of`, when a field is asked for.
    """
    file = field_file(capture if capture.is_dir() else capture.parent, frame)
    if method == "field":
        return field_of(file, source)
    beside = capture.is_dir() or capture.name == LIGHT_FIELD
    if method is not None or not beside or not file.is_file():
        return None
    try:
        return field_of(file, source)
    except InputError as fault:
        warnings.warn(PlausibilityWarning(f"{fault}; it is not used here"), stacklevel=2)
        return None
