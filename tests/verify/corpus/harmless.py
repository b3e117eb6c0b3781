"""Changes that leave the export as good as it was: a checker that refuses all would show here."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.verify.corpus import part21
from tests.verify.corpus.copies import change, load, put
from tests.verify.corpus.facets import HALVES, read, write, write_stl
from tests.verify.corpus.mesh_changes import part, tetrahedron
from tests.verify.corpus.mutation import Job, Mutation
from tests.verify.corpus.record_changes import design, mirrors


def again(folder: Path) -> Sequence[str]:
    """Both halves' meshes written by the corpus's own writers."""
    for half in HALVES:
        write(folder, half, read(folder, half))
    return ()


def without_normals(folder: Path) -> Sequence[str]:
    write_stl(folder, "shell_a.stl", read(folder, "a"), turn=0)
    return ()


def laid_out(folder: Path) -> Sequence[str]:
    """The STEP's statements on one line each, one more that nothing refers to."""
    part21.edit(folder, "shell_a.step", lambda e: part21.add(e, "DIRECTION('',(0.,0.,1.))"))
    return ()


def compact(folder: Path) -> Sequence[str]:
    put(folder, "design.json", json.dumps(load(folder, "design.json")).encode())
    return ()


def aside(folder: Path) -> Sequence[str]:
    """A further part that stands behind the mirrors."""
    part(folder, "stand", tetrahedron(np.array([0.0, 0.0, 300.0]), 10))
    return ()


def notes(folder: Path) -> Sequence[str]:
    put(folder, "notes.txt", b"mine")
    return ()


def link_inside(folder: Path) -> Sequence[str]:
    (folder / "shell_a.stl").rename(folder / "real.stl")
    (folder / "shell_a.stl").symlink_to("real.stl")
    return ()


def wide(folder: Path) -> Sequence[str]:
    """A column that the verification does not know."""
    how = b"\n".join
    change(folder, "mirrors.csv", lambda b: how(line + b",x" for line in b.splitlines()) + b"\n")
    return ()


def dos(folder: Path) -> Sequence[str]:
    change(folder, "mirrors.csv", lambda data: data.replace(b"\n", b"\r\n"))
    return ()


def passes(name: str, kind: str, job: Job) -> Mutation:
    return Mutation(name, kind, job, 0)


HARMLESS: tuple[Mutation, ...] = (
    passes("as it is", "none", lambda _: ()),
    passes("meshes written anew", "STL, 3MF", again),
    passes("an STL without normals", "STL", without_normals),
    passes("STEP laid out anew", "STEP", laid_out),
    passes("design.json in one line", "design.json", compact),
    passes("cameras in another order", "design.json", design(lambda d: d["cameras"].reverse())),
    passes("lines that end as in DOS", "mirrors.csv", dos),
    passes("mirrors in another order", "mirrors.csv", mirrors(lambda rows, _: rows.reverse(), 0)),
    passes("a further column", "mirrors.csv", wide),
    passes("a part out of the light", "STL, record", aside),
    passes("a file that is not listed", "folder", notes),
    passes("a link inside", "folder", link_inside),
)
