"""Warp: whole movements are followed exactly, and material that is displaced by a field closely."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tbcad.tolerancing.montecarlo.coverage import mirror_coverage
from tbcad.tolerancing.montecarlo.draws import (
    MISSING_VARIANCE,
    RING_SHARE,
    WarpMap,
    draw,
    mirror_points,
    smooth_field,
)
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, surface_tables, warp_maps_of
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tests.tolerancing.exact_builds import drawn, warp_fields

SLA = Errors(warp=Error(0.0346, length=50.0))
DRAWS = 20_000


@pytest.fixture(scope="module")
def warp(halves: EdgeModels) -> WarpMap:
    maps = warp_maps_of(halves, SLA)
    assert maps is not None
    return maps[0]


def test_whole_movements_are_followed_exactly(halves: EdgeModels, warp: WarpMap) -> None:
    """A shift, a small turn and a growth: centres go along, radii grow, nothing is bent."""
    half = halves[0]
    points, _ = mirror_points(half.table[:-2], RING_SHARE * half.cell_radius)
    radius = 1 / half.table[:-2, 6]
    centre = half.apex - radius[:, None] * half.normal
    shift, turn = np.array([0.03, -0.01, 0.02]), np.array([1e-3, 2e-3, -1e-3])
    for move, growth in (
        (lambda x: 0 * x + shift, 0.0),
        (lambda x: np.cross(turn, x), 0.0),
        (lambda x: 2e-3 * x, 2e-3),
    ):
        # Centres, radii and astigmatism (m, 6) that displaced points lead to.
        found = np.einsum("mkq,mqx,mqx->mk", warp.fit, move(points), warp.normal)
        assert found[:, :3] == pytest.approx(move(centre), abs=1e-9)
        assert found[:, 3] == pytest.approx(growth * radius, abs=1e-9)
        assert np.abs(found[:, 4:]).max() < 1e-9


def test_endless_length_is_a_shift_of_the_shell(halves: EdgeModels) -> None:
    """The same coverage as with that shift, and none lost where camera and object go along."""
    errors, m = Errors(warp=Error(0.05, length=1e7)), len(halves[0])
    drawn = draw(errors, 5, range(3), m, warp_maps_of(halves, errors))[0]
    shift = drawn.centre[:, 0]
    assert np.abs(drawn.centre - shift[:, None]).max() < 1e-6
    shifted = replace(draw(Errors(), 5, range(3), m)[0], shell_shift=shift)
    one, other = (mirror_coverage(halves[0], at).diameter for at in (drawn, shifted))
    # The foot goes along; the seam, which does not, limits no mirror that it halves.
    whole = ~halves[0].halved
    assert one[:, whole] == pytest.approx(other[:, whole], abs=2e-3)
    together = replace(drawn, shell_shift=-shift)
    still = mirror_coverage(halves[0], draw(Errors(), 5, range(1), m)[0]).diameter
    found = mirror_coverage(halves[0], together).diameter
    assert found[:, whole] == pytest.approx(np.broadcast_to(still, found.shape)[:, whole], abs=2e-3)


def test_without_length_it_is_each_mirrors_own_error(halves: EdgeModels) -> None:
    """As independent errors of the centres, in every figure but the numbers drawn."""
    m = len(halves[0])
    assert warp_maps_of(halves, Errors(warp=Error(0.02))) is None
    warped, _ = draw(Errors(warp=Error(0.02)), 1, range(400), m)
    own, _ = draw(Errors(sphere_centre=Error(0.02)), 1, range(400), m)
    count = own.centre.size
    assert warped.centre.std() == pytest.approx(own.centre.std(), rel=4 / np.sqrt(count))
    neighbours = np.mean(warped.centre[:, 1:] * warped.centre[:, :-1]) / 0.02**2
    assert abs(neighbours) < 4 / np.sqrt(count)
    assert not warped.radius.any()
    assert not warped.foot.any()
    assert not warped.form.any()


def test_the_foot_goes_along_with_the_mirrors_near_it(halves: EdgeModels) -> None:
    """By the field at the place of the foot below each."""
    half, m = halves[0], len(halves[0])
    fields, numbers = warp_fields(halves, SLA, range(1))
    foot, footed = half.table[-1], half.pairs.footed
    apex = half.apex[footed]
    below = apex - ((apex - foot[:3]) @ foot[3:6])[:, None] * foot[3:6]
    wanted = fields[0].basis(below) @ numbers[0, 0] @ foot[3:6]
    moved = surface_tables(half, drawn(halves, SLA, range(1))[0])[0, m + 2 :, :3] - foot[:3]
    assert 0 < len(footed) < m
    assert moved == pytest.approx(wanted[:, None] * foot[3:6], abs=1e-12)


@pytest.mark.parametrize("length", [30.0, 50.0, 80.0])
def test_covariance_is_recovered_from_draws(halves: EdgeModels, length: float) -> None:
    """Within five standard errors, sqrt((1 + c^2) / draws), of the closed form c."""
    places = halves[0].apex
    field = smooth_field(places, length)
    numbers = np.random.default_rng(3).standard_normal((len(field), DRAWS))
    found = np.cov(field.basis(places) @ numbers, bias=True)
    wanted = np.exp(
        -(np.linalg.norm(places[:, None] - places[None], axis=2) ** 2) / (2 * length**2)
    )
    bound = 5 * np.sqrt((1 + wanted**2) / DRAWS) + MISSING_VARIANCE
    assert (np.abs(found - wanted) < bound).all()


@settings(max_examples=20)
@given(st.floats(20, 500), st.integers(0, 2**32 - 1))
def test_variance_misses_no_more_than_the_limit(length: float, seed: int) -> None:
    """At points that it does not follow from, too: of a half ellipsoid like a shell's."""
    points = np.random.default_rng(seed).standard_normal((300, 3))
    points *= np.array([90.0, 90.0, 60.0]) / np.linalg.norm(points, axis=1)[:, None]
    basis = smooth_field(points, length).basis(points)
    missing = 1 - np.sum(basis**2, axis=1)
    assert missing.min() > -1e-7
    assert missing.max() < 1.1 * MISSING_VARIANCE
