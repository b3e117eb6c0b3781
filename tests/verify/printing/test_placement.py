"""Where parts fit, how much they overhang, and what is said of them."""

from __future__ import annotations

import json
import math
from functools import cache

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.printing.assessment import assess, print_check, to_row
from tbcad_verify.printing.orientations import best_rotation, hull_view
from tbcad_verify.printing.part_measures import PartMeasures
from tbcad_verify.printing.placement import overhang_area, place, pose_text
from tbcad_verify.printing.profile import Profile, load

from tests.verify.printing.printing_meshes import (
    box,
    mesh_of,
    plate,
    prism,
    rectangle,
    ring,
    shape,
    turned,
    turned_inside_out,
)

DOWN = np.array([0.0, 0.0, -1.0])


@cache
def fdm(**changed: object) -> Profile:
    return load("fdm").model_copy(update=changed)


def bed(*sides: float, rim: float = 0.0) -> Profile:
    return fdm(bed_mm=sides, clearance_mm=rim)


def area(mesh: Mesh, lean_deg: float, down: np.ndarray = DOWN) -> float:
    return overhang_area(mesh, norm(mesh.area), down, math.radians(lean_deg))


def test_a_cube_that_fits_only_turned_back() -> None:
    cube = shape(turned(box(20, 20, 20), 45, (0, 0, 1)))
    found = place(cube, bed(20, 20, 20))
    assert found.pose.fits
    assert found.pose.size == pytest.approx([20, 20, 20], abs=1e-4)
    assert not place(cube, bed(19.9, 20, 20)).pose.fits


