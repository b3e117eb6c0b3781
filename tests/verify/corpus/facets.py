"""The triangles of one half, in its STL and its 3MF alike."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.verify.corpus.copies import put
from tests.verify.synthetic_export import facets_of, stl

Corners = NDArray[np.float32]  # (F, 3, 3) facet, corner, axis; mm
MODEL = "3D/3dmodel.model"
VERTEX = '<vertex x="%.6f" y="%.6f" z="%.6f"/>\n'
TRIANGLE = '<triangle v1="%d" v2="%d" v3="%d"/>\n'
HALVES = ("a", "b")


def read(folder: Path, half: str) -> Corners:
    """Corners from the STL."""
    return facets_of(folder / f"shell_{half}.stl")


def write(folder: Path, half: str, corners: Corners) -> None:
    """The same corners to both files; the synthetic export has no 3MF."""
    write_stl(folder, f"shell_{half}.stl", corners)
    if (folder / f"shell_{half}.3mf").exists():
        write_3mf(folder, f"shell_{half}.3mf", corners)


def write_stl(folder: Path, name: str, corners: Corners, turn: int = 1) -> None:
    """Corners as binary STL; `turn` -1 stores the normals against the corners' order."""
    put(folder, name, stl(corners, turn))


def write_3mf(folder: Path, name: str, corners: Corners) -> None:
    """Corners in place of those of a 3MF."""

    def other(model: str) -> str:
        head, _, rest = model.partition("<vertices>")
        return head + mesh_text(corners) + rest.partition("</triangles>")[2]

    edit_3mf(folder, name, other)


def mesh_text(corners: Corners) -> str:
    """Vertices and triangles as 3MF has them."""
    points, index = shared(corners)
    vertices = VERTEX * len(points) % tuple(points.ravel().tolist())
    triangles = TRIANGLE * len(index) % tuple(index.ravel().tolist())
    return f"<vertices>\n{vertices}</vertices>\n<triangles>\n{triangles}</triangles>"


def shared(corners: Corners) -> tuple[Corners, NDArray[np.intp]]:
    """Points (N, 3), each once, and (F, 3) which of them a facet's corners are."""
    flat = corners.reshape(-1, 3) + np.float32(0)
    order = np.lexsort(flat.T)
    new = np.append(True, (np.diff(flat[order], axis=0) != 0).any(axis=1))
    index = np.empty(len(flat), np.intp)
    index[order] = np.cumsum(new) - 1
    return flat[order[new]], index.reshape(-1, 3)


def edit_3mf(folder: Path, name: str, how: Callable[[str], str]) -> None:
    """Change the model's text in a 3MF."""
    with zipfile.ZipFile(folder / name) as archive:
        members = {item: archive.read(item) for item in archive.namelist()}
    text = members[MODEL].decode()
    changed = how(text)
    assert changed != text, "nothing was changed"
    put(folder, name, zipped({**members, MODEL: changed.encode()}))


def zipped(members: dict[str, bytes]) -> bytes:
    """Members as a zip."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return buffer.getvalue()
