"""Binary STL, read as data that may lie."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.errors import BadExport
from tbcad_verify.record.files import AGAIN, HEAD, FileBytes, read

FACET = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
TITLE, SHOWN = 80, 40  # bytes that some programs take for a unit or a colour; characters of it


@dataclass(frozen=True)
class Facets:
    """The triangles of one STL, as written."""

    name: str  # the file
    normals: NDArray[np.float32]  # (F, 3) float32, as stored; zero where the writer left them out
    corners: NDArray[np.float32]  # (F, 3, 3) float32: facet, corner, axis; mm


def read_facets(folder: Path, name: str) -> tuple[Facets, FileBytes]:
    """Facets of a binary STL, and the bytes they came from.

    Raises:
        BadExport: ASCII, words in the header, colours of facets, no facets, numbers that are not
            finite, or a size that does not follow from the count (found out before the file is
            read).

    Source: the 84 + 50 n byte layout of the 1988 StereoLithography Interface Specification.
    """
    blob = read(folder, name, expect=_refuse_foreign)
    return parse(blob), blob


def parse(blob: FileBytes) -> Facets:
    """Facets of a binary STL; BadExport as `read_facets`."""
    _refuse_foreign(blob.name, blob.data.size, blob.data[:HEAD].tobytes())
    table = blob.data[HEAD:].view(FACET)
    corners = np.ascontiguousarray(table["corners"])
    normals = np.ascontiguousarray(table["normal"])
    if blob.data[:TITLE].any() or table["attribute"].any():
        said = repr(blob.data[:TITLE].tobytes().strip(b"\0")[:SHOWN])
        raise BadExport(f"{blob.name}: words {said} or colours, allowed are zeros; {AGAIN}")
    _refuse_infinite(blob.name, corners)
    _refuse_infinite(blob.name, normals)
    return Facets(blob.name, normals, corners)


def _refuse_foreign(name: str, size: int, head: bytes) -> None:
    count = int.from_bytes(head[TITLE:HEAD], "little") if len(head) == HEAD else 0
    if size == HEAD + FACET.itemsize * count and count > 0:
        return
    if head[:5].lower() == b"solid":
        raise BadExport(f"{name}: an ASCII STL; only binary ones are read; {AGAIN}")
    raise BadExport(
        f"{name}: {size} bytes, but its header's {count} facets make "
        f"{HEAD + FACET.itemsize * count}: truncated or no binary STL; {AGAIN}"
    )


def _refuse_infinite(name: str, values: NDArray[np.float32]) -> None:
    finite = np.isfinite(values)
    if not finite.all():
        first = int(np.argwhere(~finite)[0][0])
        raise BadExport(f"{name}: facet {first} has a number that is not finite; {AGAIN}")
