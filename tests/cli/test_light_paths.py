"""Help and bad input are answered before any heavy library is loaded, so that they take no time."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.commands import Words, commands

HEAVY = (
    *("numpy", "scipy", "OCP", "build123d", "cadquery", "trimesh", "numba", "pandas", "h5py"),
    *("matplotlib", "pyvista", "embreex", "skimage", "PIL", "lib3mf", "manifold3d", "distributed"),
)
BAD_INPUT = (
    ("--no-such-option",),
    ("no-such-command",),
    ("build", "--no-such-option"),
    ("build", "absent.toml"),
    ("build", "broken.toml"),
    ("build", "--set", "optics.nn=3"),
    ("build", "--set", "optics.n=many"),
    ("build", "--n", "999"),
    ("build", "--parts", "wheel"),
    ("build", "--parts", "prototype", "--radius-rule", "flat"),
    ("build", "--parts", "shell,prototype", "--set", "optics.camera_mm=[100, 5, -100]"),
    ("build", "--for-process", "woodwork"),
    ("build", "--for-process", "sla", "--yield", "2"),
    ("verify", "absent"),
    ("verify", "absent", "--time-limit", "0"),
    ("tolerance", "absent"),
    ("tolerance", "absent", "--process", "woodwork"),
    ("tolerance", "absent", "--set", "sphere_um=3"),
    ("tolerance", "absent", "--builds", "many"),
    ("tolerance", "absent", "--yield", "2"),
    ("tolerance", ".", "--object", "absent.ply"),
    ("capture", "absent"),
    ("capture", ".", "--object", "absent.ply"),
    ("capture", "absent", "--mesh", "--prototype"),
    ("view", "absent"),
    ("refocus", "absent"),
    ("picture", "absent"),
    ("study", "no-such-study"),
    ("study", "prototype", "absent"),
    ("study", "low-pass", ".", "--object", "absent.ply"),
)
LOADED = """
import sys
from tbcad.cli import run
code = run(sys.argv[1:])
print(code, *sys.modules)
"""


def code_and_modules(words: Words, folder: Path) -> tuple[int, set[str]]:
    """Exit code of a command in a process of its own, and the modules that it has loaded."""
    done = subprocess.run(
        [sys.executable, "-c", LOADED, *words],
        capture_output=True, encoding="utf-8", check=True, cwd=folder,
    )  # fmt: skip
    code, *modules = done.stdout.splitlines()[-1].split()
    return int(code), {name.partition(".")[0] for name in modules}


@pytest.mark.parametrize("words", commands(), ids=lambda words: " ".join(["tbcad", *words]))
def test_help_loads_no_heavy_library(words: Words, tmp_path: Path) -> None:
    code, modules = code_and_modules((*words, "--help"), tmp_path)
    assert code == 0
    assert not modules & set(HEAVY)


@pytest.mark.parametrize("words", BAD_INPUT, ids=" ".join)
def test_bad_input_loads_no_heavy_library(words: Words, tmp_path: Path) -> None:
    given = {"broken.toml": "[optics\nn = 3\n", "design.json": "{}"}
    for name, text in given.items():
        (tmp_path / name).write_text(text)
    code, modules = code_and_modules(words, tmp_path)
    assert code == 2
    assert not modules & set(HEAVY)
    assert {path.name for path in tmp_path.iterdir()} == given.keys()
