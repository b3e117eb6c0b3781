"""Mirror images by their texts: the real one is taken for one, and nothing else is."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tbcad_verify.report.checks import Unknown
from tbcad_verify.run.processes import Processes
from tbcad_verify.step.kernel import reading
from tbcad_verify.step.kernel.reading import read_solid
from tbcad_verify.step.mirror_image import flipped_solid, is_mirror_image
from tbcad_verify.step.step_file import examine_all, load, parse, read_file
from tbcad_verify.step.text import read_text

from tbcad.mirrors.array import MirrorDesign
from tbcad.output.build import write_export
from tbcad.output.parts import SHELL

# What a change of the text can be about: numbers, references, senses, and kinds of entities.
WORD = re.compile(r"(?<![\w'])(?:-?\d+\.\d*(?:E[-+]\d+)?|#\d+|\.[TF]\.|[A-Z]+_[A-Z_]+)")


@pytest.fixture(scope="module")
def folder(small_design: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mirrored")
    write_export(small_design, folder, [SHELL])
    return folder


@pytest.fixture(scope="module")
def texts(folder: Path) -> tuple[str, str]:
    return (folder / "shell_a.step").read_text(), (folder / "shell_b.step").read_text()


def other_word(word: str) -> str:
    """Another word of the same kind."""
    if word in (".T.", ".F."):
        return ".F." if word == ".T." else ".T."
    if word.startswith("#"):
        return f"#{int(word[1:]) + 1}"
    if word[-1] in ".0123456789" and float(word):
        return word[1:] if word.startswith("-") else f"-{word}"
    return "1." if word[-1] in ".0123456789" else f"{word}_"


def test_a_shell_is_the_other_s_image(texts: tuple[str, str]) -> None:
    assert is_mirror_image(*texts)
    assert is_mirror_image(*texts[::-1])
    assert not is_mirror_image(texts[0], texts[0])


def test_blanks_and_names_mean_nothing(texts: tuple[str, str]) -> None:
    one, other = texts
    assert is_mirror_image(one, other.replace(",", ",\n ").replace("'b0001'", "'c0001'"))


@settings(max_examples=150)
@given(data=st.data())
def test_any_other_word_is_seen(texts: tuple[str, str], data: st.DataObject) -> None:
    one, other = texts
    words = list(WORD.finditer(other, other.index("DATA;")))
    word = words[data.draw(st.integers(0, len(words) - 1))]
    changed = other[: word.start()] + other_word(word[0]) + other[word.end() :]
    assert not is_mirror_image(one, changed)
    assert not is_mirror_image(changed, one)


@settings(max_examples=50)
@given(data=st.data())
def test_the_last_digit_is_seen(texts: tuple[str, str], data: st.DataObject) -> None:
    one, other = texts
    ends = list(re.finditer(r"\d(?=,|\))", other))
    end = ends[data.draw(st.integers(0, len(ends) - 1))]
    digit = str((int(end[0]) + 1) % 10)
    changed = other[: end.start()] + digit + other[end.end() :]
    assert not is_mirror_image(one, changed)


def test_what_cannot_be_read_is_no_image(texts: tuple[str, str]) -> None:
    one, other = texts
    assert not is_mirror_image(one, other[: len(other) // 2])
    assert not is_mirror_image("", other)
    assert not is_mirror_image(one, other.replace("PLANE(", "OFFSET_SURFACE("))
    assert not is_mirror_image(*(text.replace("PLANE(", "OFFSET_SURFACE(") for text in texts))
    assert not is_mirror_image(one, other.replace(".MILLI.", "$"))
    assert not is_mirror_image(one, other.replace("AUTOMOTIVE_DESIGN", "CONFIG_CONTROL_DESIGN"))


def test_the_kernel_would_read_the_same(folder: Path) -> None:
    """What is taken from camera a's file is what the kernel finds in camera b's."""
    one, other = (read_solid(folder / f"shell_{camera}.step") for camera in "ab")
    text = read_text(folder / "shell_b.step")
    taken, read = parse(text, flipped_solid(one)), parse(text, other)
    assert (taken.counts, taken.valid) == (read.counts, read.valid)
    assert taken.gap == pytest.approx(read.gap, rel=0.1)
    assert taken.mass.volume == pytest.approx(read.mass.volume, rel=1e-9)
    for name in ("centroid", "low", "high"):
        np.testing.assert_allclose(getattr(taken.mass, name), getattr(read.mass, name), atol=1e-6)
    for name in ("kind", "outward", "inward"):
        np.testing.assert_array_equal(getattr(taken.faces, name), getattr(read.faces, name))
    for name in ("point", "normal", "middle", "area"):
        mine, theirs = getattr(taken.faces, name), getattr(read.faces, name)
        np.testing.assert_allclose(mine, theirs, rtol=1e-9, atol=1e-9)


def read_by(folder: Path, files: tuple[str, str]) -> list[str]:
    """Files that the kernel reads of two of which the second may be the first's image."""
    kept: list[str] = []

    def read(path: Path) -> dict[str, Any]:
        kept.append(path.name)
        return read_solid(path)

    with mock.patch.object(reading, "read_solid", read):
        for name in files:
            read_file(folder / name, folder / files[0])
    return kept


def test_the_kernel_reads_what_is_no_image(folder: Path, texts: tuple[str, str]) -> None:
    assert read_by(folder, ("shell_a.step", "shell_b.step")) == ["shell_a.step"]
    broken = re.sub(r"(SPHERICAL_SURFACE\('',#\d+,)", r"\g<1>1", texts[1], count=1)
    (folder / "broken.step").write_text(broken)
    assert read_by(folder, ("shell_a.step", "broken.step")) == ["shell_a.step", "broken.step"]


def test_the_image_of_an_unknown_is_unknown(folder: Path) -> None:
    blobs = [load(folder, f"shell_{camera}.step") for camera in "ab"]
    with Processes(1, 0.01) as processes:
        found = examine_all(blobs, processes, {1: 0})
    assert all(isinstance(one, Unknown) for one in found)