@pytest.mark.parametrize("degrees", [20, 30, 45, 60])
def test_a_long_plate_fits_a_bed_at_one_angle(degrees: float) -> None:
    """The room is too low for it to stand on its side."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    sides = np.array([110 * cos + 10 * sin, 110 * sin + 10 * cos])
    strip = shape(box(110, 10, 3))
    found = place(strip, bed(*sides + 1e-3, 3.01))
    assert found.pose.fits
    assert found.pose.size == pytest.approx([*sides, 3], abs=2e-3)
    assert "turned" in pose_text(found.pose)
    if degrees == 45:
        missed = place(strip, bed(*sides - 0.5, 3.01))
        assert missed.pose.excess == pytest.approx(0.5, abs=1e-4)


def test_a_rod_fits_only_tilted() -> None:
    """Longer than the diagonal of the bed, shorter than that of the room above it."""
    found = place(shape(box(160, 2, 2)), bed(100, 100, 100))
    assert found.pose.fits
    assert np.abs(found.pose.down).max() < 0.9


def test_how_much_too_large() -> None:
    found = place(shape(box(50, 40, 30)), bed(45, 45, 45, rim=0.5))
    assert not found.pose.fits
    # Upright 50 is 5 too high. Lying diagonally 30 x 50 needs 56.6, and 30 x 40 stands in 44 x 44.
    assert found.pose.excess == pytest.approx(5, abs=1e-4)


def test_the_pose_is_a_rotation_that_gives_the_size() -> None:
    part = turned(prism([(0, 0), (30, 0), (22, 14), (0, 9)], 12), 33, (1, 2, 3))
    found = shape(part)
    pose = place(found, fdm()).pose
    np.testing.assert_allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose.rotation) == pytest.approx(1)
    np.testing.assert_allclose(np.ptp(pose.rotation @ found.mesh.points.T, axis=1), pose.size)


points = st.lists(
    st.tuples(st.floats(-50, 50), st.floats(-50, 50)), min_size=4, max_size=12, unique=True
)


@given(points, st.floats(5, 100), st.floats(5, 100))
@settings(max_examples=60)
def test_no_turn_beats_the_one_found(
    corners: list[tuple[float, float]], width: float, depth: float
) -> None:
    """Against every twentieth of a degree."""
    flat = np.array([*corners, (-9, -8), (9, -7), (8, 9)]).T
    angle, sides = best_rotation(hull_view(np.vstack([flat, flat[:1]]), DOWN), width, depth, 1e-9)
    tried = np.linspace(0, np.pi, 3601)
    x = np.cos(tried)[:, None] * flat[0] - np.sin(tried)[:, None] * flat[1]
    y = np.sin(tried)[:, None] * flat[0] + np.cos(tried)[:, None] * flat[1]
    excess = np.maximum(np.ptp(x, axis=1) - width, np.ptp(y, axis=1) - depth).min()
    found = max(sides[0] - width, sides[1] - depth)
    assert found <= max(excess, 0) + 1e-6
    turned_x = math.cos(angle) * flat[0] - math.sin(angle) * flat[1]
    assert np.ptp(turned_x) == pytest.approx(sides[0])


def tee() -> trimesh.Trimesh:
    """A stem of 10 x 30 x 20 under a bar of 50 x 30 x 5."""
    outline = [(-5, 0), (5, 0), (5, 20), (25, 20), (25, 25), (-25, 25), (-25, 20), (-5, 20)]
    return prism(outline, 30)


def test_the_overhang_of_a_t() -> None:
    mesh = mesh_of(tee())
    assert area(mesh, 45) == pytest.approx(2 * 20 * 30, rel=1e-6)
    assert area(mesh, 45, -DOWN) == 0
    assert place(shape(tee()), fdm()).overhang == 0  # lying on its back, nothing does


@pytest.mark.parametrize(("lean", "share"), [(29.9, 1), (30, 0), (45, 0)])
def test_the_overhang_of_a_tilted_plate(lean: float, share: float) -> None:
    """One face of 40 x 20 leans 30 degrees; the edge of 20 x 1 below looks down by 60."""
    mesh = mesh_of(turned(box(1, 20, 40), 30, (0, 1, 0)))
    assert area(mesh, lean) == pytest.approx(20 * 1 + share * 800, rel=1e-5)


def test_a_good_part() -> None:
    found = assess("b.stl", shape(box(20, 10, 5)), fdm())
    assert found.problems == ()
    assert found.mass_g == pytest.approx(1.24)
    info = print_check(found, required=False)
    assert (info.name, info.file, info.unit) == ("print fdm", "b.stl", "problems")
    assert (info.measured, info.limit, info.passed) == (0, None, True)
    assert info.detail == "fits: -z down, 1 g PLA"
    failing = print_check(found, required=True)
    assert (failing.measured, failing.limit, failing.passed) == (0, 0, True)


def bad() -> PartMeasures:
    """Two solids and a cavity; walls of 0.5; a hole of 1; 300 long."""
    plates = plate(rectangle(300, 20), [ring(0.5, 32)], 0.5)
    hollow = turned_inside_out(box(3, 3, 3, at=(0, 0, 50)))
    return shape(plates, box(9, 9, 9, at=(0, 0, 50)), hollow)


def test_every_problem_is_named_with_figure_and_limit() -> None:
    machine = load("sla").model_copy(update={"max_triangles": 100, "hole_mm": 1.5})
    found = assess("bad.stl", bad(), machine)
    solids, cavities, triangles, wall, hole, size = found.problems
    assert solids == "2 separate solids, 1 allowed"
    assert cavities == "1 closed cavities, none allowed"
    assert triangles == f"{len(bad().mesh.faces)} triangles, at most 100 are read"
    assert wall.startswith("minimum wall 0.5 mm, 0.8 required, at (")
    assert hole == "smallest hole 1 mm, 1.5 required, at (0.0, 0.0, 0.2)"
    assert "mm too large: " in size
    assert size.endswith("the bed is 145 x 145 x 175 less 0.2 at the rim")
    info = print_check(found, required=False)
    assert info.passed
    assert info.measured == 6
    failing = print_check(found, required=True)
    assert failing.passed is False
    assert failing.detail == info.detail == "; ".join(found.problems)


def test_an_open_mesh_is_a_problem() -> None:
    cube = box(10, 10, 10)
    cube.update_faces(np.arange(len(cube.faces)) > 0)
    assert assess("o.stl", shape(cube), fdm()).problems[0].startswith("no closed solid: manifold3d")


def test_a_cavity_is_a_problem_only_where_something_is_trapped() -> None:
    hollow = shape(box(20, 20, 20), turned_inside_out(box(10, 10, 10)))
    assert assess("h.stl", hollow, fdm()).problems == ()
    assert assess("h.stl", hollow, load("sls")).problems == ("1 closed cavities, none allowed",)


def test_limits_that_are_just_met_are_met() -> None:
    part = shape(plate(rectangle(30, 30), [ring(1, 64)], 1.2))
    assert assess("p.stl", part, fdm()).problems == ()
    assert len(assess("p.stl", part, fdm(wall_mm=1.21, hole_mm=2.01)).problems) == 2
    assert assess("p.stl", part, fdm(max_triangles=part.triangles)).problems == ()
    assert len(assess("p.stl", part, fdm(max_triangles=part.triangles - 1)).problems) == 1


def test_what_a_round_tool_leaves_in_inner_edges() -> None:
    """In a right angle a tool of radius r leaves (sqrt 2 - 1) r; a T has two, 30 long each."""
    part, mill = shape(tee()), load("cnc")
    left = (math.sqrt(2) - 1) * mill.spot_mm / 2

    def length(tolerance: float) -> float | None:
        machine = mill.model_copy(update={"tolerance_mm": tolerance})
        return assess("t.stl", part, machine).uncut_mm

    assert length(left - 0.01) == pytest.approx(60, abs=1e-4)
    assert length(left + 0.01) == 0
    assert assess("t.stl", part, fdm()).uncut_mm is None


def test_rows_are_json_and_the_same_every_time() -> None:
    names = ("fdm", "sla", "sls", "cnc")
    rows = [[to_row(assess("x.stl", part, load(k))) for k in names] for part in (bad(), bad())]
    text = [json.dumps(row, allow_nan=False, sort_keys=True) for row in rows]
    assert text[0] == text[1]
    lid = trimesh.Trimesh([[0, 0, 1], [9, 0, 0], [0, 9, 0], [9, 9, 0]], [[0, 1, 2], [1, 3, 2]])
    found = assess("lid.stl", shape(lid), fdm())
    row = to_row(found)
    assert row["wall_mm"] is row["hole_mm"] is None
    json.dumps(row, allow_nan=False)
    assert print_check(found, required=True).passed is False


def test_a_dimple_that_a_machine_may_leave_out_is_no_hole() -> None:
    """A plate with a hole of 1 mm through it, thicker or thinner than the tolerance of 0.3."""
    for thickness, holes in ((2.0, 1), (0.2, 0)):
        pierced = shape(plate(rectangle(30, 20), [ring(0.5, 32)], thickness))
        found = [one for one in assess("p.stl", pierced, fdm()).problems if "hole" in one]
        assert len(found) == holes
