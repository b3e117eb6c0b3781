"""Folders and files that are broken, whatever is in them, and files that change while read."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from tests.verify.corpus.broken_records import MANIFEST
from tests.verify.corpus.copies import put
from tests.verify.corpus.mutation import Job, Mutation, as_bytes, at, failing, refusing

ROWS = 40_000_000  # facets: two gigabytes
NEEDED = (
    *("design.json", "mirrors.csv", MANIFEST),
    *("shell_b.stl", "shell_b.3mf", "shell_b.step"),
)
LONG = 84 + 50 * ROWS  # bytes


def gone(name: str) -> Job:
    return lambda folder: (folder / name).unlink()


def instead(name: str, how: Callable[[Path], object]) -> Job:
    """Something that is no file in place of one."""

    def job(folder: Path) -> None:
        (folder / name).unlink()
        how(folder / name)

    return job


def link_out(name: str) -> Job:
    """The very file, but outside the folder."""

    def job(folder: Path) -> Sequence[str]:
        (folder / name).rename(folder.parent / name)
        (folder / name).symlink_to(folder.parent / name)
        return [name]

    return job


def sparse(name: str, head: bytes, size: int = LONG) -> Job:
    """A file that is long and takes no room."""

    def job(folder: Path) -> Sequence[str]:
        put(folder, name, head)
        os.truncate(folder / name, size)
        return [name]

    return job


def headed(more: int) -> bytes:
    """An STL's head for two gigabytes, and so many facets more than there are."""
    return bytes(80) + (ROWS + more).to_bytes(4, "little")


def again(name: str) -> Job:
    """The same bytes in another file: who did that may have done more."""
    return as_bytes(name, bytes)


HEADING = as_bytes("shell_a.stl", lambda data: b"UNITS=in".ljust(80, b"\0") + data[80:])
listed = partial(at, file=MANIFEST)
NOTHING = {"size": 1, "sha256": ""}
CHANGED = "changed while it was read"
WHILE_READ = {  # by the stage at whose beginning it happens
    "coverage": (
        ("an STL replaced", again("shell_a.stl"), "shell_a.stl", CHANGED),
        ("a table gone", gone("mirrors.csv"), "mirrors.csv", CHANGED),
    ),
    "STEP": (("a STEP replaced", again("shell_a.step"), "shell_a.step", CHANGED),),
    "3MF": (("the manifest replaced", again(MANIFEST), MANIFEST, CHANGED),),
}
FILES: tuple[Mutation, ...] = (
    *refusing(
        "folder",
        ("none", shutil.rmtree, "no such folder"),
        *((f"no {name}", gone(name), f"{name}: missing") for name in NEEDED),
        ("an STL linked from outside", link_out("shell_a.stl"), "leads out"),
        ("a table linked from outside", link_out("mirrors.csv"), "leads out"),
        ("a pipe for an STL", instead("shell_a.stl", os.mkfifo), "shell_a.stl: not a regular file"),
    ),
    *refusing(
        "heading", ("a unit in an STL's heading", HEADING, "shell_a.stl", "allowed are zeros")
    ),
    # Refused before anybody reads so much, the hash included; so nobody needs to sign them.
    *refusing(
        "long file",
        ("2 GB of nothing for an STL", sparse("shell_a.stl", b""), "0 facets"),
        ("2 GB and a head that lies", sparse("shell_a.stl", headed(1)), "truncated"),
        ("2 GB for a STEP", sparse("shell_a.step", b"ISO-10303-21;"), "at most"),
        ("2 GB for a table", sparse("mirrors.csv", b"id,"), "at most"),
        ("200 MB of nothing for a 3MF", sparse("shell_a.3mf", b"PK\3\4", LONG // 10), "zip"),
        signed=False,
    ),
    *failing(
        "manifest",
        ("a wrong hash", listed("files/shell_a.step/sha256", "0" * 64), "manifest", "shell_a.step"),
        ("an entry missing", listed("files/shell_a.3mf"), "manifest", "shell_a.3mf"),
        ("an entry for nothing", listed("files/x", NOTHING), "manifest", "x"),
        signed=False,
    ),
    *refusing(
        "manifest",
        ("an entry outside", listed("files", {"../x": NOTHING}), "not a plain file name"),
        ("no entries", listed("files", {}), "files is {}: "),
        ("no hash", listed("files/x", 1), "files.x is 1: it should"),
        signed=False,
    ),
    *(
        mutation
        for stage, rows in WHILE_READ.items()
        for mutation in refusing("while read", *rows, during=stage, signed=False)
    ),
)
