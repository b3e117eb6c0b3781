"""The union of balls in closed form: against closed forms, samples, and tbcad's own record."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad
from tbcad_verify.record.export import Camera, Export, read_export
from tbcad_verify.record.mirrors import Mirrors
from tbcad_verify.step.sphere_union import (
    ClosedFormCells,
    _mirrors_and_bounds,
    cells_of_balls,
    cells_of_export,
    closed_form_cells,
)
from tbcad_verify.types import Floats

from tbcad.mirrors.array import MirrorDesign, design
from tbcad.mirrors.record import COLUMNS, mirror_rows
from tbcad.optics.cells import cell_areas
from tbcad.spec.load import load_spec

SAMPLE = Path(__file__).parents[3] / "docs" / "sample"
NO_WALLS = np.zeros((0, 4))
PI = np.pi


def balls(*spheres: tuple[float, float, float, float], walls: Floats = NO_WALLS) -> ClosedFormCells:
    table = np.array(spheres)
    return cells_of_balls(table[:, :3], table[:, 3], walls)


def planes(normal: Floats, point: Floats, walls: Floats = NO_WALLS) -> ClosedFormCells:
    return closed_form_cells(point, normal, np.zeros(len(point)), walls)


# Closed forms


def test_one_ball_is_whole() -> None:
    it = balls((1, 2, 3, 2))
    assert it.area == pytest.approx(16 * PI)
    assert it.volume == pytest.approx(32 / 3 * PI)
    np.testing.assert_allclose(it.vector_area, 0, atol=1e-12)
    np.testing.assert_allclose(it.first, it.area[:, None] * [[1, 2, 3]])
    assert (it.corners, it.edges, it.empty, it.closed) == (0, 0, False, True)


def test_a_hemisphere() -> None:
    it = balls((0, 0, 0, 2), walls=np.array([[0, 0, 5.0, 0]]))
    np.testing.assert_allclose(it.area, 8 * PI, rtol=1e-14)
    np.testing.assert_allclose(it.vector_area, [[0, 0, 4 * PI]], atol=1e-13)
    np.testing.assert_allclose(it.first, [[0, 0, 8 * PI]], atol=1e-13)
    np.testing.assert_allclose(it.volume, 16 / 3 * PI, rtol=1e-14)
    assert (it.corners, it.edges, it.closed) == (0, 1, True)


def test_a_cap_that_holds_one_pole_only() -> None:
    it = balls((0, 0, 0, 1), walls=np.array([[3.0, 0, 4, 3.5]]))
    np.testing.assert_allclose(it.area, 0.6 * PI, rtol=1e-13)


def test_an_octant() -> None:
    it = balls((0, 0, 0, 2), walls=np.eye(3, 4))
    np.testing.assert_allclose(it.area, 2 * PI, rtol=1e-14)
    np.testing.assert_allclose(it.vector_area, [[PI, PI, PI]], rtol=1e-14)
    np.testing.assert_allclose(it.first, [[2 * PI] * 3], rtol=1e-14)
    np.testing.assert_allclose(it.volume, 4 / 3 * PI, rtol=1e-14)
    assert (it.corners, it.edges, it.closed) == (3, 3, True)


def lens(r: float, s: float, d: float) -> float:
    """Volume that two balls share. Source: Weisstein, Sphere-Sphere Intersection, eq. 16."""
    inner = d * d + 2 * d * (r + s) - 3 * (r - s) ** 2
    return PI * (r + s - d) ** 2 * inner / (12 * d)


@pytest.mark.parametrize(("r", "s"), [(1.0, 0.7), (1.0, 1.0), (67.0, 6.8), (3000.0, 40.0)])
def test_two_balls(r: float, s: float) -> None:
    way = np.array([0.6, 0, 0.8])
    d = max(r, s) - 0.3 * min(r, s)
    it = balls((0, 0, 0, r), (*(way * d), s))
    plane = (d * d + r * r - s * s) / (2 * d)
    np.testing.assert_allclose(
        it.area, [2 * PI * r * (r + plane), 2 * PI * s * (s + d - plane)], rtol=1e-10
    )
    flat = PI * (r * r - plane * plane)
    np.testing.assert_allclose(it.vector_area, flat * np.array([-way, way]), atol=1e-12 * r * r)
    assert it.volume.sum() == pytest.approx(4 / 3 * PI * (r**3 + s**3) - lens(r, s, d), rel=1e-12)
    assert it.corners.tolist() == [0, 0]
    assert it.edges.tolist() == [1, 1]
    assert it.closed.all()


def shared_by_three(r: float, d: float) -> float:
    """Volume that three balls, d apart from each other, share: discs, slice by slice."""

    def piece(z: float) -> float:
        rho = np.sqrt(r * r - z * z)
        c = np.sqrt(3) * (np.sqrt(rho**2 - d * d / 4) - d / np.sqrt(12))
        segment = rho**2 * np.arcsin(c / (2 * rho)) - c / 4 * np.sqrt(4 * rho**2 - c * c)
        return float(np.sqrt(3) / 4 * c * c + 3 * segment)

    return 2 * quad(piece, 0, np.sqrt(r * r - d * d / 3), epsabs=1e-13)[0]


def test_three_equal_balls() -> None:
    angle = np.arange(3) * 2 * PI / 3
    d = np.sqrt(3) * 0.5
    it = balls(*((0.5 * np.cos(a), 0.5 * np.sin(a), 0.0, 1.0) for a in angle.tolist()))
    volume = 3 * 4 / 3 * PI - 3 * lens(1, 1, d) + shared_by_three(1, d)
    assert it.volume.sum() == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(it.area, it.area[0], rtol=1e-13)
    np.testing.assert_allclose(it.vector_area.sum(axis=0), 0, atol=1e-13)
    assert it.corners.tolist() == it.edges.tolist() == [2, 2, 2]


def test_four_cells_meet_in_one_corner() -> None:
    it = balls(*((x, y, 0.0, 1.0) for x in (-0.4, 0.4) for y in (-0.4, 0.4)))
    assert it.corners.tolist() == it.edges.tolist() == [2, 2, 2, 2]
    assert it.closed.all()
    ends = np.abs(it.rim.points[:, [0, 2]]).reshape(-1, 3)
    away = np.linalg.norm(ends - [0, 0, np.sqrt(0.68)], axis=1)
    assert (away < 1e-12).sum() == 16


def test_the_inside_of_a_box_of_planes() -> None:
    inward = -np.concatenate([np.eye(3), -np.eye(3)])
    half = np.array([1.0, 2, 3, 1, 2, 3])
    it = planes(inward, -inward * half[:, None] + np.array([5.0, 0, 0]))
    np.testing.assert_allclose(it.area, [24, 12, 8] * 2, rtol=1e-14)
    assert it.volume.sum() == pytest.approx(-48)
    assert it.corners.tolist() == [4] * 6
    assert it.closed.all()


def test_a_plane_round_a_ball() -> None:
    sides = np.array([[1.0, 0, 0, -2], [-1, 0, 0, -2], [0, 1, 0, -2], [0, -1, 0, -2]])
    up = np.array([[0, 0, 1.0], [0, 0, 1]])
    it = closed_form_cells(
        np.array([[0.5, 0, 0], [0.5, 0, 1.5]]), up, np.array([0, 1.0]), sides, front=False
    )
    np.testing.assert_allclose(it.area, [16 - 0.75 * PI, 3 * PI], rtol=1e-13)
    np.testing.assert_allclose(it.vector_area[:, 2], [16 - 0.75 * PI, 0.75 * PI], rtol=1e-13)
    assert it.volume.sum() == pytest.approx(PI / 3 * 1.5**2 * 1.5, rel=1e-13)
    assert it.corners.tolist() == [4, 0]
    assert it.edges.tolist() == [5, 1]
    assert it.closed.all()


def test_nearly_flat_balls_become_planes() -> None:
    """Curvatures from 1e-3 to 1e-12: figures change as little as the shape does."""
    inward = -np.concatenate([np.eye(3), -np.eye(3)])
    flat = planes(inward, -inward)
    for k in (1e-3, 1e-6, 1e-9, 1e-12):
        it = closed_form_cells(-inward, inward, np.full(6, k), NO_WALLS)
        np.testing.assert_allclose(it.area, flat.area, rtol=3 * k + 1e-14)
        np.testing.assert_allclose(it.first, flat.first, rtol=3 * k + 1e-14, atol=1e-13)
        assert it.closed.all()


# Samples on the balls


def random_balls(seed: int, count: int) -> Floats:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.normal(size=(count, 3)), rng.uniform(0.3, 1.4, count)])


def uncovered(table: Floats, walls: Floats, x: Floats, own: int | None) -> NDArray[np.bool_]:
    """(N,) points in no ball but their own, on the right side of the walls; one at a time."""
    out = np.ones(len(x), dtype=bool)
    for k, ball in enumerate(table):
        if k != own:
            out &= ((x - ball[:3]) ** 2).sum(axis=1) > ball[3] ** 2
    for wall in walls:
        out &= x @ wall[:3] > wall[3]
    return out


@pytest.mark.parametrize("seed", range(6))
def test_samples_on_the_balls(seed: int) -> None:
    table = random_balls(seed, 2 + 4 * seed)
    walls = np.array([[1.0, 0, 0, -0.6], [0.0, 0.6, 0.8, -0.7]])[: seed % 3]
    it = cells_of_balls(table[:, :3], table[:, 3], walls)
    rng, count = np.random.default_rng(99), 40_000
    for k, ball in enumerate(table):
        n = rng.normal(size=(count, 3))
        n /= np.linalg.norm(n, axis=1)[:, None]
        x = ball[:3] + ball[3] * n
        free = uncovered(table, walls, x, k)
        height = (x * n).sum(axis=1)[:, None]
        values = np.hstack([np.ones((count, 1)), n, x, height / 3])
        values = values * free[:, None] * 4 * PI * ball[3] ** 2
        got = np.hstack([it.area[k], it.vector_area[k], it.first[k], it.volume[k]])
        error = values.std(axis=0) / np.sqrt(count)
        assert (np.abs(values.mean(axis=0) - got) <= 4.5 * error + 1e-9).all()
        assert not (it.empty[k] and free.any())
    assert it.closed.all()


@pytest.mark.parametrize("seed", range(6))
def test_volume_of_a_union(seed: int) -> None:
    table = random_balls(seed + 50, 2 + 3 * seed)
    it = cells_of_balls(table[:, :3], table[:, 3], NO_WALLS)
    low, high = (table[:, :3] - table[:, 3:]).min(axis=0), (table[:, :3] + table[:, 3:]).max(axis=0)
    x = np.random.default_rng(7).uniform(low, high, (200_000, 3))
    held = ~uncovered(table, NO_WALLS, x, None) * np.prod(high - low)
    assert abs(held.mean() - it.volume.sum()) <= 4.5 * held.std() / np.sqrt(len(x))
    np.testing.assert_allclose(it.vector_area.sum(axis=0), 0, atol=1e-11)


# Properties


def turn(rng: np.random.Generator) -> Floats:
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.asarray(q * np.sign(np.linalg.det(q)))


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 14), scale=st.floats(1e-3, 1e4))
def test_motions_scale_and_order(seed: int, count: int, scale: float) -> None:
    table = random_balls(seed, count)
    rng = np.random.default_rng(seed + 1)
    q, shift, order = turn(rng), rng.normal(size=3), rng.permutation(count)
    wall = np.array([[*rng.normal(size=3), -0.5]])
    one = cells_of_balls(table[:, :3], table[:, 3], wall)
    moved = np.hstack([wall[:, :3] @ q.T, wall[:, 3:] + wall[:, :3] @ q.T @ shift])
    moved[:, 3] *= scale
    centre = scale * (table[order, :3] @ q.T + shift)
    two = cells_of_balls(centre, scale * table[order, 3], moved)
    close = {"rtol": 1e-8, "atol": 1e-8}
    np.testing.assert_allclose(two.area / scale**2, one.area[order], **close)
    np.testing.assert_allclose(two.vector_area / scale**2, one.vector_area[order] @ q.T, **close)
    first = one.first[order] @ q.T + one.area[order, None] * shift
    np.testing.assert_allclose(two.first / scale**3, first, **close)
    volume = one.volume[order] + one.vector_area[order] @ q.T @ shift / 3
    np.testing.assert_allclose(two.volume / scale**3, volume, **close)
    np.testing.assert_array_equal(two.empty, one.empty[order])
    np.testing.assert_array_equal(two.corners, one.corners[order])
    np.testing.assert_array_equal(two.closed, one.closed[order])


@pytest.mark.parametrize("seed", range(10))
def test_what_is_enclosed_moves_along(seed: int) -> None:
    """The volume of a union stays as it is moved; every integral takes part in that."""
    table = random_balls(seed, 12)
    shift = np.array([7.0, -5, 3])
    one = cells_of_balls(table[:, :3], table[:, 3], NO_WALLS)
    two = cells_of_balls(table[:, :3] + shift, table[:, 3], NO_WALLS)
    assert two.volume.sum() == pytest.approx(one.volume.sum(), rel=1e-12)


# What is said rather than raised


def test_a_ball_within_another_is_empty() -> None:
    it = balls((0, 0, 0, 2), (0.5, 0, 0, 1))
    assert it.empty.tolist() == [False, True]
    np.testing.assert_allclose(it.area, [16 * PI, 0])


def test_of_a_ball_recorded_twice_the_first_stays() -> None:
    it = balls((0, 0, 0, 1), (0, 0, 0, 1), (1, 0, 0, 1), (1, 0, 0, 1))
    assert it.empty.tolist() == [False, True, False, True]
    assert it.volume.sum() == pytest.approx(8 / 3 * PI - lens(1, 1, 1))


def test_no_mirror_at_all() -> None:
    none = np.zeros((0, 3))
    assert len(closed_form_cells(none, none, np.zeros(0), np.eye(3, 4))) == 0


def test_two_balls_that_cover_a_third_together() -> None:
    it = balls((-1, 0, 0, 1.2), (1, 0, 0, 1.2), (0, 0, 0, 0.5), (0, 0, 0, 0.6))
    assert it.empty.tolist() == [False, False, True, True]


def test_a_mirror_without_neighbours_is_open() -> None:
    up = np.array([[0, 0, 1.0]])
    for k in (0.0, 0.1):
        it = closed_form_cells(up, up, np.array([k]), NO_WALLS)
        assert (it.closed, it.empty) == (False, False)


def test_what_comes_out_behind_the_neighbours_is_not_the_mirror() -> None:
    """Six small balls fence a large one; beyond them its front comes out again."""
    angle = np.arange(6) * PI / 3
    small = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * 4
    small[:, 2] = -0.4
    up = np.tile([0, 0, 1.0], (7, 1))
    point = np.vstack([np.zeros(3), small + 3 * up[1:]])
    k = 1 / np.array([20.0, *([3.0] * 6)])
    front, all_ = (
        closed_form_cells(point, up, k, NO_WALLS),
        closed_form_cells(point, up, k, NO_WALLS, front=False),
    )
    assert front.closed[0]
    assert all_.area[0] > 1000
    assert front.area[0] < 20
    assert front.corners[0] == 6
    assert (np.abs(front.rim.points[front.rim.mirror == 0]) < 3).all()


def test_a_small_ball_makes_a_hole() -> None:
    up = np.array([[0, 0, 1.0], [0, 0, 1]])
    walls = np.array([[1.0, 0, 0, -3], [-1, 0, 0, -3], [0, 1, 0, -3], [0, -1, 0, -3]])
    k = np.array([0.1, 1.0])
    hole = closed_form_cells(np.array([[0, 0, 0], [1.0, 0, 0.2]]), up, k, walls)
    bare = closed_form_cells(np.array([[0, 0, 0.0]]), up[:1], k[:1], walls)
    assert (hole.corners[0], hole.edges[0], hole.closed[0]) == (4, 5, True)
    d = np.hypot(1, 9.2)
    plane = (d * d + 100 - 1) / (2 * d)
    assert bare.area[0] - hole.area[0] == pytest.approx(20 * PI * (10 - plane), rel=1e-12)


# Real designs

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
    sample = read_export(SAMPLE)
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


def spheres(export: Export) -> tuple[Floats, Floats]:
    """Centres and radii of camera a's mirrors."""
    mine = export.mirrors.camera == "a"
    return export.mirrors.columns("cx", 3).T[mine], export.mirrors.radius_mm[mine]


