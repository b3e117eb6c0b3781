"""The prototype's files: read back, and compared with the numbers they are from."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tbcad.core.mirrors.array import design
from tbcad.core.spec.load import load_spec
from tbcad.errors import InputError
from tbcad.output.build import write_export
from tbcad.output.parts import PARTS, PROTOTYPE, parse_parts
from tbcad.prototype.assembly_steps.machine import read_machine
from tbcad.prototype.assembly_steps.steps import assembly_steps

pytestmark = pytest.mark.slow
OPTIONS = ["n=6", "prototype.k=4", "prototype.frame.clearance_mm=1.5", "structure_error_mm=0.1"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("prototype")
    write_export(design(load_spec(None, OPTIONS)), place, [PROTOTYPE])
    return place


@pytest.fixture(scope="module")
def record(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "prototype.json").read_text())
    return found


def test_steps_of_assembly_take_exactly_the_list_of_parts(folder: Path) -> None:
    machine = read_machine(folder)
    sums = Counter[str]()
    for step in assembly_steps(machine):
        sums.update({use.part: use.quantity for use in step.parts})
    assert sums == Counter(machine.bill.quantities)


def test_all_files_are_there(folder: Path, record: dict[str, Any]) -> None:
    own = {part[kind] for part in record["parts"] for kind in ("step", "stl", "3mf")}
    tables = {
        "balls.csv",
        "stops.csv",
        "sag.csv",
        "rotation_plan.csv",
        "rotation_plan.nc",
        "bom.csv",
    }
    tables |= {"plate_holes.csv", "wiring.csv", "grbl_settings.txt"}
    sheets = [*record["drawings"], *record["caps"]]
    drawn = {one[kind] for one in sheets for kind in ("pdf", "dxf")}
    assert drawn >= {f"drawing_{part}.pdf" for part in ("plate", "wheel", "upright")}
    shroud = {path.name for path in folder.glob("shroud_*.dxf")}
    whole = {"prototype.json", "prototype.step", "prototype.glb", "assembly.pdf"}
    records = {"design.json", "mirrors.csv", "manifest.json", "camera.json"}
    assert {p.name for p in folder.iterdir()} == own | tables | drawn | shroud | whole | records
    assert json.loads((folder / "design.json").read_text())["parts"] == []


def test_lengths_of_the_gauge_are_those_of_its_marks(folder: Path, record: dict[str, Any]) -> None:
    place, design = record["camera_place"], json.loads((folder / "design.json").read_text())
    lengths, marks = place["lengths_mm"], np.array(place["marks_mm"])
    near, far = np.mean(marks @ record["frame"]["axis"], axis=0)
    pinhole = np.linalg.norm(design["cameras"][0]["pinhole_mm"])
    widths = np.linalg.norm(marks[0] - marks[1], axis=1)
    assert widths == pytest.approx([lengths["near_width"], lengths["far_width"]])
    assert lengths["hub_to_far"] - lengths["hub_to_near"] == pytest.approx(far - near)
    assert lengths["hub_to_pinhole"] - lengths["hub_to_near"] == pytest.approx(pinhole - near)


def test_parts_by_name() -> None:
    assert parse_parts("prototype, shell") == PARTS
    assert parse_parts("prototype,") == ("prototype",)
    for text in ("", ",", "shells", "shell;prototype"):
        with pytest.raises(InputError, match="name shell, prototype or shell,prototype"):
            parse_parts(text)
