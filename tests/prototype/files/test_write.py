"""The prototype's files: read back, and compared with the numbers they are from."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.output.build import write_export
from tbcad.output.parts import PARTS, PROTOTYPE, parse_parts
from tbcad.prototype.assembly_steps.machine import read_machine
from tbcad.prototype.assembly_steps.steps import assembly_steps
from tests.exported_files import Rows, contents, read_csv
from tests.helpers import area, read_mesh, read_step, volume

pytestmark = pytest.mark.slow
MESH_ERROR_MM = 0.1
OPTIONS = [
    *("n=6", "prototype.k=4", "prototype.frame.clearance_mm=1.5"),
    f"structure_error_mm={MESH_ERROR_MM}",
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("prototype")
    write_export(design(load_spec(None, OPTIONS)), place, [PROTOTYPE])
    return place


@pytest.fixture(scope="module")
def record(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "prototype.json").read_text())
    return found


@pytest.fixture(scope="module")
def balls(folder: Path) -> Rows:
    return read_csv(folder / "balls.csv")


def test_steps_of_assembly_take_exactly_the_list_of_parts(folder: Path) -> None:
    machine = read_machine(folder)
    sums = Counter[str]()
    for step in assembly_steps(machine):
        sums.update({use.part: use.quantity for use in step.parts})
    assert sums == Counter(machine.quantities)


def centre_of(ball: dict[str, str]) -> NDArray[np.float64]:
    """Of the body in the seat, mm."""
    return np.array([float(ball[key]) for key in ("bx", "by", "bz")])


def test_all_files_are_there(folder: Path, record: dict[str, Any]) -> None:
    own = {part[kind] for part in record["parts"] for kind in ("step", "stl", "3mf")}
    tables = {"balls.csv", "stops.csv", "rotation_plan.csv", "rotation_plan.nc", "bom.csv"}
    tables |= {"plate_holes.csv", "wiring.csv", "grbl_settings.txt", "klipper.cfg"}
    tables |= {"rotation_plan_klipper.gcode"}
    sheets = [*record["drawings"], *record["caps"]]
    drawn = {one[kind] for one in sheets for kind in ("pdf", "dxf")}
    assert drawn >= {f"drawing_{part}.pdf" for part in ("plate", "wheel", "upright")}
    shroud = {path.name for path in folder.glob("shroud_*.dxf")}
    whole = {"prototype.json", "prototype.step", "prototype.glb"}
    records = {"design.json", "mirrors.csv", "manifest.json", "camera.json"}
    assert {p.name for p in folder.iterdir()} == own | tables | drawn | shroud | whole | records
    assert json.loads((folder / "design.json").read_text())["parts"] == []


def test_meshes_lie_on_the_bed_and_steps_stand_in_the_rig(
    folder: Path, record: dict[str, Any]
) -> None:
    for part in record["parts"]:
        mesh, step = read_mesh(folder / part["stl"]), read_step(folder / part["step"])
        assert mesh.is_watertight, part["name"]
        assert mesh.bounds[0][2] == pytest.approx(0, abs=0.15)
        assert step.solids == 1
        assert step.valid
        off = abs(mesh.volume - volume(step.shape))
        assert off < MESH_ERROR_MM * area(step.shape)
        axes = np.array(part["axes"])
        assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-12)
        assert np.linalg.det(axes) == pytest.approx(1)


def test_lengths_of_the_gauge_are_those_of_its_marks(folder: Path, record: dict[str, Any]) -> None:
    place, design = record["camera_place"], json.loads((folder / "design.json").read_text())
    lengths, marks = place["lengths_mm"], np.array(place["marks_mm"])
    near, far = np.mean(marks @ record["frame"]["axis"], axis=0)
    pinhole = np.linalg.norm(design["cameras"][0]["pinhole_mm"])
    widths = np.linalg.norm(marks[0] - marks[1], axis=1)
    assert widths == pytest.approx([lengths["near_width"], lengths["far_width"]])
    assert lengths["hub_to_far"] - lengths["hub_to_near"] == pytest.approx(far - near)
    assert lengths["hub_to_pinhole"] - lengths["hub_to_near"] == pytest.approx(pinhole - near)


def test_the_plates_holes_lie_under_the_feet(folder: Path, record: dict[str, Any]) -> None:
    """In the assembly's plate, as drilled, seen from above; and every foot is held by some."""
    rows = read_csv(folder / "plate_holes.csv")
    frame = {part["name"] for part in record["parts"] if part["role"] == "frame"}
    elsewhere = {"bearing_head", "home_bracket", "camera_plate", "camera_fence"}
    elsewhere |= {name for name in frame if name.startswith("lamp_holder")}
    assert {row["holds"] for row in rows} == frame - elsewhere
    scene = trimesh.load(folder / "prototype.glb")
    matrix, name = scene.graph["plate"]
    points = 1000 * trimesh.transform_points(scene.geometry[name].vertices, matrix)
    flat = points[:, [0, 2]] * [1, -1]
    places = np.array([[float(row["x_mm"]), float(row["y_mm"])] for row in rows])
    for place in places + flat.min(axis=0):
        away = np.linalg.norm(flat - place, axis=1)
        assert away.min() == pytest.approx(2.1, abs=0.05)  # of a tapped M5 hole
        assert (away < 2.2).sum() > 20


def test_the_glb_is_in_metres_and_upright(folder: Path, balls: Rows) -> None:
    scene = trimesh.load(folder / "prototype.glb")
    (ball,) = [one for one in balls if one["kind"] == "ball"]
    matrix, name = scene.graph[f"ball_{ball['number']}"]
    points = trimesh.transform_points(scene.geometry[name].vertices, matrix)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    wanted = centre_of(ball)[[0, 2, 1]] * [1, 1, -1] / 1000
    assert middle == pytest.approx(wanted, abs=2e-4)
    assert np.ptp(points, axis=0) == pytest.approx(
        np.full(3, 2e-3 * float(ball["body_radius_mm"])), rel=5e-3
    )


def test_the_same_bytes_again(folder: Path, tmp_path: Path) -> None:
    write_export(design(load_spec(None, OPTIONS)), tmp_path, [PROTOTYPE])
    assert contents(tmp_path) == contents(folder)


def test_parts_by_name() -> None:
    assert parse_parts("prototype, shell") == PARTS
    assert parse_parts("prototype,") == ("prototype",)
    for text in ("", ",", "shells", "shell;prototype"):
        with pytest.raises(InputError, match="name shell, prototype or one of them"):
            parse_parts(text)
