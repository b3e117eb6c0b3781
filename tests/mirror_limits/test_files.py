"""Files of an order: tables, and STEP with tolerances as other readers get them."""

import csv
from pathlib import Path

import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Surface

from tbcad.app.api import order
from tbcad.app.cli import run
from tbcad.cad.formats.step import read_named_solid
from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.mirrors.record import write_record
from tbcad.core.spec.load import load_spec
from tbcad.shell.files import shell_envelope, write_shell_solids

SMALL = ["n=4", "mirrors.coating_um=20"]


@pytest.fixture(scope="module")
def coated() -> MirrorDesign:
    return design(load_spec(None, SMALL))


@pytest.fixture(scope="module")
def exports(coated: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shells")
    write_record(folder, coated, shells=True)
    write_shell_solids(coated, shell_envelope(coated), folder)
    return folder


@pytest.fixture(scope="module")
def written(exports: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("order") / "out"
    order(exports, chain="cnc", out=out)
    return out


def table(folder: Path) -> list[dict[str, str]]:
    with (folder / "inspection_a.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_spheres_are_those_below_the_coat(written: Path, coated: MirrorDesign) -> None:
    rows, array = table(written), coated.arrays[0]
    assert [row["id"] for row in rows] == array.ids
    radius = [float(row["radius_mm"]) for row in rows]
    assert radius == pytest.approx(array.mirrors.radius - 0.020, abs=1e-12)
    columns = ("centre_x_mm", "centre_y_mm", "centre_z_mm")
    centre = [[float(row[axis]) for axis in columns] for row in rows]
    assert np.array(centre) == pytest.approx(array.mirrors.centre, abs=1e-9)


@pytest.mark.parametrize("half", ["a", "b"])
def test_the_datums_are_the_planes_of_seam_and_foot(
    exports: Path, coated: MirrorDesign, half: str
) -> None:
    """By their names in the STEP file, whose faces the kernel reads in another order."""
    faces = dict(read_named_solid(exports / f"shell_{half}.step").faces)
    for name, axis in (("seam", 0), ("foot", 2)):
        plane = BRepAdaptor_Surface(faces[name]).Plane()
        normal = np.array(plane.Axis().Direction().Coord())
        assert np.abs(normal) == pytest.approx(np.eye(3)[axis], abs=1e-12)
        level = coated.arrays[0].cells.surfaces.apex[-1, 2] if name == "foot" else 0.0
        assert plane.Location().Coord()[axis] == pytest.approx(level, abs=1e-9)


def test_tolerances_as_a_parser_of_the_grammar_reads_them(written: Path) -> None:
    """No CAD kernel: the schema, one zone a mirror in the frame A, B, C, and notes."""
    from steputils import p21

    file = p21.readfile(str(written / "shell_a_tolerances.step"))
    assert "AP242" in str(file.header.entities["FILE_SCHEMA"].params)
    zones, frames, names, notes = [], set(), {}, {}
    for instance in file.data[0].instances.values():
        entities = [instance.entity] if hasattr(instance, "entity") else instance.entities
        kinds = {entity.name: entity.params for entity in entities}
        if "SURFACE_PROFILE_TOLERANCE" in kinds:
            width = file[kinds["GEOMETRIC_TOLERANCE"][2]].entity.params[0]
            zones.append(float(width.param))
            frames.add(kinds["GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE"][0][0])
        if "DATUM" in kinds:
            names[instance.ref] = kinds["DATUM"][4]
        if "DESCRIPTIVE_REPRESENTATION_ITEM" in kinds:
            name, note = kinds["DESCRIPTIVE_REPRESENTATION_ITEM"]
            notes[name] = note
    given = sorted(float(row["profile_mm"]) for row in table(written))
    assert sorted(zones) == pytest.approx(given, abs=1e-12)
    for frame in frames:
        compartments = file[frame].entity.params[4]
        assert [names[file[one].entity.params[4]] for one in compartments] == ["A", "B", "C"]
    assert "Rq 4.4 nm" in notes["surface finish"]


def test_what_is_refused(
    record: Path, exports: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sample, out = Path(__file__).parents[2] / "docs" / "sample", str(tmp_path / "out")
    for words, wrong in (
        ([str(record)], "shell_a.step is not there: build the shell too"),
        ([str(sample), "--out", out], "its mirrors are planar"),
        ([str(exports), "--yield", "1.5"], "--yield 1.5: allowed is"),
    ):
        assert run(["order", "--chain", "cnc", *words]) == 2
        assert wrong in capsys.readouterr().err
    assert run(["inspection", str(exports)]) == 2
    assert "tbcad inspection is called order: write tbcad order" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_same_bytes(exports: Path, written: Path, tmp_path: Path) -> None:
    order(exports, chain="cnc", out=tmp_path / "again")
    for file in sorted(written.iterdir()):
        assert file.read_bytes() == (tmp_path / "again" / file.name).read_bytes(), file.name
