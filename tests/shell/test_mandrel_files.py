"""Files of negatives as other readers see them, and what an export is without them."""

import json
from pathlib import Path

import numpy as np
import pytest

from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec
from tbcad.output.build import write_export
from tbcad.output.parts import SHELL
from tbcad.shell.files import design_mandrel
from tests.exported_files import contents

KINDS = ("step", "stl", "3mf")


def with_mandrels(*options: str) -> MirrorDesign:
    return design(load_spec(None, ["n=4", "shell.negative=true", *options]))


@pytest.fixture(scope="module")
def mirrors() -> MirrorDesign:
    return with_mandrels()


@pytest.fixture(scope="module")
def exported(mirrors: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    write_export(mirrors, folder, [SHELL])
    return folder


def test_files_are_beside_the_shells_in_manifest_and_record(
    exported: Path, mirrors: MirrorDesign
) -> None:
    files = {f"mandrel_{camera}.{kind}" for camera in "ab" for kind in KINDS}
    manifest = json.loads((exported / "manifest.json").read_text(encoding="utf-8"))
    assert files <= set(manifest["files"])
    record = json.loads((exported / "design.json").read_text(encoding="utf-8"))
    draft = design_mandrel(mirrors).draft
    assert [one["name"] for one in record["mandrels"]] == ["mandrel_a", "mandrel_b"]
    for one, side in zip(record["mandrels"], (1, -1), strict=True):
        assert one["pull"] == pytest.approx(draft.pull * [side, 1, 1])
        assert one["draft_deg"] == pytest.approx(np.degrees(draft.angle), abs=1e-6)


def test_without_them_an_export_is_as_it_was(exported: Path, tmp_path: Path) -> None:
    """All other files have the same bytes, and the record names no mandrels."""
    write_export(design(load_spec(None, ["n=4"])), tmp_path, [SHELL])
    plain, full = contents(tmp_path), contents(exported)
    assert {*full} - {*plain} == {f"mandrel_{c}.{kind}" for c in "ab" for kind in KINDS}
    changed = {name for name in plain if plain[name] != full[name]}
    assert changed == {"design.json", "manifest.json"}
    assert "mandrels" not in json.loads(plain["design.json"])


def test_same_spec_same_bytes(exported: Path, tmp_path: Path) -> None:
    """Of shells, too; of a mandrel that can be drawn nothing is told."""
    assert write_export(with_mandrels(), tmp_path, [SHELL]).note == ""
    assert contents(tmp_path) == contents(exported)


def test_a_mandrel_that_cannot_be_drawn_is_told_and_the_remedy_draws(
    exported: Path, tmp_path: Path
) -> None:
    note = write_export(with_mandrels("shell.edges=pedestal"), tmp_path, [SHELL]).note
    assert "undercut by up to 30 degrees" in note
    assert "shell.edges to valley" in note
    record = json.loads((exported / "design.json").read_text(encoding="utf-8"))
    assert all(one["draft_deg"] > 15 for one in record["mandrels"])
