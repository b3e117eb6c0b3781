"""Random changes to real files: told in one line, and let pass only where nothing has changed."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tbcad_verify import BadExport, verify

from tests.verify.corpus.copies import change, copy, sign
from tests.verify.corpus.flips import same
from tests.verify.corpus.trial import HERE

pytestmark = pytest.mark.corpus

NAMES = (
    "design.json",
    "mirrors.csv",
    "manifest.json",
    "shell_a.stl",
    "shell_a.3mf",
    "shell_a.step",
)
QUICK = settings(max_examples=10)


@given(
    name=st.sampled_from(NAMES),
    place=st.floats(0, 1, exclude_max=True),
    bit=st.integers(0, 7),
)
@QUICK
def test_a_bit_turned(good: Path, name: str, place: float, bit: int) -> None:
    def turn(data: bytes) -> bytes:
        at = int(place * len(data))
        return data[:at] + bytes([data[at] ^ (1 << bit)]) + data[at + 1 :]

    holds(good, name, turn)


@given(name=st.sampled_from(NAMES), place=st.floats(0, 1, exclude_max=True))
@example(name="shell_a.step", place=0.5)
@QUICK
def test_cut_short(good: Path, name: str, place: float) -> None:
    holds(good, name, lambda data: data[: int(place * len(data))])


@given(
    name=st.sampled_from(NAMES),
    place=st.floats(0, 1, exclude_max=True),
    piece=st.binary(max_size=20),
    length=st.integers(0, 200),
)
@QUICK
def test_a_piece_replaced(good: Path, name: str, place: float, piece: bytes, length: int) -> None:
    def replace(data: bytes) -> bytes:
        at = int(place * len(data))
        return data[:at] + piece + data[at + length :]

    holds(good, name, replace)


def holds(good: Path, name: str, how: Callable[[bytes], bytes]) -> None:
    """The verification ends without a traceback, and passes only what says the same as before."""
    with tempfile.TemporaryDirectory() as room:
        folder = copy(good, Path(room) / "export")
        change(folder, name, how)
        if name != "manifest.json":
            sign(folder)
        verified, said = outcome(folder)
        assert "\n" not in said
        assert not verified or same(good / name, folder / name)


def outcome(folder: Path) -> tuple[bool, str]:
    try:
        report = verify(folder, options=HERE)
    except BadExport as error:
        return False, str(error)
    return report.passed, report.verdict
