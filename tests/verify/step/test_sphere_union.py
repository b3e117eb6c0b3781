"""The union of balls in closed form: against closed forms, samples, and tbcad's own record."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tbcad_verify.record.export import Camera, Export, read_export
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.step.sphere_union import bounds, cells_of_export, closed_form_cells
from tbcad_verify.types import Floats

from tbcad.core.mirrors.array import MirrorDesign, design
from tbcad.core.mirrors.record import COLUMNS, mirror_rows
from tbcad.core.optics.cells import cell_areas
from tbcad.core.spec.load import load_spec

NO_WALLS = np.zeros((0, 4))
PI = np.pi
UP = np.array([[0, 0, 1.0]])


def test_a_cap() -> None:
    """Of a ball of 2 mm about (0, 0, 1), cut off at half of its upper half."""
    it = closed_form_cells(
        np.array([[0, 0, 3.0]]), UP, np.array([0.5]), np.array([[0, 0, 5.0, 10]])
    )
    np.testing.assert_allclose(it.area, 4 * PI, rtol=1e-14)
    np.testing.assert_allclose(it.first, [[0, 0, 4 * PI * 2.5]], atol=1e-13)
    # x.n = radius + centre.n, and the cap's normals add up to its circle.
    np.testing.assert_allclose(it.volume, (2 * 4 * PI + 3 * PI) / 3, rtol=1e-14)


def test_an_octant() -> None:
    up = np.full((1, 3), 1 / np.sqrt(3))
    it = closed_form_cells(2 * up, up, np.array([0.5]), np.eye(3, 4))
    np.testing.assert_allclose(it.area, 2 * PI, rtol=1e-14)
    np.testing.assert_allclose(it.first, [[2 * PI] * 3], rtol=1e-14)
    np.testing.assert_allclose(it.volume, 4 / 3 * PI, rtol=1e-14)


def test_the_inside_of_a_box_of_planes() -> None:
    inward = -np.concatenate([np.eye(3), -np.eye(3)])
    half = np.array([1.0, 2, 3, 1, 2, 3])
    point = -inward * half[:, None] + np.array([5.0, 0, 0])
    it = closed_form_cells(point, inward, np.zeros(6), NO_WALLS)
    np.testing.assert_allclose(it.area, [24, 12, 8] * 2, rtol=1e-14)
    assert it.volume.sum() == pytest.approx(-48)


def test_nearly_flat_balls_become_planes() -> None:
    """Curvatures from 1e-3 to 1e-12: figures change as little as the shape does."""
    inward = -np.concatenate([np.eye(3), -np.eye(3)])
    flat = closed_form_cells(-inward, inward, np.zeros(6), NO_WALLS)
    for k in (1e-3, 1e-6, 1e-9, 1e-12):
        it = closed_form_cells(-inward, inward, np.full(6, k), NO_WALLS)
        np.testing.assert_allclose(it.area, flat.area, rtol=3 * k + 1e-14)
        np.testing.assert_allclose(it.first, flat.first, rtol=3 * k + 1e-14, atol=1e-13)


@pytest.mark.parametrize("seed", range(6))
def test_samples_on_fenced_balls(seed: int) -> None:
    """Balls of random sizes side by side, within four walls: integrals by random points."""
    rng, count, fence = np.random.default_rng(seed), 3 + 4 * seed, 1.0
    radius = rng.uniform(3.0, 4.0, count)
    apex = np.column_stack([rng.uniform(-0.9, 0.9, (count, 2)), rng.uniform(0, 0.1, count)])
    walls = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    it = closed_form_cells(
        apex, np.repeat(UP, count, axis=0), 1 / radius, np.column_stack([walls, [-fence] * 4])
    )
    centre = apex - radius[:, None] * UP
    x = np.column_stack([rng.uniform(-fence, fence, (400_000, 2)), np.zeros(400_000)])
    square = radius**2 - ((x[:, None, :2] - centre[:, :2]) ** 2).sum(axis=2)
    top = np.where(square > 0, centre[:, 2] + np.sqrt(np.maximum(square, 0)), -np.inf)
    own = top.argmax(axis=1)
    x[:, 2] = top.max(axis=1)
    n = (x - centre[own]) / radius[own, None]
    values = np.column_stack([np.ones(len(x)), x, (x * n).sum(axis=1) / 3])
    values *= 4 * fence**2 / n[:, 2:]  # of surface above each piece of the plane
    for k in range(count):
        mine = values * (own == k)[:, None]
        got = np.hstack([it.area[k], it.first[k], it.volume[k]])
        error = mine.std(axis=0) / np.sqrt(len(x))
        assert (np.abs(mine.mean(axis=0) - got) <= 4.5 * error + 1e-9).all()


def test_what_is_covered_has_no_area_and_of_two_alike_the_first_stays() -> None:
    walls = np.array([[1.0, 0, 0, -1], [-1, 0, 0, -1], [0, 1, 0, -1], [0, -1, 0, -1]])
    point = np.array([[0, 0, 0], [0, 0, 0], [0, 0, -0.5], [0.0, 0, 0]])
    it = closed_form_cells(point, np.repeat(UP, 4, axis=0), np.array([0.1, 0.1, 1, 0.1]), walls)
    assert np.flatnonzero(it.area).tolist() == [0]


def test_a_mirror_without_neighbours_is_open() -> None:
    for k in (0.0, 0.1):
        assert np.isnan(closed_form_cells(UP, UP, np.array([k]), NO_WALLS).area).all()


def test_what_comes_out_behind_the_neighbours_is_not_the_mirror() -> None:
    """Six small balls fence a large one; beyond them its front comes out again."""
    angle = np.arange(6) * PI / 3
    small = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * 4
    small[:, 2] = -0.4
    up = np.repeat(UP, 7, axis=0)
    point = np.vstack([np.zeros(3), small + 3 * up[1:]])
    it = closed_form_cells(point, up, 1 / np.array([20.0, *([3.0] * 6)]), NO_WALLS)
    assert 3 < it.area[0] < 20


def test_a_small_ball_makes_a_hole() -> None:
    up = np.repeat(UP, 2, axis=0)
    walls = np.array([[1.0, 0, 0, -3], [-1, 0, 0, -3], [0, 1, 0, -3], [0, -1, 0, -3]])
    k = np.array([0.1, 1.0])
    hole = closed_form_cells(np.array([[0, 0, 0], [1.0, 0, 0.2]]), up, k, walls)
    bare = closed_form_cells(np.array([[0, 0, 0.0]]), up[:1], k[:1], walls)
    d = np.hypot(1, 9.2)
    plane = (d * d + 100 - 1) / (2 * d)
    assert bare.area[0] - hole.area[0] == pytest.approx(20 * PI * (10 - plane), rel=1e-12)


LINES = {
    "n=4": ["n=4"],
    "n=6": ["n=6"],
    "n=18": ["n=18"],
    "flat": ["n=6", "mirrors.radius_rule=flat", "optics.capture_diameter_mm=14"],
    "coat": ["n=6", "mirrors.coating_um=150"],
}


@cache
def made(name: str) -> MirrorDesign:
    return design(load_spec(None, LINES[name]))


def as_export(it: MirrorDesign) -> Export:
    """What a reader of this design's files would hand on."""
    sample = read_export(Path(__file__).parents[3] / "docs" / "sample")
    table = [row for array in it.arrays for row in mirror_rows(array)]
    views = {array.camera_id: array.camera.pinhole for array in it.arrays}
    cameras: dict[str, Camera] = {
        key: sample.cameras[key].model_copy(update={"pinhole": pinhole})
        for key, pinhole in views.items()
    }
    return replace(
        sample,
        mirrors=Mirrors.model_validate({key: [row[key] for row in table] for key in COLUMNS}),
        cameras=cameras,
        foot_z_mm=it.arrays[0].foot,
        coating_mm=it.spec.mirrors.coating_um / 1000,
    )


