"""Files of negatives as other readers see them, and what an export is without them."""

import json
from pathlib import Path

import numpy as np
import pytest

from tbcad.mirrors.array import MirrorDesign, design
from tbcad.output.build import Export, write_export
from tbcad.output.parts import SHELL
from tbcad.shell.mandrel_files import camera_a_mandrel_mesh, design_mandrel, mandrel_solid
from tbcad.spec.load import load_spec
from tests.exported_files import contents
from tests.helpers import check_step, read_mesh

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
    """Of shells, too."""
    write_export(with_mandrels(), tmp_path, [SHELL])
    assert contents(tmp_path) == contents(exported)


@pytest.mark.parametrize("which", [0, 1])
def test_step_round_trip(exported: Path, mirrors: MirrorDesign, which: int) -> None:
    array = mirrors.arrays[which]
    built = mandrel_solid(mirrors, array)
    content = check_step(exported / f"mandrel_{array.camera_id}.step", built)
    assert content.kinds["StepGeom_SphericalSurface"] == len(array)


def test_step_has_each_mirrors_sphere_turned(exported: Path, mirrors: MirrorDesign) -> None:
    """Read by a parser that is no CAD kernel: sphere and sense of each named face."""
    from steputils import p21

    spheres, senses = {}, set()
    file = p21.readfile(str(exported / "mandrel_a.step"))
    for instance in file.data[0].instances.values():
        if not hasattr(instance, "entity") or instance.entity.name != "ADVANCED_FACE":
            continue
        name, _, surface, sense = instance.entity.params
        sphere = file[surface].entity
        if sphere.name == "SPHERICAL_SURFACE":
            placement = file[sphere.params[1]].entity
            point = file[placement.params[1]].entity.params[1]
            spheres[name] = (*point, sphere.params[2])
            senses.add(str(sense))
    array = mirrors.arrays[0]
    assert list(spheres) == array.ids
    expected = np.column_stack([array.mirrors.centre, array.mirrors.radius])
    assert np.array(list(spheres.values())) == pytest.approx(expected, abs=1e-9)
    assert senses == {".F."}


@pytest.mark.parametrize("kind", ["stl", "3mf"])
@pytest.mark.parametrize("camera", ["a", "b"])
def test_mesh_round_trip(exported: Path, mirrors: MirrorDesign, camera: str, kind: str) -> None:
    mesh, read = camera_a_mandrel_mesh(mirrors), read_mesh(exported / f"mandrel_{camera}.{kind}")
    assert len(read.faces) == len(mesh.triangles)
    assert read.is_watertight
    assert read.is_winding_consistent
    assert read.volume == pytest.approx(mesh.volume, rel=1e-6)


def exported_note(tmp_path: Path, *options: str) -> Export:
    return write_export(with_mandrels(*options), tmp_path, [SHELL])


def test_a_mandrel_that_cannot_be_drawn_is_told(tmp_path: Path) -> None:
    note = exported_note(tmp_path, "shell.edges=pedestal").note
    assert "undercut by up to 30 degrees" in note
    assert "shell.edges to valley" in note


def test_the_remedy_draws(exported: Path, tmp_path: Path) -> None:
    assert exported_note(tmp_path, "shell.edges=valley").note == ""
    record = json.loads((tmp_path / "design.json").read_text(encoding="utf-8"))
    assert all(one["draft_deg"] > 15 for one in record["mandrels"])
