"""What weight does to a carrier, against beams in closed form and on broken tables."""

import numpy as np
import pytest
from tbcad_verify.mesh.mesh import indexed_mesh
from tbcad_verify.prototype.bricks import (
    ASIDE,
    POISSON,
    STEP_MM,
    Bricks,
    _inside,
    fill_bricks,
    shapes,
)
from tbcad_verify.prototype.sag_checks import _without_motions
from tbcad_verify.record.prototype import SagTable
from trimesh.creation import box

LENGTH, SIDE = 200.0, 20.0
INERTIA = SIDE**4 / 12
SHEAR = 1 / 2 / (1 + POISSON) * SIDE**2 * 5 / 6


def bar(infill: float = 1.0) -> Bricks:
    """A bar along x from -40 to 200, whose bricks end at x = -5."""
    made = box((LENGTH + 40, SIDE, SIDE))
    made.apply_translation((LENGTH / 2 - 20, 0.3, -0.2))
    return fill_bricks(
        indexed_mesh(np.array(made.vertices), np.array(made.faces, np.int32)), infill
    )


def test_a_bar_is_filled_to_half_a_small_cube() -> None:
    filled = bar()
    assert filled.share.sum() * STEP_MM**3 == pytest.approx((LENGTH + 40) * SIDE**2, rel=0.02)
    assert np.ptp(filled.place[filled.share > 0], axis=0) == pytest.approx(
        [LENGTH + 40 - STEP_MM, SIDE - STEP_MM, SIDE - STEP_MM], abs=STEP_MM
    )


def test_a_bar_bends_under_a_load_at_its_end_as_a_beam_does() -> None:
    filled = bar()
    held, end = filled.place[..., 0] < -5, filled.place[..., 0] > LENGTH - 10
    weight = filled.share * end
    load = filled.spread(weight / weight.sum())[:, None, None] * np.eye(3)[:, 1:]
    moved = filled.solve(held & (filled.share > 0), load)
    tip = np.einsum("cq,qi,cikl->kl", weight / weight.sum(), shapes(), moved[filled.node])
    length = LENGTH
    expected = length**3 / 3 / INERTIA + length / SHEAR
    assert np.diag(tip[1:]) == pytest.approx([expected] * 2, rel=0.03)


def test_walls_are_solid_and_the_rest_is_infill() -> None:
    """Of a square of 20 mm a wall of 1.65 mm is 30.3 % of the area."""
    share = bar(0.25).share.sum() / bar().share.sum()
    assert share == pytest.approx(0.303 + 0.697 * 0.25, abs=0.08)


def test_a_ray_along_the_edge_of_a_steep_facet_comes_to_an_end() -> None:
    """In single precision it is met again and again, from beyond it (of a carrier for n = 18)."""
    corners = [[61.95352103, -16.88250312, 91.56397583], [62.51872591, -11.51321109, 87.51669862]]
    corners += [[62.06945618, -13.3385678, 107.47922069], [30.0, -13.0, 92.0]]
    faces = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]], np.int32)
    mesh = indexed_mesh(np.array(corners, np.float32).astype(float), faces)
    at = np.array([62.22801668, -14.03145469])
    for aside in np.linspace(-2e-5, 2e-5, 41):
        start = at + aside - (0.5 + ASIDE[:, 0]) * STEP_MM
        inside = _inside(mesh, np.array([*start, 80.0]), np.array([1, 1, 20]))
        assert inside.sum() <= 3


def test_motions_of_the_whole_base_are_taken_out() -> None:
    random = np.random.default_rng(1)
    centre, shift, turn = (random.standard_normal(size) for size in ((6, 3), (4, 1, 3), (4, 1, 3)))
    moved = shift + np.cross(turn, centre)
    assert np.abs(_without_motions(moved, centre)).max() < 1e-12
    assert np.abs(_without_motions(random.standard_normal((4, 6, 3)), centre)).max() > 0.1


def test_a_table_of_other_stops_or_balls_is_not_used() -> None:
    pairs = {"stop": [*"1122"], "ball": [*"1212"]}
    named = list(SagTable.model_fields)[2:]
    table = SagTable.model_validate(pairs | {name: [*"0123"] for name in named})
    moved = table.moved((2, 2, 3))
    assert moved is not None
    assert moved[0, 1, 0].tolist() == [2.0, 2.0, 2.0]
    assert table.moved((4, 1, 3)) is None
