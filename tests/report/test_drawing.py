"""Pictures of an export: drawn from files as they were written, or refused in one line."""

import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tbcad.app.cli import run
from tests.exported_files import contents

SAMPLE = Path(__file__).parents[2] / "docs" / "sample"


@pytest.fixture
def export(tmp_path: Path) -> Path:
    folder = tmp_path / "exports"
    shutil.copytree(SAMPLE, folder)
    return folder


def cut_off(file: Path) -> None:
    with file.open("r+b") as stream:
        stream.truncate(file.stat().st_size - 500)


def changed(file: Path) -> None:
    """One bit in the middle: the size is right."""
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)


@pytest.mark.parametrize(
    ("name", "spoil", "words"),
    [
        ("shell_b.stl", cut_off, "is not as tbcad wrote it"),
        ("mirrors.csv", changed, "is not as tbcad wrote it"),
        ("design.json", Path.unlink, "is missing"),
    ],
)
def test_a_file_that_is_not_as_it_was_written_is_refused(
    export: Path,
    name: str,
    spoil: Callable[[Path], None],
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    spoil(export / name)
    out = export.parent / "shell.png"
    assert run(["picture", str(export), "--out", str(out)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert f"{name} {words}" in shown.err
    assert [path.name for path in export.parent.iterdir()] == ["exports"]


def test_a_picture_that_exists_is_kept(export: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = export.parent / "shell.png"
    out.write_text("mine")
    assert run(["picture", str(export), "--out", str(out)]) == 2
    assert "exists" in (line := capsys.readouterr().err)
    assert "--force" in line
    assert out.read_text() == "mine"


@pytest.mark.slow
@pytest.mark.skipif(
    sys.platform == "linux" and not (shutil.which("xvfb-run") or os.environ.get("DISPLAY")),
    reason="no screen, and no xvfb-run",
)
def test_the_shells_are_drawn_whole(export: Path) -> None:
    """The same bytes each time, and both halves."""
    before, out = contents(export), export.parent / "shell.png"
    assert run(["picture", str(export), "--out", str(out)]) == 0
    first = out.read_bytes()
    assert run(["picture", str(export), "--out", str(out), "--force"]) == 0
    assert out.read_bytes() == first
    assert contents(export) == before
    picture = np.asarray(Image.open(out).convert("L"))
    assert all((half < 255).mean() > 0.2 for half in np.split(picture, 2, axis=1))
