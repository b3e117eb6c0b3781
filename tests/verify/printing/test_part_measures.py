"""Walls, holes and pieces against closed forms."""

from __future__ import annotations

import math

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from tbcad_verify.printing.part_measures import PartMeasures, thin_area
from tbcad_verify.report.checks import Unknown

from tests.verify.printing.printing_meshes import (
    box,
    plate,
    prism,
    rectangle,
    ring,
    shape,
    turned_inside_out,
)

COARSE = 1e-5  # mm, what float32 leaves of parts of this size


def flange(corners: int = 64, radius: float = 2.0) -> trimesh.Trimesh:
    """40 x 20 x 5 with a hole whose rim comes 1.5 near a side, and a larger one."""
    holes = [ring(radius, corners, 3, 8.5 - radius), ring(3, corners, -10)]
    return plate(rectangle(40, 20), holes, 5)


@pytest.mark.parametrize("sides", [(30, 20, 2), (30, 0.05, 20), (1, 1, 1)])
def test_a_plate_is_as_thick_as_its_least_side(sides: tuple[float, float, float]) -> None:
    assert shape(box(*sides)).walls.minimum == pytest.approx(min(sides), abs=COARSE)


def test_the_thin_side_of_a_hollow_box_and_where() -> None:
    """20 outside; the hollow, 14 x 16 x 16, lies 1 nearer to +x: walls of 4, 2 and 2."""
    hollow = turned_inside_out(box(14, 16, 16, at=(2, 0, 0)))
    found = shape(box(20, 20, 20), hollow)
    assert found.walls.minimum == pytest.approx(1, abs=COARSE)
    assert found.walls.where[0] == pytest.approx(9.5, abs=COARSE)
    # Seen from both sides of that wall: 20 x 20 less a rim that looks past the hollow, and 16 x 16.
    assert thin_area(found.walls, 1.5) == pytest.approx(2 * 256, rel=0.05)
    assert thin_area(found.walls, 0.5) == 0
    assert (found.solids, found.cavities) == (1, 1)


def test_a_tube() -> None:
    """Facets of the bore and of the outside are parallel: thinner than the radii's difference."""
    found = shape(plate(ring(10, 72), [ring(9.2, 72)], 15))
    assert found.walls.minimum == pytest.approx(0.8 * np.cos(np.pi / 72), abs=COARSE)
    assert found.holes.diameter == pytest.approx([18.4], abs=COARSE)
    assert found.holes.middle[:, 0] == pytest.approx([0, 0, 7.5], abs=COARSE)
    assert np.abs(found.holes.axis[:, 0]) == pytest.approx([0, 0, 1], abs=1e-6)
    assert found.holes.depth == pytest.approx([15], abs=COARSE)


def test_a_spherical_shell() -> None:
    outer = trimesh.creation.icosphere(3, 20)
    inner = turned_inside_out(trimesh.creation.icosphere(3, 19))
    found = shape(outer, inner)
    apothem = (outer.triangles_center * outer.face_normals).sum(1).min() / 20
    assert found.walls.minimum == pytest.approx(apothem, abs=1e-4)
    assert (found.solids, found.cavities) == (1, 1)


@pytest.mark.parametrize(("degrees", "is_wall"), [(20, True), (28, True), (32, False), (45, False)])
def test_a_wedge_is_a_wall_only_when_sharp(degrees: float, is_wall: bool) -> None:
    """Towards its edge thickness tends to nought: by nature, or as a wall that runs out."""
    rise = 20 * np.tan(np.radians(degrees))
    least = shape(prism([(0, 0), (20, 0), (20, rise)], 20)).walls.minimum
    assert (least < 0.5) == is_wall
    if not is_wall:  # the upright face and the prism's ends remain
        assert least == pytest.approx(20, abs=COARSE) or least > rise / 3


def test_the_web_between_a_hole_and_a_side() -> None:
    found = shape(flange())
    facets = 2 * (1 - np.cos(np.pi / 64))  # the hole's corners are on its circle: sides lie deeper
    assert 1.5 - COARSE < found.walls.minimum < 1.5 + facets
    assert found.walls.where[:2] == pytest.approx([3, 9.25], abs=0.15)


def test_the_bottom_of_a_groove() -> None:
    """Both sides of the groove look past the 1 mm below it."""
    outline = [(-10, 0), (10, 0), (10, 5), (4, 5), (0, 1), (-4, 5), (-10, 5)]
    assert shape(prism(outline, 30)).walls.minimum == pytest.approx(1, abs=COARSE)


def test_the_web_between_two_grooves() -> None:
    outline = [(-10, -5), (-4, -5), (0, -0.4), (4, -5), (10, -5)]
    outline += [(-x, -z) for x, z in outline]
    assert shape(prism(outline, 30)).walls.minimum == pytest.approx(0.8, abs=COARSE)


@pytest.mark.parametrize(("degrees", "least"), [(20, 3.0), (29, 3.0), (31, 0.5), (60, 0.5)])
def test_a_slit_is_no_groove(degrees: float, least: float) -> None:
    """A V in a bar of 5 mm down to 0.5 mm; below 30 degrees the bar beside it is what counts."""
    half = 4.5 * math.tan(math.radians(degrees / 2))
    outline = [(-6, 0), (6, 0), (6, 5), (half, 5), (0, 0.5), (-half, 5), (-6, 5)]
    thinnest = shape(prism(outline, 30)).walls.minimum
    assert thinnest == pytest.approx(least, abs=COARSE) if least < 1 else thinnest > least


