import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pytest

from tbcad.cad.measures import properties
from tbcad.mirrors.array import MirrorDesign, design
from tbcad.mirrors.record import COLUMNS
from tbcad.output.build import write_export
from tbcad.output.parts import SHELL
from tbcad.shell.files import camera_a_mesh, camera_solid, shell_properties
from tbcad.spec.load import load_spec, spec_dict
from tests.exported_files import read_csv
from tests.helpers import check_step, read_mesh, read_step


@pytest.fixture(scope="module")
def exported(small_design: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    write_export(small_design, folder, [SHELL])
    return folder


def test_all_files_are_there(exported: Path) -> None:
    kinds = ("step", "stl", "3mf")
    shells = [f"shell_{camera}.{kind}" for camera in "ab" for kind in kinds]
    assert {p.name for p in exported.iterdir()} == {
        "camera.json",
        "design.json",
        "mirrors.csv",
        "manifest.json",
        *shells,
    }


@pytest.mark.parametrize("which", [0, 1])
def test_step_round_trip(exported: Path, small_design: MirrorDesign, which: int) -> None:
    array = small_design.arrays[which]
    built = camera_solid(small_design, array)
    content = check_step(exported / f"shell_{array.camera_id}.step", built)
    assert content.kinds["StepGeom_SphericalSurface"] == len(array)
    assert sum(content.kinds.values()) == len(built.faces)


@pytest.mark.parametrize("which", [0, 1])
def test_validation_properties_are_those_of_the_solid(
    exported: Path, small_design: MirrorDesign, which: int
) -> None:
    """Those of camera b's shell come by symmetry from camera a's."""
    array = small_design.arrays[which]
    text = "".join((exported / f"shell_{array.camera_id}.step").read_text().split())
    expected = properties(camera_solid(small_design, array).shape)
    number = r"\(([-+.E0-9]+)\)"
    assert float(re.findall(f"VOLUME_MEASURE{number}", text)[0]) == pytest.approx(expected.volume)
    assert float(re.findall(f"AREA_MEASURE{number}", text)[0]) == pytest.approx(expected.area)
    (point,) = re.findall(r"CARTESIAN_POINT\('centrepoint',\(([^)]*)\)\)", text)
    centre = [float(x) for x in point.split(",")]
    assert centre == pytest.approx(expected.centroid, abs=1e-6)
    assert abs(centre[1]) < 1e-5 < abs(centre[0])


def test_step_faces_keep_name_place_and_radius(exported: Path, small_design: MirrorDesign) -> None:
    """Read by a parser that is no CAD kernel: sphere of each named face."""
    from steputils import p21

    file = p21.readfile(str(exported / "shell_a.step"))
    array = small_design.arrays[0]
    spheres = {}
    for instance in file.data[0].instances.values():
        if not hasattr(instance, "entity") or instance.entity.name != "ADVANCED_FACE":
            continue
        name, _, surface, _ = instance.entity.params
        sphere = file[surface].entity
        if sphere.name == "SPHERICAL_SURFACE":
            placement = file[sphere.params[1]].entity
            point = file[placement.params[1]].entity.params[1]
            spheres[name] = (*point, sphere.params[2])
    assert list(spheres) == array.ids
    expected = np.column_stack([array.mirrors.centre, array.mirrors.radius])
    assert np.array(list(spheres.values())) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("kind", ["stl", "3mf"])
@pytest.mark.parametrize("camera", ["a", "b"])
def test_mesh_round_trip(
    exported: Path, small_design: MirrorDesign, camera: str, kind: str
) -> None:
    mesh, read = camera_a_mesh(small_design), read_mesh(exported / f"shell_{camera}.{kind}")
    assert len(read.faces) == len(mesh.triangles)
    assert read.is_watertight
    assert read.is_winding_consistent
    assert read.volume == pytest.approx(mesh.volume, rel=1e-6)


def test_record(exported: Path, small_design: MirrorDesign) -> None:
    rows = read_csv(exported / "mirrors.csv")
    assert tuple(rows[0]) == COLUMNS
    document = json.loads((exported / "design.json").read_text())
    assert document["spec"] == spec_dict(small_design.spec)
    assert document["mirrors"] == "mirrors.csv"
    assert [row["id"] for row in rows] == [*small_design.arrays[0].ids, *small_design.arrays[1].ids]
    for array in small_design.arrays:
        own_rows = [row for row in rows if row["camera"] == array.camera_id]
        apex = np.array([[float(row[k]) for k in ("px", "py", "pz")] for row in own_rows])
        assert np.array_equal(apex, array.mirrors.apex)  # full double precision
        assert np.array_equal([float(row["coverage_mm"]) for row in own_rows], array.coverage)


def test_planar_mirrors_have_no_sphere(tmp_path: Path) -> None:
    write_export(design(load_spec(None, ["n=2", "radius_rule=flat"])), tmp_path, [SHELL])
    row = read_csv(tmp_path / "mirrors.csv")[0]
    assert row["radius_mm"] == row["cx"] == ""
    assert float(row["coverage_mm"]) > 0
    assert read_step(tmp_path / "shell_a.step").kinds["StepGeom_Plane"] >= 15


def test_manifest_holds_every_file(exported: Path) -> None:
    manifest = json.loads((exported / "manifest.json").read_text())
    names = {p.name for p in exported.iterdir()} - {"manifest.json"}
    assert set(manifest["files"]) == names
    for name, entry in manifest["files"].items():
        data = (exported / name).read_bytes()
        assert entry == {"sha256": hashlib.sha256(data).hexdigest(), "size": len(data)}
    assert {"tbcad", "cadquery-ocp", "numpy"} <= set(manifest["versions"])


def test_pcurves_on_request(tmp_path: Path) -> None:
    sizes = []
    for pcurves in ("false", "true"):
        folder = tmp_path / pcurves
        folder.mkdir()
        write_export(design(load_spec(None, ["n=2", f"step.pcurves={pcurves}"])), folder, [SHELL])
        text = (folder / "shell_a.step").read_text()
        assert ("PCURVE" in text) == (pcurves == "true")
        sizes.append(len(text))
    assert sizes[1] > 1.5 * sizes[0]


@pytest.mark.parametrize("place", [[], ["camera_mm=[70.0,20.0,-38.8]"]])
def test_properties_are_those_that_the_kernel_integrates(place: list[str]) -> None:
    """The slow way is the oracle."""
    made = design(load_spec(None, ["n=5", *place]))
    for array in made.arrays:
        solid = camera_solid(made, array)
        fast, slow = shell_properties(solid, array), properties(solid.shape)
        assert fast.volume == pytest.approx(slow.volume, rel=1e-6)
        assert fast.area == pytest.approx(slow.area, rel=1e-9)
        assert fast.centroid == pytest.approx(slow.centroid, abs=1e-4)
