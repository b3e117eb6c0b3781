"""A disk that is full: one line, exit 2, the old export whole, nothing left behind."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from tests.exported_files import contents

WORDS = ["-m", "tbcad", "build", "--parts", "shell", "--no-verify", "--n", "4", "--out"]
COARSE = ["--set", "mesh.ray_error_mm=0.1", "--set", "mesh.structure_error_mm=0.2"]


def build(folder: Path, largest: int) -> subprocess.CompletedProcess[str]:
    """Build where no file may have more bytes; writes then fail as on a full disk."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

    command = [sys.executable, *WORDS, str(folder), *COARSE]
    return subprocess.run(
        command, preexec_fn=limit, capture_output=True, encoding="utf-8", check=False
    )


def slow(*values: int) -> list[object]:
    return [pytest.param(value, marks=pytest.mark.slow) for value in values]


@pytest.mark.parametrize("largest", [50_000, *slow(1_000, 200_000)])
def test_what_does_not_fit_leaves_everything_as_it_was(tmp_path: Path, largest: int) -> None:
    """At these sizes the record, the STEP file or the STL is the first that does not fit."""
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "manifest.json").write_text(
        '{"schema": "tbcad-manifest/1", "kind": "build", "files": {}}'
    )
    before = contents(folder)
    done = build(folder, largest)
    *progress, last = done.stderr.splitlines()
    assert done.returncode == 2, done.stderr
    assert last.startswith(f"tbcad: {folder} cannot be written: ")
    assert "make room on the disk" in last
    assert not [line for line in progress if "Traceback" in line or line.startswith("tbcad: ")]
    assert contents(folder) == before
    assert list(tmp_path.iterdir()) == [folder]
