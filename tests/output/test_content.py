"""Which content replaces which, over all pairs of kinds; and what is read is not replaced."""

import json
import os
from itertools import product
from pathlib import Path
from typing import get_args

import pytest

from tbcad.errors import InputError
from tbcad.output.folder import check_replaceable, replacing
from tbcad.output.manifest import COSTLY, fingerprint, kind_of, write_manifest
from tbcad.records.document import Kind
from tests.output.test_folder import tree

KINDS: tuple[Kind, ...] = get_args(Kind)
ASKED = ("capture", "merged run", "calibration")


@pytest.fixture(autouse=True)
def _versions(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("tbcad.output.manifest.version", lambda _: "1")
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")


def fake(folder: Path, kind: Kind) -> Path:
    """A folder of a kind with a record, and a manifest but for runs."""
    folder.mkdir(parents=True)
    name = "run.json" if kind == "run" else "design.json"
    (folder / name).write_text(json.dumps({"schema": f"tbcad-{kind}/1"}))
    if kind != "run":
        write_manifest(folder, kind)
    return folder


@pytest.mark.parametrize("present", KINDS)
def test_only_the_same_kind_is_replaced(tmp_path: Path, present: Kind) -> None:
    """And what cost hours only with force; photographs never; and nothing is written into it."""
    folder = fake(tmp_path / "it", present)
    before = tree(tmp_path)
    assert kind_of(folder) == present
    for kind, force in product(KINDS, (False, True)):
        if kind == present and kind != "run" and (force or kind not in ASKED):
            check_replaceable(folder, kind, force)
        else:
            words = "--force" if kind == present != "run" else "name another folder"
            with pytest.raises(InputError, match=words) as error:
                check_replaceable(folder, kind, force)
            assert "\n" not in str(error.value)
            with pytest.raises(InputError), replacing(folder, kind, force):
                pytest.fail("work began")
        with pytest.raises(InputError, match="is inside"):
            check_replaceable(folder / "deep" / "new", kind, True)
        assert tree(tmp_path) == before, kind
    assert COSTLY == ASKED


@pytest.mark.parametrize("inner", KINDS)
def test_a_folder_of_folders_is_not_replaced(tmp_path: Path, inner: Kind) -> None:
    """The message tells what is in it, and where else to write."""
    fake(tmp_path / "captures" / "knot", inner)
    with pytest.raises(InputError, match=r"holds knot, an? .*|holds knot, solids") as error:
        check_replaceable(tmp_path / "captures", "capture", True)
    assert "did not write" not in str(error.value)
    check_replaceable(tmp_path / "captures" / "other", "capture", False)


def test_content_of_an_unknown_kind_is_not_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "it"
    folder.mkdir()
    (folder / "notes").write_text("mine")
    write_manifest(folder, "build")
    manifest = json.loads((folder / "manifest.json").read_text())
    for kind in ("", "hologram"):
        (folder / "manifest.json").write_text(json.dumps(manifest | {"kind": kind}))
        assert kind_of(folder) == kind
        with pytest.raises(InputError, match="does not replace"):
            check_replaceable(folder, "build", True)


def test_a_foreign_record_is_no_content_of_tbcad(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text('{"schema": "somebody else"}')
    assert kind_of(tmp_path) is None
    (tmp_path / "run.json").write_text("[" * 100_000)
    assert kind_of(tmp_path) is None


class TestInputs:
    @pytest.mark.parametrize("kind", KINDS)
    def test_are_not_replaced(self, tmp_path: Path, kind: Kind) -> None:
        source, alias = fake(tmp_path / "it", kind), tmp_path / "alias"
        alias.symlink_to(source)
        before = tree(tmp_path)
        dotted = source.parent / "work" / ".." / source.name
        for called in (source, dotted, Path(os.path.relpath(source)), alias):
            for out in (called, called / "inner", called / "a" / "b"):
                for inputs in ((None, "", tmp_path / "none", source), (called,)):
                    with pytest.raises(InputError, match="this command"):
                        check_replaceable(out, kind, True, inputs)
        with pytest.raises(InputError, match=r"work.*holds|folder you are in|above your work"):
            check_replaceable(source.parent, kind, True, (source,))
        assert tree(tmp_path) == before

    def test_a_file_in_the_output_is_not_replaced(self, tmp_path: Path) -> None:
        folder = fake(tmp_path / "it", "capture")
        mesh = folder / "deep" / "my.ply"
        mesh.parent.mkdir()
        mesh.touch()
        alias = tmp_path / "alias.ply"
        alias.symlink_to(mesh)
        for source in (mesh, alias):
            with pytest.raises(InputError, match=r"holds .* which this command reads"):
                check_replaceable(folder, "capture", True, (source,))

    def test_neighbours_are_apart(self, tmp_path: Path) -> None:
        source = fake(tmp_path / "captures" / "knot", "capture")
        check_replaceable(tmp_path / "captures" / "knot2", "capture", False, (source,))
        check_replaceable(tmp_path / "new" / "deep", "capture", False, (source,))


class TestBuildOfARun:
    def photographed(self, run: Path, build: Path) -> None:
        fake(run, "run")
        digests = {"design.json": fingerprint(build / "design.json").sha256}
        (run / "run.json").write_text(
            json.dumps({"schema": "tbcad-run/1", "export_sha256": digests})
        )

    @pytest.mark.parametrize("run", ["run", "runs/first", "work/run", "work/runs/first"])
    def test_is_replaced_with_force_only(self, tmp_path: Path, run: str) -> None:
        build = fake(tmp_path / "builds" / "it", "build")
        place = tmp_path if run.startswith("work") else tmp_path / "builds"
        self.photographed(place / run, build)
        with pytest.raises(InputError, match=f"{run}.*--force"):
            check_replaceable(build, "build", False)
        check_replaceable(build, "build", True)

    def test_another_build_is_replaced_unasked(self, tmp_path: Path) -> None:
        build, other = fake(tmp_path / "it", "build"), fake(tmp_path / "other", "build")
        (other / "design.json").write_text('{"schema": "tbcad-design/2", "n": 3}')
        write_manifest(other, "build")
        self.photographed(tmp_path / "run", other)
        check_replaceable(build, "build", False)
