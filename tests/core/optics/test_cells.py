"""Cells against slow oracles that know nothing of triangulations."""

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.cells import Cells, cell_areas, cells_of
from tbcad.core.optics.geodesic import geodesic, stretched
from tbcad.core.optics.power_diagram import bounded_triangulation, lowest_value
from tbcad.core.optics.surfaces import Surfaces, planes
from tbcad.core.spec.errors import SpecError
from tests.mirror_arrays import mirror_array

RULES = ["traced", "paper", "flat"]


def first_hit(surfaces: Surfaces, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which surface a ray from the origin meets first, and where: all pairs, no cleverness."""
    g, h, k = surfaces.gradient_at_origin, surfaces.value_at_origin, surfaces.curvature
    slope = directions @ g.T
    discriminant = slope**2 - 2 * k * h
    with np.errstate(invalid="ignore", divide="ignore"):
        distance = 2 * h / (-slope + np.sqrt(discriminant))
    distance = np.where((discriminant >= 0) & (distance > 0), distance, np.inf)
    first = np.argmin(distance, axis=1)
    return first, distance[np.arange(len(first)), first]


def within(cells: Cells, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First hit of rays that end on a mirror between the seam and the foot plane."""
    hit, distance = first_hit(cells.mirror_surfaces, directions)
    point = distance[:, None] * directions
    foot = cells.surfaces.apex[cells.foot, 2]
    inside = (point[:, 0] >= 0) & (point[:, 2] >= foot)
    return hit[inside], point[inside]


def contains(cells: Cells, mirror: int, point: np.ndarray) -> bool:
    """Whether the outline of a cell, seen from the origin, winds once about a point's direction."""
    offsets, sides = cells.rings
    ring = sides[offsets[mirror] : offsets[mirror + 1]]
    t = np.linspace(0, 1, 65)[:-1]
    outline = np.concatenate(
        [cells.arcs.at(np.full(64, s // 2), 1 - t if s % 2 else t) for s in ring]
    )
    axis = unit(point)
    first = unit(np.cross(axis, [0.3, -0.5, 0.8]))
    flat = outline @ np.column_stack([first, np.cross(axis, first)]) / (outline @ axis)[:, None]
    turn = np.diff(np.unwrap(np.arctan2(*flat[np.r_[0 : len(flat), 0]].T[::-1])))
    return bool(abs(turn.sum() - 2 * np.pi) < 1e-6)


@pytest.mark.parametrize("n", [2, 9])
@pytest.mark.parametrize("rule", RULES)
def test_every_ray_meets_the_cell_that_contains_it(n: int, rule: str) -> None:
    cells = mirror_array(f"n={n}", f"radius_rule={rule}").cells
    rng = np.random.default_rng(n)
    mirror, point = within(cells, unit(rng.normal(size=(600, 3))))
    assert len(mirror) > 100
    in_cell = [contains(cells, i, x) for i, x in zip(mirror, point, strict=True)]
    assert np.mean(in_cell) > 0.995  # outlines are sampled: a ray beside an arc may miss its cell


@pytest.mark.parametrize("n", [2, 18])
@pytest.mark.parametrize("rule", RULES)
def test_no_corner_and_no_arc_is_inside_any_mirror(n: int, rule: str) -> None:
    cells = mirror_array(f"n={n}", f"radius_rule={rule}").cells
    arc, t = np.broadcast_arrays(np.arange(len(cells.arcs))[:, None], np.linspace(0, 1, 7))
    points = cells.arcs.at(arc, t)
    for face in cells.arcs.faces.T:
        assert np.abs(cells.surfaces.value(face[:, None], points)).max() < 1e-9
    assert lowest_value(cells.surfaces, points.reshape(-1, 3)) > -1e-9
    corners = len(np.unique([cells.arcs.start, cells.arcs.end]))
    assert corners - len(cells.arcs) + cells.mirrors == 1  # of a disc of cells


@pytest.mark.parametrize("diagonal", [0, 1])
@pytest.mark.parametrize("curvature", [0.0, 0.004])
def test_four_cells_that_meet_in_one_point(diagonal: int, curvature: float) -> None:
    """The degenerate corner that a lucky tolerance would decide: both diagonals must do."""
    u = unit(np.array([[0.5, -0.3, 0.7], [0.5, 0.3, 0.7], [0.7, -0.3, 0.5], [0.7, 0.3, 0.5]]))
    mirrors = Surfaces(10 * u, -u, np.full(4, curvature))
    walls = planes(np.zeros((2, 3)), np.array([[1.0, 0, 0], [0, 0, 1.0]]))
    inner = np.array([[[0, 2, 3], [0, 3, 1]], [[0, 2, 1], [2, 3, 1]]])[diagonal]
    triangles = bounded_triangulation(inner, u, np.ones(4, dtype=bool))
    cells = cells_of(mirrors.joined(walls), triangles)
    arcs = cells.arcs
    ends = np.concatenate([arcs.start, arcs.end])
    centre = np.flatnonzero(np.bincount(ends) == 4)
    assert len(centre) == 1
    assert unit(cells.corners[centre[0]]) == pytest.approx(unit(np.array([1.0, 0, 1.0])))
    assert len(np.unique(ends)) - len(arcs) + 4 == 1
    assert np.ptp(cell_areas(cells)) < 1e-9 * cell_areas(cells).max()


@settings(max_examples=12)
@given(
    n=st.integers(2, 9),
    x=st.floats(60, 200),
    z=st.floats(-200, -60),
    rule=st.sampled_from(RULES),
)
def test_cells_tile_without_gap_or_overlap(n: int, x: float, z: float, rule: str) -> None:
    """Each mirror's cell lies on its own sphere and all of them add up to what rays see."""
    options = [f"n={n}", f"camera_mm=[{x}, 0, {z}]", f"radius_rule={rule}"]
    try:
        # The object may stand in the light.
        with patch("tbcad.core.mirrors.array._check_clearance"):
            cells = mirror_array(*options).cells
    except SpecError:
        assume(False)
    assert (cell_areas(cells) > 0).all()
    arc, t = np.broadcast_arrays(np.arange(len(cells.arcs))[:, None], np.linspace(0, 1, 5))
    assert lowest_value(cells.surfaces, cells.arcs.at(arc, t).reshape(-1, 3)) > -1e-7


@pytest.mark.parametrize("n", [*range(1, 7), 31, 60])
def test_faces_are_joined_look_outward_and_cover_the_sphere_once(n: int) -> None:
    vertices, faces = geodesic(n)
    assert len(vertices) == 10 * n * n + 2
    assert len(faces) == 20 * n * n
    assert np.allclose(norm(vertices), 1, rtol=0, atol=1e-15)
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    directed = edges[:, 0] * len(vertices) + edges[:, 1]
    assert len(np.unique(directed)) == len(directed)
    assert np.array_equal(np.sort(directed), np.sort(edges[:, 1] * len(vertices) + edges[:, 0]))
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    triple = np.einsum("fx,fx->f", a, np.cross(b, c))
    assert triple.min() > 0
    # Van Oosterom and Strackee (1983): solid angle of a triangle seen from the centre.
    below = 1 + np.einsum("fx,fx->f", a, b) + np.einsum("fx,fx->f", b, c)
    solid_angle = 2 * np.arctan2(triple, below + np.einsum("fx,fx->f", c, a))
    assert solid_angle.sum() == pytest.approx(4 * np.pi, rel=1e-12)


@pytest.mark.parametrize("n", [1, 2, 5, 18])
def test_mirror_symmetry_in_every_coordinate_plane_is_exact_on_the_planes(n: int) -> None:
    vertices, _ = geodesic(n)
    rounded = {tuple(v) for v in np.round(vertices, 10) + 0.0}
    for axis in range(3):
        flipped = vertices.copy()
        flipped[:, axis] *= -1
        assert {tuple(v) for v in np.round(flipped, 10) + 0.0} == rounded
        size = np.abs(vertices[:, axis])
        assert not np.any((size > 0) & (size < 1e-6))


def test_stretched_directions_keep_planes_azimuth_and_follow_the_tangent() -> None:
    """With one factor s for x and y the tangent of the angle from the zenith grows by s."""
    u = geodesic(6)[0]
    v = stretched(u, 1.6, 1.6)
    assert np.allclose(norm(v), 1, rtol=0, atol=1e-15)
    assert np.array_equal(v == 0, u == 0)
    assert np.array_equal(np.sign(v), np.sign(u))
    assert np.allclose(np.arctan2(v[:, 1], v[:, 0]), np.arctan2(u[:, 1], u[:, 0]), atol=1e-12)
    assert np.allclose(
        np.hypot(v[:, 0], v[:, 1]) * u[:, 2], 1.6 * np.hypot(u[:, 0], u[:, 1]) * v[:, 2]
    )
    across = stretched(u, 2.0, 0.5)
    assert np.allclose(across[:, 0] * u[:, 1], 4 * u[:, 0] * across[:, 1])
