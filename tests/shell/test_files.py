import json
import re
from pathlib import Path

import numpy as np
import pytest

from tbcad.cad.kernel.checks import properties
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.spec.load import load_spec, spec_dict
from tbcad.output.build import write_export
from tbcad.output.parts import SHELL
from tbcad.shell.files import camera_solid
from tbcad.shell.halves import design_mandrel
from tests.exported_files import contents, read_csv
from tests.helpers import check_step, read_mesh, read_step
from tests.mirror_arrays import mirror_design
from tests.shell.test_bodies import MESH_OF, SOLID_OF

NEGATIVES = {f"mandrel_{camera}.{kind}" for camera in "ab" for kind in ("step", "stl", "3mf")}
BODIES = pytest.mark.parametrize("body", SOLID_OF)


@pytest.fixture(scope="module")
def mirrors() -> MirrorDesign:
    return mirror_design("n=4", "shell.negative=true")


@pytest.fixture(scope="module")
def exported(mirrors: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    write_export(mirrors, folder, [SHELL])
    return folder


@BODIES
@pytest.mark.parametrize("which", [0, 1])
def test_step_round_trip(exported: Path, mirrors: MirrorDesign, body: str, which: int) -> None:
    array = mirrors.arrays[which]
    built = SOLID_OF[body](mirrors, array)
    content = check_step(exported / f"{body}_{array.camera_id}.step", built)
    assert content.kinds["StepGeom_SphericalSurface"] == len(array)
    assert sum(content.kinds.values()) == len(built.faces)


@pytest.mark.parametrize("which", [0, 1])
def test_validation_properties_are_those_of_the_solid(
    exported: Path, mirrors: MirrorDesign, which: int
) -> None:
    """Those of camera b's shell come by symmetry from camera a's."""
    array = mirrors.arrays[which]
    text = "".join((exported / f"shell_{array.camera_id}.step").read_text().split())
    expected = properties(camera_solid(mirrors, array).shape)
    number = r"\(([-+.E0-9]+)\)"
    assert float(re.findall(f"VOLUME_MEASURE{number}", text)[0]) == pytest.approx(expected.volume)
    assert float(re.findall(f"AREA_MEASURE{number}", text)[0]) == pytest.approx(expected.area)
    (point,) = re.findall(r"CARTESIAN_POINT\('centrepoint',\(([^)]*)\)\)", text)
    centre = [float(x) for x in point.split(",")]
    assert centre == pytest.approx(expected.centroid, abs=1e-6)
    assert abs(centre[1]) < 1e-5 < abs(centre[0])


@BODIES
def test_step_faces_keep_name_place_radius_and_side(
    exported: Path, mirrors: MirrorDesign, body: str
) -> None:
    """Read by a parser that is no CAD kernel: sphere of each named face."""
    from steputils import p21

    file = p21.readfile(str(exported / f"{body}_a.step"))
    array = mirrors.arrays[0]
    spheres, senses = {}, set()
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
    assert list(spheres) == array.ids
    expected = np.column_stack([array.mirrors.centre, array.mirrors.radius])
    assert np.array(list(spheres.values())) == pytest.approx(expected, abs=1e-9)
    assert (senses == {".F."}) == (body == "mandrel")


@BODIES
@pytest.mark.parametrize("kind", ["stl", "3mf"])
@pytest.mark.parametrize("camera", ["a", "b"])
def test_mesh_round_trip(
    exported: Path, mirrors: MirrorDesign, body: str, camera: str, kind: str
) -> None:
    mesh, read = MESH_OF[body](mirrors), read_mesh(exported / f"{body}_{camera}.{kind}")
    assert len(read.faces) == len(mesh.triangles)
    assert read.is_watertight
    assert read.is_winding_consistent
    assert read.volume == pytest.approx(mesh.volume, rel=1e-6)


def test_record(exported: Path, mirrors: MirrorDesign) -> None:
    rows = read_csv(exported / "mirrors.csv")
    document = json.loads((exported / "design.json").read_text())
    assert document["spec"] == spec_dict(mirrors.spec)
    assert [row["id"] for row in rows] == [*mirrors.arrays[0].ids, *mirrors.arrays[1].ids]
    for array in mirrors.arrays:
        own_rows = [row for row in rows if row["camera"] == array.camera_id]
        apex = np.array([[float(row[k]) for k in ("px", "py", "pz")] for row in own_rows])
        assert np.array_equal(apex, array.mirrors.apex)  # full double precision
        assert np.array_equal([float(row["coverage_mm"]) for row in own_rows], array.coverage)


def test_planar_mirrors_have_no_sphere(tmp_path: Path) -> None:
    write_export(mirror_design("n=2", "radius_rule=flat"), tmp_path, [SHELL])
    row = read_csv(tmp_path / "mirrors.csv")[0]
    assert row["radius_mm"] == row["cx"] == ""
    assert float(row["coverage_mm"]) > 0
    assert read_step(tmp_path / "shell_a.step").kinds["StepGeom_Plane"] >= 15


def test_pcurves_on_request(tmp_path: Path) -> None:
    for pcurves in ("false", "true"):
        folder = tmp_path / pcurves
        folder.mkdir()
        write_export(mirror_design("n=2", f"step.pcurves={pcurves}"), folder, [SHELL])
        assert ("PCURVE" in (folder / "shell_a.step").read_text()) == (pcurves == "true")


def test_negatives_are_in_manifest_and_record(exported: Path, mirrors: MirrorDesign) -> None:
    manifest = json.loads((exported / "manifest.json").read_text(encoding="utf-8"))
    assert set(manifest["files"]) >= NEGATIVES
    record = json.loads((exported / "design.json").read_text(encoding="utf-8"))
    draft = design_mandrel(mirrors).draft
    assert [one["name"] for one in record["mandrels"]] == ["mandrel_a", "mandrel_b"]
    for one, side in zip(record["mandrels"], (1, -1), strict=True):
        assert one["pull"] == pytest.approx(draft.pull * [side, 1, 1])
        assert one["draft_deg"] == pytest.approx(np.degrees(draft.angle), abs=1e-6)
        assert one["draft_deg"] > 15


def test_without_negatives_an_export_is_as_it_was(exported: Path, tmp_path: Path) -> None:
    """All other files have the same bytes, and the record names no mandrels."""
    write_export(mirror_design("n=4"), tmp_path, [SHELL])
    plain, full = contents(tmp_path), contents(exported)
    assert {*full} - {*plain} == NEGATIVES
    changed = {name for name in plain if plain[name] != full[name]}
    assert changed == {"design.json", "manifest.json"}
    assert "mandrels" not in json.loads(plain["design.json"])


def test_same_spec_same_bytes(exported: Path, tmp_path: Path) -> None:
    """Of shells, too; of a mandrel that can be drawn nothing is told."""
    again = design(load_spec(None, ["n=4", "shell.negative=true"]))
    assert write_export(again, tmp_path, [SHELL]).note == ""
    assert contents(tmp_path) == contents(exported)


def test_a_mandrel_that_cannot_be_drawn_is_told_with_what_helps(tmp_path: Path) -> None:
    made = mirror_design("n=4", "shell.negative=true", "shell.edges=pedestal")
    note = write_export(made, tmp_path, [SHELL]).note
    assert "undercut by up to 30 degrees" in note
    assert "shell.edges to valley" in note
