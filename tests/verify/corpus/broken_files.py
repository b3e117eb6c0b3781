"""Folders and files that are broken, whatever is in them, and files that change while read."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tests.verify.corpus.copies import put
from tests.verify.corpus.mutation import Job, Mutation, fails, refused
from tests.verify.corpus.record_changes import manifest

ROWS = 40_000_000  # facets: two gigabytes
LONG = 84 + 50 * ROWS  # bytes


def gone(name: str) -> Job:
    return lambda folder: (folder / name).unlink() or ()


def emptied(folder: Path) -> Sequence[str]:
    for path in folder.iterdir():
        path.unlink()
    return ()


def no_folder(folder: Path) -> Sequence[str]:
    shutil.rmtree(folder)
    return ()


def no_longer_a_folder(folder: Path) -> Sequence[str]:
    shutil.rmtree(folder)
    folder.write_bytes(b"")
    return ()


def link_out(name: str) -> Job:
    """The very file, but outside the folder."""

    def job(folder: Path) -> Sequence[str]:
        (folder / name).rename(folder.parent / name)
        (folder / name).symlink_to(folder.parent / name)
        return [name]

    return job


def loop(folder: Path) -> Sequence[str]:
    (folder / "shell_a.stl").unlink()
    (folder / "shell_a.stl").symlink_to("shell_a.stl")
    return ()


def pipe(folder: Path) -> Sequence[str]:
    (folder / "shell_a.stl").unlink()
    os.mkfifo(folder / "shell_a.stl")
    return ()


def directory(folder: Path) -> Sequence[str]:
    (folder / "shell_a.step").unlink()
    (folder / "shell_a.step").mkdir()
    return ()


def sparse(name: str, head: bytes, size: int = LONG) -> Job:
    """A file that is long and takes no room."""

    def job(folder: Path) -> Sequence[str]:
        put(folder, name, head)
        os.truncate(folder / name, size)
        return [name]

    return job


def headed(more: int) -> bytes:
    """An STL's head for two gigabytes, and so many facets more than there are."""
    return b"corpus".ljust(80) + (ROWS + more).to_bytes(4, "little")


def wrong_hash(files: dict) -> None:
    files["shell_a.step"]["sha256"] = "0" * 64


def wrong_size(files: dict) -> None:
    files["shell_a.stl"]["size"] += 1


def exchanged(files: dict) -> None:
    files["shell_a.3mf"], files["shell_b.3mf"] = files["shell_b.3mf"], files["shell_a.3mf"]


def outside(files: dict) -> None:
    files["../outside.txt"] = {"size": 0, "sha256": ""}


def one_bit(folder: Path) -> Sequence[str]:
    """A bit of an STL's heading, which nobody measures."""
    data = bytearray((folder / "shell_a.stl").read_bytes())
    data[0] ^= 1
    put(folder, "shell_a.stl", bytes(data))
    return ["shell_a.stl"]


def again(name: str) -> Job:
    """The same bytes in another file: who did that may have done more."""
    return lambda folder: put(folder, name, (folder / name).read_bytes()) or ()


def appended(folder: Path) -> Sequence[str]:
    put(folder, "shell_b.stl", (folder / "shell_b.stl").read_bytes() + b"x")
    return ()


def unsigned(mutation: Mutation) -> Mutation:
    """The manifest itself is the point."""
    return replace(mutation, signed=False)


def during(stage: str, name: str, job: Job, file: str) -> Mutation:
    words = (file, "changed while it was read")
    return replace(refused(name, "any", job, *words), during=stage, signed=False)


