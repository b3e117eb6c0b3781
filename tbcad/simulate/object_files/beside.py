"""Files that a mesh names: in its own folder, and nowhere else."""

from base64 import b64decode
from pathlib import Path, PureWindowsPath
from urllib.parse import unquote

import numpy as np

from tbcad.errors import InputError
from tbcad.formats.pictures import Picture, picture_of
from tbcad.srgb import srgb
from tbcad.types import Bytes

MAX_BYTES = 1 << 30


def file_beside(mesh: Path, name: str) -> Path:
    """The file that a mesh names, or the one with its base name beside the mesh.

    Raises:
        InputError: there is none in the folder of the mesh; links that lead out do not count.
    """
    folder = mesh.parent.resolve()
    parts = PureWindowsPath(name.strip().strip('"')).parts  # takes both kinds of slashes
    wanted = Path(*parts) if parts else Path()
    for file in (wanted, Path(wanted.name)):
        found = _without_case(folder, file)
        if found is not None and found.resolve().is_relative_to(folder) and found.is_file():
            if found.stat().st_size > MAX_BYTES:
                raise InputError(f"{name} is over 1 GiB: reduce it")
            return found
    raise InputError(f"{name} is not in the folder of the mesh")


def uri_bytes(mesh: Path, uri: str) -> bytes:
    """The bytes that a URI holds, or those of a file beside the mesh."""
    if uri.startswith("data:"):
        return b64decode(uri.partition(",")[2])
    return file_beside(mesh, unquote(uri)).read_bytes()


def _without_case(folder: Path, file: Path) -> Path | None:
    """The file as it is spelt, or with other capitals where only these differ."""
    if not file.name or ".." in file.parts or file.is_absolute():
        return None
    if (folder / file).is_file():
        return folder / file
    parent = (folder / file).parent
    here = sorted(parent.iterdir()) if parent.is_dir() else []
    return next((p for p in here if p.name.casefold() == file.name.casefold()), None)


def texture_beside(mesh: Path, name: str, notes: list[str]) -> Bytes | None:
    """A picture that a mesh names, as bytes (h, w, 3); None, and a note, where it is not there."""
    try:
        file = file_beside(mesh, name)
    except InputError as error:
        notes.append(f"its texture {error}")
        return None
    return texture(file.read_bytes(), file.name, notes)


def texture(data: bytes, name: str, notes: list[str]) -> Bytes | None:
    """The picture of a texture, as bytes (h, w, 3); None, and a note, where it cannot be read."""
    try:
        try:
            return shown_bytes(picture_of(data, name))
        except InputError:
            shown = shown_bytes(picture_of(data, name, ignore_alpha=True))
            notes.append(f"the transparency of its texture {name} is left out")
            return shown
    except InputError as error:
        notes.append(f"its texture {error}")
        return None


def shown_bytes(picture: Picture) -> Bytes:
    """A picture (h, w) or (h, w, 3) as bytes (h, w, 3); real numbers are light."""
    if picture.dtype == np.uint16:
        picture = np.rint(picture / 257).astype(np.uint8)
    elif picture.dtype != np.uint8:
        picture = np.rint(255 * srgb(picture.astype(np.float64).clip(0, 1))).astype(np.uint8)
    return np.ascontiguousarray(np.dstack([picture] * 3) if picture.ndim == 2 else picture)
