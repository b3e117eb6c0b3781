"""Files that a command writes among those of the user."""

import json
from pathlib import Path

import pytest

from tbcad.errors import InputError
from tbcad.output.manifest import write_manifest
from tbcad.output.single_files import check_file


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("tbcad.output.manifest.version", lambda _: "1")
    folder = tmp_path / "it"
    (folder / "images").mkdir(parents=True)
    for name in ("design.json", "images/a.png"):
        (folder / name).write_text("{}")
    write_manifest(folder, "build")
    return folder


@pytest.mark.parametrize("name", ["design.json", "images/a.png", "manifest.json", "verify.json"])
def test_one_of_a_build_is_not_replaced(build: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"belongs to .*it, a build"):
        check_file(build / name, force=True)
    (build / name).unlink(missing_ok=True)
    if name != "manifest.json":
        with pytest.raises(InputError, match="belongs to"):
            check_file(build / "images" / ".." / name, force=False)


def test_another_file_may_be_beside_them(build: Path) -> None:
    check_file(build / "shell.png", force=False)
    (build / "shell.png").touch()
    with pytest.raises(InputError, match=r"exists: .*--force"):
        check_file(build / "shell.png", force=False)
    check_file(build / "shell.png", force=True)


def test_a_photograph_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "photographs").mkdir()
    (tmp_path / "run.json").write_text(json.dumps({"schema": "tbcad-run/1"}))
    taken = tmp_path / "photographs" / "a.png"
    taken.touch()
    with pytest.raises(InputError, match="a run: choose another name"):
        check_file(taken, force=True)
    check_file(tmp_path / "photographs" / "b.png", force=False)


def test_one_that_is_read_is_not_replaced(tmp_path: Path) -> None:
    light, alias, twin = (tmp_path / name for name in ("sky.png", "alias.png", "twin.png"))
    light.touch()
    alias.symlink_to(light)
    twin.hardlink_to(light)
    for file in (light, alias, twin, tmp_path / "none" / ".." / "sky.png"):
        (tmp_path / "none").mkdir(exist_ok=True)
        with pytest.raises(InputError, match="is read by this command"):
            check_file(file, force=True, inputs=(None, tmp_path / "missing", light))
    with pytest.raises(InputError, match="is a folder"):
        check_file(tmp_path / "none", force=True)
