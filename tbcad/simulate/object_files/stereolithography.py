"""STL files; of binary ones the colours that VisCAM and Materialise write too."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.simulate.object_files.contents import ObjectFile, Part, without_facets
from tbcad.types import Floats

HEADER_BYTES = 80
OWN_COLOUR = 0x8000  # bit of VisCAM; Materialise sets it where the whole part's colour holds


def read_stl(path: Path) -> ObjectFile:
    """Read a mesh, shaded flat.

    Raises:
        InputError: it is no STL file, or cut off.
    """
    from trimesh.exchange.stl import load_stl

    data = path.read_bytes()
    found = load_stl(BytesIO(data))
    solids = found["geometry"].values() if "geometry" in found else [found]
    parts = [_part(data[:HEADER_BYTES], solid) for solid in solids if "faces" in solid]
    if not parts:
        if len(data) > HEADER_BYTES + 4:
            raise InputError("its length is not what its number of facets says: copy it again")
        raise without_facets(0)
    return ObjectFile(parts)


def _part(header: bytes, solid: dict[str, Any]) -> Part:
    points = np.asarray(solid["vertices"], dtype=np.float64)
    faces = np.asarray(solid["faces"], dtype=np.int64)
    words = solid.get("face_attributes", {}).get("stl")
    colours = None if words is None else _colours(header, np.asarray(words, dtype=np.int64))
    return Part(points, faces, None, colours, source="" if colours is None else "face colours")


def _colours(header: bytes, words: NDArray[np.int64]) -> Floats | None:
    """Colours (f, 3, 3) of facets' words (f,), five bits a channel; None where none has any."""
    channels = np.stack([words & 31, words >> 5 & 31, words >> 10 & 31], axis=-1) / 31
    at = header.find(b"COLOR=")
    if at >= 0 and len(header) >= at + 9:
        whole = np.frombuffer(header, np.uint8, 3, at + 6) / 255
        shares = np.where((words & OWN_COLOUR)[:, None] > 0, whole, channels)
    elif (words & OWN_COLOUR).all():
        shares = channels[:, ::-1]
    else:
        return None
    return np.repeat(shares[:, None], 3, axis=1)