def test_slivers_do_not_see_their_neighbours() -> None:
    """A fan of needles on a cube: facets 1e-5 high, whose normals are what rounding made them."""
    cube = box(10, 10, 10)
    points, faces = cube.vertices.tolist(), cube.faces.tolist()
    rng = np.random.default_rng(1)
    for _ in range(300):
        k = int(rng.integers(len(faces)))
        a, b, c = faces.pop(k)
        share = rng.dirichlet([1, 1, 1e-6])
        points.append(share @ np.array(points)[[a, b, c]])
        n = len(points) - 1
        faces += [[a, b, n], [b, c, n], [c, a, n]]
    found = shape(trimesh.Trimesh(points, faces, process=False))
    assert found.walls.minimum == pytest.approx(10, abs=1e-3)


def test_a_needle_that_looks_askance_is_passed_over() -> None:
    """On top of a cube, 0.1 from its side x = 5, a facet 5e-7 wide, of which one corner is 1.4e-6
    too high: its normal lies nearly flat, and the ray from it leaves through that side."""
    corners = [[-5, -5, 5], [5, -5, 5], [5, 5, 5], [-5, 5, 5]]
    needle = [[4.9, -3, 5], [4.9, 3, 5], [4.9 + 5e-7, 0, 5 + 1.43e-6]]
    points = np.array([*corners, *needle, *(np.array(corners) * [1, 1, -1])])
    top = [[0, 1, 4], [0, 4, 5], [0, 5, 3], [3, 5, 2], [4, 1, 6], [6, 1, 2], [6, 2, 5], [4, 6, 5]]
    rest = [[8, 7, 9], [9, 7, 10]]
    for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
        rest += [[a, a + 7, b], [b, a + 7, b + 7]]
    found = shape(trimesh.Trimesh(points, top + rest, process=False))
    assert found.status == "NoError"
    assert found.walls.minimum == pytest.approx(10, abs=1e-4)


def test_points_in_a_plane_are_no_part() -> None:
    flat = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]], process=False)
    with pytest.raises(Unknown, match="flat"):
        shape(flat)


@pytest.mark.parametrize("corners", [8, 9, 24, 400])
def test_holes_through(corners: int) -> None:
    found = shape(flange(corners)).holes
    assert np.sort(found.diameter) == pytest.approx([4, 6], abs=1e-4)
    assert found.middle[:, found.diameter.argmin()] == pytest.approx([3, 6.5, 2.5], abs=1e-4)


def drilled(drill: manifold3d.Manifold) -> PartMeasures:
    """A block of 20 x 20 x 10 about the origin without the drill."""
    solid = (manifold3d.Manifold.cube([20, 20, 10], True) - drill).to_mesh()
    return shape(trimesh.Trimesh(solid.vert_properties[:, :3], solid.tri_verts, process=False))


def test_a_hole_with_a_round_bottom() -> None:
    """Its wall runs into the bottom without an edge; the wall alone is measured."""
    ball = manifold3d.Manifold.sphere(1.5, 48)
    drill = manifold3d.Manifold.hull(ball + ball.translate([0, 0, 20])).translate([1, 2, 1])
    found = drilled(drill)
    assert found.holes.diameter == pytest.approx([3], abs=0.01)
    assert found.holes.depth == pytest.approx(
        [4], abs=0.3
    )  # the bottom's first facets count as wall


def test_what_is_no_round_hole() -> None:
    hexagon, square = ring(3, 6, -10), ring(3, 4, 0, 0, 45)
    slot = ring(2, 33, 10)
    slot[:17, 1] += 1
    slot[17:, 1] -= 1
    assert shape(plate(rectangle(40, 20), [hexagon, square, slot], 5)).holes.diameter.size == 0
    pegs = plate(ring(2, 48), [], 10)
    assert shape(box(20, 20, 2), pegs).holes.diameter.size == 0


@pytest.mark.parametrize(("missing", "count"), [(80, 1), (100, 0)])
def test_an_open_hole_needs_three_quarters_of_its_turn(missing: float, count: int) -> None:
    """A hole broken out at the side x = 5 of a plate: its rim leaves `missing` degrees open."""
    half = np.radians(missing / 2)
    angle = np.linspace(half, 2 * np.pi - half, 61)[::-1]
    bite = np.column_stack([5 + 2 * (np.cos(angle) - np.cos(half)), 2 * np.sin(angle)])
    outline = np.vstack([[[-9, -9], [5, -9]], bite[::1], [[5, 9], [-9, 9]]])
    found = shape(plate(outline, [], 4)).holes
    assert found.diameter == pytest.approx([4] * count, abs=1e-4)


BASE = shape(flange())
angles = st.floats(-180, 180)
moves = st.floats(-300, 300)


@given(angles, angles, angles, st.tuples(moves, moves, moves))
@settings(max_examples=25)
def test_a_rigid_motion_changes_no_figure(
    a: float, b: float, c: float, move: tuple[float, float, float]
) -> None:
    solid = flange()
    matrix = trimesh.transformations.euler_matrix(*np.radians([a, b, c]))
    matrix[:3, 3] = move
    solid.apply_transform(matrix)
    found = shape(solid)
    # A corner 500 mm away is rounded by 1.5e-5 mm on each axis.
    assert found.walls.minimum == pytest.approx(BASE.walls.minimum, abs=5e-4)
    assert np.sort(found.holes.diameter) == pytest.approx(np.sort(BASE.holes.diameter), abs=2e-4)
    assert found.mass.volume == pytest.approx(BASE.mass.volume, rel=1e-5)
    at = matrix @ [*BASE.holes.middle[:, BASE.holes.diameter.argmin()], 1]
    assert found.holes.middle[:, found.holes.diameter.argmin()] == pytest.approx(at[:3], abs=1e-3)
