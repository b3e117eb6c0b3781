"""Broken STEP and 3MF files and folders: each must be caught, and for its own reason."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tbcad_verify import BadExport, verify

from tests.helpers import read_3mf
from tests.verify.corpus.broken_3mfs import THREEMFS
from tests.verify.corpus.broken_files import FILES
from tests.verify.corpus.broken_steps import STEPS
from tests.verify.corpus.copies import change, copy, sign
from tests.verify.corpus.mutation import HERE, Mutation, attempt
from tests.verify.synthetic_export import facets_of

pytestmark = pytest.mark.corpus

MESHES = {"shell_a.stl": lambda path: [facets_of(path)], "shell_a.3mf": read_3mf}
NAMES = ("design.json", "mirrors.csv", "manifest.json", "shell_a.step", *MESHES)


@pytest.mark.parametrize("mutation", [*STEPS, *THREEMFS, *FILES], ids=str)
def test_caught(mutation: Mutation, good: Path, tmp_path: Path) -> None:
    assert attempt(mutation, good, tmp_path) == ""


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
        if passed and name in MESHES:
            both = (MESHES[name](path / name) for path in (good, folder))
            assert all(np.array_equal(*pair) for pair in zip(*both, strict=True))
