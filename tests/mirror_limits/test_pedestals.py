"""Limits of mirrors on pedestals: each depends on its own mirror alone, and its walls have one."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from OCP.BRepAdaptor import BRepAdaptor_Surface

from tbcad.app.api import order
from tbcad.cad.formats.step import StepError, read_named_solid
from tbcad.cad.formats.step_tolerances import (
    check_read_back,
    read_tolerances,
    write_tolerances,
)
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.pedestals.cells import groove_walls
from tbcad.light.simulate.scene.reflector import ExportedDesign, read_export
from tbcad.mirror_limits.order import (
    dowel_face,
    found_limits,
    halves,
    minimum_at_limits,
    tolerances,
)
from tbcad.mirror_limits.sensitivity import MirrorLimits, Sensitivities, sensitivities
from tbcad.shell.files import wall_names
from tests.exported_files import read_csv
from tests.pedestal_designs import pedestal_design
from tests.shell_meshes import export_with_solids

TARGET = 60.0


@pytest.fixture(scope="module")
def made() -> MirrorDesign:
    return pedestal_design("n=6")


@pytest.fixture(scope="module")
def folder(made: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_with_solids(tmp_path_factory.mktemp("shells"), made)


@pytest.fixture(scope="module")
def export(folder: Path) -> ExportedDesign:
    return read_export(folder)


@pytest.fixture(scope="module")
def found(export: ExportedDesign) -> tuple[Sensitivities, MirrorLimits]:
    return found_limits(export, 0.99)


def test_each_virtual_camera_depends_on_its_own_mirrors_alone(export: ExportedDesign) -> None:
    a = export.reflectors[0]
    one = sensitivities(export.reflectors)
    of_camera = np.bincount(one.camera)
    halved = a.mirrors.apex[:, 0] == 0
    assert of_camera[: len(a)].tolist() == np.where(halved, 2, 1).tolist()
    assert one.loss.shape[1] == 4
    assert (one.loss[:, 3] > 0).mean() > 0.8  # others have more coverage than they need


def test_all_mirrors_at_their_limits_are_good(
    export: ExportedDesign, found: tuple[Sensitivities, MirrorLimits]
) -> None:
    """So is one kind alone at five times its limit, a part of five; they are not far too small."""
    each = found[1].each
    assert minimum_at_limits(export, found[1], builds=200) >= TARGET
    assert minimum_at_limits(export, replace(found[1], each=4 * each)) < TARGET
    for kind in np.eye(4)[[0, 3]]:
        assert minimum_at_limits(export, replace(found[1], each=5 * each * kind)) >= TARGET - 1e-3
        assert minimum_at_limits(export, replace(found[1], each=8 * each * kind)) < TARGET


@pytest.mark.slow
def test_files_name_walls_and_their_limits(
    folder: Path, made: MirrorDesign, tmp_path: Path
) -> None:
    order(folder, process="diamond", out=tmp_path / "out")
    rows = read_csv(tmp_path / "out" / "inspection_b.csv")
    record = json.loads((tmp_path / "out" / "order.json").read_text(encoding="utf-8"))
    smallest = record["limits"]["smallest"]
    assert min(float(row["wall_limit_um"]) for row in rows) >= smallest["wall_um"] > 0
    assert record["simulated_minimum_mm"] >= TARGET
    read = read_tolerances(tmp_path / "out" / "shell_b_tolerances.step")
    profiles = [(one, frame) for one, frame in read if one.kind == "profile"]
    zones = [one for one, _ in profiles if "_" in one.faces[0]]
    assert len(profiles) - len(zones) == len(rows)
    assert all(frame == ("A", "B", "C") for _, frame in profiles)
    assert sum(len(one.faces) for one in zones) == len(groove_walls(made.arrays[1].cells))
    widths = sorted(one.value for one in zones)
    asked = sorted(2e-3 * float(row["wall_limit_um"]) for row in rows)
    assert widths == pytest.approx(asked, abs=1e-9)
    assert "walls of grooves" in (tmp_path / "out" / "shell_b_tolerances.step").read_text("ascii")


def test_a_solid_that_is_read_has_each_face_by_its_name(folder: Path, made: MirrorDesign) -> None:
    """The kernel reads faces in another order than the file has them."""
    array = made.arrays[1]
    solid = read_named_solid(folder / "shell_b.step")
    on = {name: BRepAdaptor_Surface(face) for name, face in solid.faces}
    centre = np.array([on[name].Sphere().Location().Coord() for name in array.ids])
    assert np.abs(centre - array.modelled_cells.mirror_surfaces.centre).max() < 1e-9
    walls = groove_walls(array.modelled_cells)
    names = wall_names(array.ids, array.modelled_cells)
    for name, point, normal in zip(names, walls.point, walls.normal, strict=True):
        plane = on[name].Plane()
        assert np.linalg.norm(np.cross(plane.Axis().Direction().Coord(), normal)) < 1e-9
        assert abs((point - plane.Location().Coord()) @ normal) < 1e-8


def test_tolerances_that_are_not_as_given_are_refused(
    folder: Path, export: ExportedDesign, found: tuple[Sensitivities, MirrorLimits], tmp_path: Path
) -> None:
    half = halves(export, found[1], found[1].each)[0]
    solid = read_named_solid(folder / "shell_a.step")
    given, file = tolerances(half, dowel_face(solid, half.dowel_mm)), tmp_path / "toleranced.step"
    write_tolerances(file, solid, given)
    check_read_back(file, given)
    first, second = [one for one in given.each if one.kind == "profile"][-2:]
    radius = given.each[-1]
    swapped = (
        replace(first, faces=(*first.faces[1:], second.faces[0])),
        replace(second, faces=(first.faces[0], *second.faces[1:])),
    )
    rest = [one for one in given.each if one not in (first, second)]
    for changed, message in (
        ((*rest, replace(first, value=first.value / 2), second), "read otherwise"),
        ((*given.each[:-1], replace(radius, radius=radius.radius + 1)), "read otherwise"),
        ((*rest, *swapped), "are not those"),
        (rest, "are not those"),
    ):
        with pytest.raises(StepError, match=message):
            check_read_back(file, replace(given, each=changed))
    with pytest.raises(StepError, match="profile of a0001 is read otherwise"):
        check_read_back(file, replace(given, datums=dict(reversed(given.datums.items()))))
