"""Broken files and records of a real export must be caught; what is as good must not be."""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tbcad_verify import BadExport, main, verify

from tests.helpers import read_3mf
from tests.verify.corpus import part21
from tests.verify.corpus.broken_3mfs import THREEMFS
from tests.verify.corpus.broken_files import FILES, gone
from tests.verify.corpus.broken_meshes import MESHES, dented, mesh
from tests.verify.corpus.broken_records import RECORDS, mirrors
from tests.verify.corpus.broken_steps import STEPS
from tests.verify.corpus.copies import change, copy, load, put, sign
from tests.verify.corpus.facets import HALVES, read, write, write_stl
from tests.verify.corpus.mutation import HERE, Mutation, at, attempt, fails, refused
from tests.verify.synthetic_export import facets_of

pytestmark = pytest.mark.corpus


@pytest.mark.parametrize("mutation", [*MESHES, *RECORDS, *STEPS, *THREEMFS, *FILES], ids=str)
def test_caught(mutation: Mutation, good: Path, tmp_path: Path) -> None:
    assert attempt(mutation, good, tmp_path) == ""


def meshes_written_anew(folder: Path) -> None:
    """By the corpus's own writers."""
    for half in HALVES:
        write(folder, half, read(folder, half))


def a_link_inside(folder: Path) -> None:
    (folder / "shell_a.stl").rename(folder / "real.stl")
    (folder / "shell_a.stl").symlink_to("real.stl")


def a_further_column(data: bytes) -> bytes:
    return b"\n".join(line + b",x" for line in data.splitlines()) + b"\n"


HARMLESS = {
    "nothing": lambda _: None,
    "meshes written anew": meshes_written_anew,
    "an STL without normals": lambda f: write_stl(f, "shell_a.stl", read(f, "a"), turn=0),
    "STEP on one line a statement, one more that nothing refers to": lambda folder: part21.edit(
        folder, "shell_a.step", lambda e: part21.add(e, "DIRECTION('',(0.,0.,1.))")
    ),
    "design.json in one line": lambda folder: put(
        folder, "design.json", json.dumps(load(folder, "design.json")).encode()
    ),
    "cameras in another order": at("cameras", lambda some: some[::-1]),
    "lines that end as in DOS": lambda folder: change(
        folder, "mirrors.csv", lambda data: data.replace(b"\n", b"\r\n")
    ),
    "mirrors in another order": mirrors(lambda rows, _: rows.reverse()),
    "a further column": lambda folder: change(folder, "mirrors.csv", a_further_column),
    "a file that is not listed": lambda folder: put(folder, "notes.txt", b"mine"),
    "a link inside": a_link_inside,
}


@pytest.mark.parametrize("name", HARMLESS)
def test_not_refused_without_need(name: str, good: Path, tmp_path: Path) -> None:
    assert attempt(Mutation(name, "harmless", HARMLESS[name], 0), good, tmp_path) == ""


@pytest.mark.parametrize(
    ("mutation", "wanting"),
    [
        (fails("nothing", "none", lambda _: (), "centre error"), "another exit status"),
        (fails("wrong reason", "STL", mesh(dented), "watertight"), "none of watertight says so"),
        (fails("wrong words", "STL", mesh(dented), "surface error", "b9999"), "does not say"),
        (fails("no export", "folder", gone("design.json"), "poses"), "refused"),
        (refused("other words", "folder", gone("design.json"), "mirrors.csv"), "does not say"),
    ],
    ids=str,
)
def test_a_trial_can_fail(mutation: Mutation, wanting: str, good: Path, tmp_path: Path) -> None:
    assert wanting in attempt(mutation, good, tmp_path)


def test_what_takes_too_long_is_unknown(good: Path) -> None:
    report = verify(good, options=replace(HERE, seconds=0.05))
    lost = [check for check in report.checks if check.passed is None]
    assert {check.name.partition(" ")[0] for check in lost} == {"step"}
    assert {check.file for check in lost} == {"shell_a.step", "shell_b.step", "lamp_ring.step"}
    assert not report.passed
    assert report.verdict.startswith("Files: FAIL, unknown: step solid")


def test_exit_statuses(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = copy(good, tmp_path / "export")
    mesh(dented)(folder)
    sign(folder)
    assert main([str(folder), "-q"]) == 1
    assert capsys.readouterr().out.startswith("Files: FAIL, failed: centre error")
    (folder / "shell_b.step").unlink()
    assert main([str(folder), "-q"]) == 2
    out = capsys.readouterr()
    assert out.out == ""
    assert "shell_b.step: missing" in out.err


READERS = {"shell_a.stl": lambda path: [facets_of(path)], "shell_a.3mf": read_3mf}
NAMES = ("design.json", "mirrors.csv", "manifest.json", "shell_a.step", *READERS)


@given(
    name=st.sampled_from(NAMES),
    place=st.floats(0, 1, exclude_max=True),
    bit=st.none() | st.integers(0, 7),
    piece=st.binary(max_size=20),
    length=st.none() | st.integers(0, 200),
)
@example(name="shell_a.step", place=0.5, bit=None, piece=b"", length=None)
@settings(max_examples=30)
def test_noise_is_told_in_one_line_and_moves_no_facet_unseen(
    good: Path, name: str, place: float, bit: int | None, piece: bytes, length: int | None
) -> None:
    """A bit turned, a piece replaced, or (no length) the file cut short."""

    def spoilt(data: bytes) -> bytes:
        at = int(place * len(data))
        if bit is not None:
            return data[:at] + bytes([data[at] ^ (1 << bit)]) + data[at + 1 :]
        return data[:at] + piece + (b"" if length is None else data[at + length :])

    with tempfile.TemporaryDirectory() as room:
        folder = copy(good, Path(room) / "export")
        change(folder, name, spoilt)
        if name != "manifest.json":
            sign(folder)
        try:
            report = verify(folder, options=HERE)
        except BadExport as error:
            said, passed = str(error), False
        else:
            said, passed = report.verdict, report.passed
        assert "\n" not in said
        if passed and name in READERS:
            both = (READERS[name](path / name) for path in (good, folder))
            assert all(np.array_equal(*pair) for pair in zip(*both, strict=True))
