"""A shell whose mesh is the other's mirror image: known from that one as if it were measured."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tbcad_verify.mesh.rays import build_scene
from tbcad_verify.mesh.stl import Facets, read_facets
from tbcad_verify.printing.part_measures import PartMeasures, measure
from tbcad_verify.record.export import Export, read_export
from tbcad_verify.report.checks import require
from tbcad_verify.shell import light, pixels
from tbcad_verify.shell.measured_shell import (
    FLIP,
    ShellPart,
    flipped_measures,
    is_mirror_image,
    measure_shells,
)
from tbcad_verify.shell.optics import OpticalSetup, is_image_of_camera, set_up

from tests.verify.synthetic_export import Cells

Facing = tuple[Export, list[Facets]]


@pytest.fixture(scope="module")
def facing(synthetic_shells: tuple[Path, Cells]) -> Facing:
    """The record, and facets of both shells, of which the second is the first's mirror image."""
    record = read_export(synthetic_shells[0])
    one = read_facets(record.folder, record.parts[0].stl)[0]
    flip = FLIP.astype(np.float32)
    image = Facets(record.parts[1].stl, one.normals * flip, one.corners[:, ::-1] * flip)
    return record, [one, image]


@pytest.fixture(scope="module")
def known(facing: Facing) -> list[ShellPart]:
    return measure_shells(*facing)


@pytest.fixture(scope="module")
def measured(facing: Facing) -> ShellPart:
    """The second shell, measured: beside a first one that it is no mirror image of."""
    record, (_, image) = facing
    shells = measure_shells(record, [image, image])
    assert shells[1].image_of is None
    return shells[1]


def same(one: Any, other: Any) -> None:
    """Whether all figures agree; arrays within rounding."""
    if is_dataclass(one):
        for field in fields(one):
            same(getattr(one, field.name), getattr(other, field.name))
    elif isinstance(one, np.ndarray | float) or (one and isinstance(one, list)):
        if isinstance(one, list) and not isinstance(one[0], float):
            assert one == other
        else:
            # Blurs of planes are as large as numbers get.
            limited = [np.clip(value, -1e9, 1e9) for value in (one, other)]
            np.testing.assert_allclose(*limited, rtol=1e-6, atol=1e-8)
    else:
        assert one == other


def shell_measures(shell: ShellPart) -> PartMeasures:
    topology, mass = require(shell.topology, ""), require(shell.mass, "")
    return measure(require(shell.mesh, ""), topology.status, mass, shell.edges)


def test_a_flipped_mesh_has_the_measured_one_s_facets(
    known: list[ShellPart], measured: ShellPart
) -> None:
    flipped, mesh = require(known[1].mesh, ""), require(measured.mesh, "")
    # Vertices are numbered as they first occur, which reversed facets change.
    np.testing.assert_array_equal(flipped.points[flipped.faces], mesh.points[mesh.faces])
    np.testing.assert_array_equal(flipped.twin, mesh.twin)
    np.testing.assert_allclose(flipped.area, mesh.area, atol=1e-12)


@pytest.mark.parametrize("quantity", ["topology", "mass", "recovery", "checks"])
def test_a_mirror_image_is_known_as_if_measured(
    known: list[ShellPart], measured: ShellPart, quantity: str
) -> None:
    assert known[1].image_of is known[0].part
    same(getattr(known[1], quantity), getattr(measured, quantity))


def test_what_printers_need_is_known_as_if_measured(
    known: list[ShellPart], measured: ShellPart
) -> None:
    one, image = known
    flipped = flipped_measures(
        shell_measures(one), require(image.mesh, ""), require(image.mass, "")
    )
    again = shell_measures(measured)
    for name in ("status", "mass", "solids", "cavities", "inner_edges"):
        same(getattr(flipped, name), getattr(again, name))
    same(flipped.holes, again.holes)
    np.testing.assert_array_equal(flipped.hull.points, again.hull.points)
    assert flipped.walls.minimum == pytest.approx(again.walls.minimum, abs=1e-3)


def test_pixels_of_a_mirror_image_are_counted_as_if_traced(
    facing: Facing, known: list[ShellPart]
) -> None:
    def setup(second_is_image: bool) -> OpticalSetup:
        meshes = [require(shell.mesh, "") for shell in known]
        recoveries = [require(shell.recovery, "") for shell in known]
        first = build_scene(meshes[0]) if second_is_image else None
        return set_up(facing[0], meshes, recoveries, second_is_image, first)

    assert setup(True).symmetric
    assert not setup(False).symmetric
    by_image, traced = (light.total(pixels._tallies(setup(image))) for image in (True, False))
    for name in ("pixels", "blocked", "blockers", "on_mirrors"):
        np.testing.assert_array_equal(getattr(by_image, name), getattr(traced, name))
    np.testing.assert_allclose(by_image.nearest, traced.nearest, rtol=1e-9)


@pytest.mark.parametrize("kind", ["normals", "corners"])
def test_one_changed_bit_is_no_mirror_image(facing: Facing, kind: str) -> None:
    one, image = facing[1]
    assert is_mirror_image(one, image)
    values = getattr(image, kind).copy()
    values.flat[-1] = np.nextafter(values.flat[-1], np.float32(np.inf))
    assert not is_mirror_image(one, replace(image, **{kind: values}))
    assert not is_mirror_image(one, replace(image, corners=image.corners[:-1]))
    assert not is_mirror_image(one, one)


def test_cameras_that_differ_see_no_mirror_images(facing: Facing) -> None:
    a, b = (facing[0].cameras[key] for key in ("a", "b"))
    assert is_image_of_camera(b, a)
    for change in (
        {"pinhole": b.pinhole + 1e-12},
        {"forward": -b.forward},
        {"right": b.forward},
        {"width": b.width + 1},
        {"hfov_deg": b.hfov_deg + 1e-9},
    ):
        assert not is_image_of_camera(b.model_copy(update=change), a), change


def test_a_fault_of_the_second_shell_alone_is_found(facing: Facing) -> None:
    record, (one, image) = facing
    broken = replace(image, corners=image.corners.copy())
    broken.corners[0] = broken.corners[0, 0]
    shells = measure_shells(record, [one, broken])
    assert shells[1].image_of is None
    assert all(check.passed for check in shells[0].checks)
    assert not all(check.passed for check in shells[1].checks)
