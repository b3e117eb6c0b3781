"""Wall and holes measured on a mesh: a built shell, and the same with other corners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tbcad_verify.mesh.holes import RoundHoles, round_holes
from tbcad_verify.mesh.mesh import Mesh, indexed_mesh
from tbcad_verify.mesh.segments import measure_edges
from tbcad_verify.mesh.spheroids import growth
from tbcad_verify.mesh.vectors import unit
from tbcad_verify.record.export import Export
from tbcad_verify.shell.mesh_casing import (
    MeshCasing,
    casing_checks,
    casing_names,
    find_valleys,
    measure_casing,
)
from tbcad_verify.shell.optics import OpticalSetup

from tests.verify.optical_setups import meshes_of, setup_of_meshes


@pytest.fixture(scope="module")
def meshes(sample: Export) -> list[Mesh]:
    return meshes_of(sample)


@pytest.fixture(scope="module")
def setup(sample: Export, meshes: list[Mesh]) -> OpticalSetup:
    return setup_of_meshes(sample, meshes)


@pytest.fixture(scope="module")
def holes(sample: Export, meshes: list[Mesh]) -> dict[str, RoundHoles]:
    return {
        part.name: round_holes(mesh, measure_edges(mesh))
        for part, mesh in zip(sample.parts, meshes, strict=True)
    }


def test_the_sample_is_as_designed(setup: OpticalSetup, holes: dict[str, RoundHoles]) -> None:
    found = casing_checks(setup, holes)
    assert [(one.name, one.file, one.unit) for one in found] == casing_names(setup.export)
    assert [one.passed for one in found] == [True] * 4
    assert [one.name for one in found] == ["mesh wall", "mesh holes"] * 2
    # Of a limit of 0.001 mm.
    assert max(one.measured or 0 for one in found) < 1e-4


def test_the_wall_between_spheres_and_spheroids() -> None:
    sphere = MeshCasing(np.array([100.0, 100.0]), 2.0, 5.0, (4.5, 5.25))
    assert sphere.walls() == pytest.approx([3.0, 2.5, 3.25], abs=1e-12)
    # Parallel planes touch two convex bodies where they are nearest: support functions.
    angle = np.linspace(0, np.pi / 2, 100_001)
    support = [np.hypot((140 + by) * np.cos(angle), (100 + by) * np.sin(angle)) for by in (2, 9)]
    long = MeshCasing(np.array([140.0, 100.0]), 2.0, 9.0, (9.0, 9.0))
    assert long.walls()[0] == pytest.approx((support[1] - support[0]).min(), abs=1e-6)


@pytest.mark.parametrize("by", [-1.1e-2, 1.1e-2])
def test_another_wall_is_a_fault(
    setup: OpticalSetup, holes: dict[str, RoundHoles], by: float
) -> None:
    spec = setup.export.spec
    shell = spec.shell.model_copy(update={"wall_mm": spec.shell.wall_mm + by})
    other = replace(setup.export, spec=spec.model_copy(update={"shell": shell}))
    walls = [
        one for one in casing_checks(replace(setup, export=other), holes) if "wall" in one.name
    ]
    assert [one.passed for one in walls] == [False] * 2
    assert walls[0].measured == pytest.approx(abs(by), abs=1e-4)
    assert "the wall is 3.000 mm" in walls[0].detail


def test_a_dent_behind_a_valley_is_found_in_its_half_alone(
    sample: Export, meshes: list[Mesh], setup: OpticalSetup, holes: dict[str, RoundHoles]
) -> None:
    camera = sample.cameras["a"].pinhole
    normal = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)  # of the ellipsoid, across its axis
    points = meshes[0].points.copy()
    middle = camera / 2 + (sample.semi_minor_mm + measure_casing(setup, 0).beyond) * normal
    dent = np.linalg.norm(points - middle, axis=1) < 15
    points[dent & ((points - camera / 2) @ normal > sample.semi_minor_mm)] -= 0.1 * normal
    dented = setup_of_meshes(sample, [indexed_mesh(points, meshes[0].faces), meshes[1]])
    found = casing_checks(dented, holes)
    assert [one.passed for one in found] == [False, True, True, True]
    assert found[0].measured == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize("by", [-2.0, 2.0])
def test_a_wall_moved_where_no_valley_is_before_it_is_found(
    sample: Export, setup: OpticalSetup, holes: dict[str, RoundHoles], by: float
) -> None:
    """Free corners of the coarse back, one by one."""
    mesh, casing, camera = setup.mesh, measure_casing(setup, 0), sample.cameras["a"]
    points, flange = mesh.points, sample.spec.shell.seam_flange.thickness_mm
    on_back = np.abs(growth(casing.semi_axes, camera, points.T) - casing.beyond) < 1e-3
    free = on_back & (points[:, 0] > flange) & (points[:, 2] > sample.foot_z_mm + 2 * flange)
    outward = unit(points.T - camera.pinhole[:, None] / 2).T
    assert np.count_nonzero(free) > 20
    for corner in np.flatnonzero(free)[::5].tolist():
        moved = points + by * outward * (np.arange(len(points)) == corner)[:, None]
        found = casing_checks(replace(setup, mesh=replace(mesh, points=moved)), holes)
        assert found[0].passed is False


def test_a_facet_for_many_is_too_far_from_the_back(
    sample: Export, meshes: list[Mesh], setup: OpticalSetup, holes: dict[str, RoundHoles]
) -> None:
    finer = sample.spec.mesh.model_copy(update={"structure_error_mm": 0.01, "chord_error_mm": 0.01})
    other = replace(sample, spec=sample.spec.model_copy(update={"mesh": finer}))
    found = casing_checks(replace(setup, export=other), holes)
    assert [one.passed for one in found] == [False, True] * 2


def test_holes_elsewhere_are_faults(setup: OpticalSetup, holes: dict[str, RoundHoles]) -> None:
    right = holes["shell_a"]
    moved = right.middle + np.array([[0], [0.01], [0]])
    wrong = {**holes, "shell_a": replace(right, middle=moved)}
    found = {(one.file, one.name): one.passed for one in casing_checks(setup, wrong)}
    assert found["shell_a.stl", "mesh holes"] is False
    assert found["shell_b.stl", "mesh holes"] is True
    exchanged = {"shell_a": holes["shell_b"], "shell_b": right}
    assert [one.passed for one in casing_checks(setup, exchanged)] == [True, False] * 2


def test_without_holes_or_mirrors_it_is_unknown(
    setup: OpticalSetup, holes: dict[str, RoundHoles]
) -> None:
    some = {"shell_b": holes["shell_b"]}
    assert [one.passed for one in casing_checks(setup, some)] == [None, None, True, True]
    no_mirrors = replace(setup.match, segment=np.full_like(setup.match.segment, -1))
    found = casing_checks(replace(setup, match=no_mirrors), holes)
    assert [one.passed for one in found] == [None] * 4
    assert "no ray from a valley" in found[0].detail


@pytest.mark.parametrize("number", [0, 1])
def test_valleys_are_corners_of_mirrors_with_each_other_or_joining_faces(
    setup: OpticalSetup, number: int
) -> None:
    """The sample's mirrors are planes."""
    mirrors = setup.export.mirrors
    mine = mirrors.camera == setup.export.parts[number].camera
    apex, normal = (mirrors.columns(key, 3)[:, mine] for key in ("px", "nx"))
    valleys = find_valleys(setup, number)
    height = np.abs(normal.T @ valleys.point - (normal * apex).sum(axis=0)[:, None])
    low = valleys.point[2] - setup.export.foot_z_mm
    planes = np.abs([valleys.point[0], low]) < 1e-4
    mirrors_at, joining = (height < 1e-4).sum(axis=0), planes.any(axis=0)
    assert (mirrors_at >= 1).all()
    assert (mirrors_at + planes.sum(axis=0) >= 3).all()
    assert (valleys.inner == ~joining).all()
    assert joining.any()