@pytest.mark.parametrize("name", list(LINES))
@pytest.mark.parametrize("camera", ["a", "b"])
def test_area_as_recorded(name: str, camera: str) -> None:
    export = as_export(made(name))
    it = cells_of_export(export, camera, coated=True)
    np.testing.assert_allclose(it.area, recorded(export, camera), rtol=1e-11)
    assert it.closed.all()
    assert not it.empty.any()


def test_area_as_recorded_in_the_sample() -> None:
    export = read_export(SAMPLE)
    for camera in ("a", "b"):
        area = cells_of_export(export, camera).area
        np.testing.assert_allclose(area, recorded(export, camera), rtol=1e-11)


def test_area_under_the_coat() -> None:
    """The record's area is the reflecting surface's, not the solid's."""
    it = made("coat")
    bare = cells_of_export(as_export(it), "a")
    np.testing.assert_allclose(bare.area, cell_areas(it.arrays[0].modelled_cells), rtol=1e-11)
    assert np.abs(bare.area / it.arrays[0].area - 1).max() > 1e-3


def test_the_halves_mirror_each_other() -> None:
    """Camera b's cells are camera a's, reflected: as they are by themselves."""
    export = as_export(made("n=18"))
    a, taken = (cells_of_export(export, camera) for camera in "ab")
    light, walls = _mirrors_and_bounds(export, "b")
    b = closed_form_cells(light.point.T, light.normal.T, light.curvature, walls)
    for name in ("area", "vector_area", "first", "volume", "corners", "edges", "closed"):
        np.testing.assert_allclose(getattr(taken, name), getattr(b, name), rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(taken.rim.other, b.rim.other)
    np.testing.assert_allclose(taken.rim.points.mean(axis=1), b.rim.points.mean(axis=1), atol=1e-9)
    flip = np.array([-1.0, 1, 1])
    np.testing.assert_allclose(a.area, b.area, rtol=1e-12)
    np.testing.assert_allclose(a.vector_area, b.vector_area * flip, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(a.first, b.first * flip, rtol=1e-9, atol=1e-7)


@pytest.mark.parametrize("name", ["n=4", "n=6", "n=18"])
def test_euler(name: str) -> None:
    """All cells together are a disc: each edge that is not on a wall is there twice."""
    it = cells_of_export(as_export(made(name)), "a")
    count = len(it)
    inner = it.rim.other < count
    pair = np.sort(np.stack([it.rim.mirror, it.rim.other])[:, inner], axis=0)
    assert (np.unique(pair, axis=1, return_counts=True)[1] == 2).all()
    edges = inner.sum() // 2 + (~inner).sum()
    ends = np.round(it.rim.points[:, [0, 2]].reshape(-1, 3), 6) + 0.0
    assert len(np.unique(ends, axis=0)) - edges + count == 1


def gauss_bonnet(it: ClosedFormCells, centre: Floats, radius: Floats) -> Floats:
    """(M,) areas of cells with one loop each: r^2 (2 pi - all turning along the boundary)."""
    turning = np.full(len(it), 2 * PI)
    own = it.rim.mirror
    a, b, c = np.moveaxis(it.rim.points, 1, 0)
    axis = np.cross(b - a, c - b)
    square = (axis**2).sum(axis=1)[:, None]
    u, v = a - b, c - b
    middle = b + np.cross(
        (u**2).sum(axis=1)[:, None] * v - (v**2).sum(axis=1)[:, None] * u, np.cross(u, v)
    ) / (2 * square)
    axis /= np.sqrt(square)
    wide = np.linalg.norm(a - middle, axis=1)
    chords = np.linalg.norm([b - a, c - b], axis=2)
    angle = 2 * np.arcsin(chords / (2 * wide)).sum(axis=0)
    curve = angle * (axis * (middle - centre[own])).sum(axis=1) / radius[own]
    np.subtract.at(turning, own, curve)
    leave, arrive = (np.cross(axis, x - middle) / wide[:, None] for x in (a, c))
    for k in range(len(own)):
        mine = np.flatnonzero(own == own[k])
        nxt = mine[np.linalg.norm(a[mine] - c[k], axis=1).argmin()]
        normal = (c[k] - centre[own[k]]) / radius[own[k]]
        side = normal @ np.cross(arrive[k], leave[nxt])
        turning[own[k]] -= np.arctan2(side, arrive[k] @ leave[nxt])
    return radius**2 * turning


@pytest.mark.parametrize("name", ["n=4", "n=6", "n=18"])
def test_gauss_and_bonnet(name: str) -> None:
    export = as_export(made(name))
    it = cells_of_export(export, "a")
    centre, radius = spheres(export)
    np.testing.assert_allclose(gauss_bonnet(it, centre, radius), it.area, rtol=1e-8)


def test_samples_on_a_real_cell() -> None:
    """Corners and points of edges lie on their mirror, in no other ball, beyond no wall."""
    export = as_export(made("n=18"))
    it = cells_of_export(export, "a")
    centre, radius = spheres(export)
    x = it.rim.points[:, :2].reshape(-1, 3)
    depth = np.linalg.norm(x[:, None] - centre, axis=2) - radius
    assert np.abs(depth[np.arange(len(x)), np.repeat(it.rim.mirror, 2)]).max() < 1e-11
    assert depth.min() > -1e-11
    assert x[:, 0].min() > -1e-11
    assert x[:, 2].min() > export.foot_z_mm - 1e-11