def recorded(export: Export, camera: str) -> Floats:
    return export.mirrors.cell_area_mm2[export.mirrors.camera == camera]


@pytest.mark.parametrize("name", list(LINES))
@pytest.mark.parametrize("camera", ["a", "b"])
def test_area_as_recorded(name: str, camera: str) -> None:
    export = as_export(made(name))
    it = cells_of_export(export, camera, coated=True)
    np.testing.assert_allclose(it.area, recorded(export, camera), rtol=1e-11)


def test_area_under_the_coat() -> None:
    """The record's area is the reflecting surface's, not the solid's."""
    it = made("coat")
    bare = cells_of_export(as_export(it), "a")
    np.testing.assert_allclose(bare.area, cell_areas(it.arrays[0].modelled_cells), rtol=1e-11)
    assert np.abs(bare.area / it.arrays[0].area - 1).max() > 1e-3


def test_the_halves_mirror_each_other() -> None:
    """Camera b's cells are camera a's, reflected: as they are by themselves."""
    export = as_export(made("n=6"))
    taken, rows = cells_of_export(export, "b"), export.mirrors
    light = rows.surfaces().take(np.flatnonzero(rows.camera == "b"))
    walls = bounds(-1.0, export.foot_z_mm)
    own = closed_form_cells(light.point.T, light.normal.T, light.curvature, walls)
    for name in ("area", "first", "volume"):
        np.testing.assert_allclose(getattr(taken, name), getattr(own, name), rtol=1e-9, atol=1e-9)