MANIFEST = "manifest.json"
# Refused before anybody reads so much, the hash included; so nobody needs to sign them.
SPARSE = tuple(
    unsigned(refused(name, kind, sparse(file, head, size), *words))
    for name, kind, file, head, size, words in (
        ("2 GB of nothing for an STL", "STL", "shell_a.stl", b"", LONG, ("0 facets",)),
        ("2 GB and a head that lies", "STL", "shell_a.stl", headed(1), LONG, ("truncated",)),
        ("5 GB for an STL", "STL", "shell_a.stl", b"", 5 * 10**9, ("at most",)),
        ("2 GB for a STEP", "STEP", "shell_a.step", b"ISO-10303-21;", LONG, ("at most",)),
        ("2 GB for a table", "mirrors.csv", "mirrors.csv", b"id,", LONG, ("at most",)),
        ("200 MB of nothing for a 3MF", "3MF", "shell_a.3mf", b"PK\3\4", LONG // 10, ("zip",)),
    )
)
FILES: tuple[Mutation, ...] = (
    refused("no such folder", "folder", no_folder, "no such folder"),
    refused("a file for a folder", "folder", no_longer_a_folder, "not a folder"),
    refused("an empty folder", "folder", emptied, "an empty folder, no build"),
    refused("no design.json", "folder", gone("design.json"), "design.json: missing"),
    refused("no mirrors.csv", "folder", gone("mirrors.csv"), "mirrors.csv: missing"),
    refused("no manifest", "folder", gone(MANIFEST), "manifest.json: missing"),
    refused("an STL missing", "folder", gone("shell_b.stl"), "shell_b.stl: missing"),
    refused("a 3MF missing", "folder", gone("shell_b.3mf"), "shell_b.3mf: missing"),
    refused("a STEP missing", "folder", gone("shell_b.step"), "shell_b.step: missing"),
    refused("an STL linked from outside", "folder", link_out("shell_a.stl"), "leads out"),
    refused("a STEP linked from outside", "folder", link_out("shell_a.step"), "leads out"),
    refused("a table linked from outside", "folder", link_out("mirrors.csv"), "leads out"),
    refused("an STL linked to itself", "folder", loop, "shell_a.stl"),
    refused("a pipe for an STL", "folder", pipe, "shell_a.stl: not a regular file"),
    refused("a folder for a STEP", "folder", directory, "shell_a.step: not a regular file"),
    *SPARSE,
    unsigned(fails("one bit, manifest as it was", "STL", one_bit, "manifest")),
    unsigned(fails("a wrong hash", MANIFEST, manifest(wrong_hash), "manifest", "shell_a.step")),
    unsigned(fails("a wrong size", MANIFEST, manifest(wrong_size), "manifest", "shell_a.stl")),
    unsigned(fails("two files exchanged", MANIFEST, manifest(exchanged), "manifest", ".3mf")),
    unsigned(
        fails(
            "an entry missing",
            MANIFEST,
            manifest(lambda f: f.pop("shell_a.3mf")),
            "manifest",
            "shell_a.3mf",
        )
    ),
    unsigned(
        fails(
            "an entry for nothing",
            MANIFEST,
            manifest(lambda f: f.update(x={"size": 1, "sha256": ""})),
            "manifest",
            "x",
        )
    ),
    unsigned(refused("an entry outside", MANIFEST, manifest(outside), "not a plain file name")),
    unsigned(
        refused("no entries", MANIFEST, manifest(lambda f: f.clear()), "files is {}, allowed")
    ),
    unsigned(
        refused(
            "an entry without a hash",
            MANIFEST,
            manifest(lambda f: f.update(x=1)),
            "files.x is 1, allowed",
        )
    ),
    during("coverage", "an STL replaced while read", again("shell_a.stl"), "shell_a.stl"),
    during("STEP", "a STEP replaced while read", again("shell_a.step"), "shell_a.step"),
    during("STEP", "an STL that grows", appended, "shell_b.stl"),
    during("coverage", "a table gone while read", gone("mirrors.csv"), "mirrors.csv"),
    during("3MF", "the manifest replaced while read", again(MANIFEST), MANIFEST),
)
HEAVY = (
    replace(
        fails("2 GB of facets without area", "STL", sparse("shell_a.stl", headed(0)), "facets"),
        heavy=True,
    ),
    replace(
        unsigned(refused("2 GB of nothing for a 3MF", "3MF", sparse("shell_a.3mf", b"PK"), "zip")),
        heavy=True,
    ),
)
