"""Pedestals in closed form from the record, and shells on them verified as a whole."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.record.export import Export
from tbcad_verify.run.verify import verify
from tbcad_verify.step.sphere_union import cells_of_export, walls_of_export

from tbcad.mirrors.array import MirrorDesign
from tbcad.optics.cells import cell_areas
from tbcad.optics.power_diagram import PLANES
from tbcad.output.build import write_export
from tests.pedestal_designs import pedestal_design
from tests.verify.step.test_sphere_union import as_export

SETTINGS = [
    ["n=2"],
    ["n=7"],
    ["n=12"],  # some borders are shorter than the groove
    ["n=5", "shell.groove_mm=0.6"],
    ["n=4", "radius_rule=flat"],
    ["n=5", "camera_mm=[120, 15, -90]"],
]


def exported(design: MirrorDesign) -> Export:
    """What a reader of this design's files would hand on."""
    export = as_export(design)
    shell = export.spec.shell.model_copy(
        update={"edges": "pedestal", "groove_mm": design.spec.shell.groove_mm}
    )
    return replace(export, spec=export.spec.model_copy(update={"shell": shell}))


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_areas_and_walls_follow_from_the_record(settings: list[str]) -> None:
    design = pedestal_design(*settings)
    export = exported(design)
    for camera, array in zip("ab", design.arrays, strict=True):
        cells = cells_of_export(export, camera, coated=True)
        np.testing.assert_allclose(cells.area, array.area, rtol=1e-9)
        assert cells.closed.all()
        walls = walls_of_export(export, camera)
        assert walls is not None
        row, column = np.nonzero(walls.real & (walls.across < len(array)))
        found = dict(
            zip(
                zip(row.tolist(), walls.across[row, column].tolist(), strict=True),
                walls.normal[row, column],
                strict=True,
            )
        )
        built = array.cells.surfaces.normal[len(array) + PLANES :]
        assert len(found) == len(built)
        for pair, normal in zip(array.cells.walls.tolist(), built, strict=True):
            np.testing.assert_allclose(found[tuple(pair)], -normal, atol=1e-9)


def test_areas_under_the_coat() -> None:
    design = pedestal_design("n=5", "coating_um=100")
    area = cells_of_export(exported(design), "a").area
    np.testing.assert_allclose(area, cell_areas(design.arrays[0].modelled_cells), rtol=1e-9)


@pytest.fixture(scope="module")
def shells(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pedestals")
    write_export(pedestal_design("n=3", "mesh.structure_error_mm=0.1"), folder, ["shell"])
    return folder


def failed(folder: Path) -> set[str]:
    return {check.name for check in verify(folder).checks if check.passed is False}


def test_a_shell_on_pedestals_is_verified(shells: Path) -> None:
    assert verify(shells).passed


@pytest.mark.slow
def test_another_groove_than_the_record_s_is_found(shells: Path) -> None:
    record = shells / "design.json"
    text = record.read_text()
    document = json.loads(text)
    document["spec"]["shell"]["groove_mm"] *= 1.01
    record.write_text(json.dumps(document))
    try:
        assert {"cell areas", "step cells", "step walls"} <= failed(shells)
    finally:
        record.write_text(text)


@pytest.mark.slow
def test_a_wall_with_the_name_of_another_is_found(shells: Path) -> None:
    step = shells / "shell_a.step"
    text = step.read_text()
    one, two = re.findall(r"'(a\d{4}_a\d{4})'", text)[:2]
    swapped = text.replace(f"'{one}'", "'?'").replace(f"'{two}'", f"'{one}'")
    step.write_text(swapped.replace("'?'", f"'{two}'"))
    try:
        assert "step walls" in failed(shells)
    finally:
        step.write_text(text)
