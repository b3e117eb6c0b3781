"""Limits of mirrors: what they mean geometrically, and that they keep what they promise."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign, reflectors
from tbcad.mirror_limits.order import minimum_at_limits
from tbcad.mirror_limits.sensitivity import (
    Deviation,
    MirrorLimits,
    Sensitivities,
    mirror_limits,
    sensitivities,
    tilt_axes,
)
from tbcad.tolerancing.montecarlo.coverage import coverage
from tbcad.tolerancing.montecarlo.edge_model import APEX, CURVATURE, edge_models, surface_tables
from tbcad.types import Floats

TARGET = 60.0
UM = 1e-3


@pytest.fixture(scope="module")
def found(small_design: MirrorDesign) -> Sensitivities:
    return sensitivities(reflectors(small_design))


@pytest.fixture(scope="module")
def limits(found: Sensitivities) -> MirrorLimits:
    return mirror_limits(found, TARGET, 0.99)


@pytest.fixture(scope="module")
def export(small_design: MirrorDesign) -> ExportedDesign:
    return ExportedDesign.model_construct(
        spec=small_design.spec, capture_mm=TARGET, reflectors=reflectors(small_design)
    )


def moved(small_design: MirrorDesign, **deviation: Floats) -> tuple[Floats, Floats]:
    """Tables of the mirrors as designed and deviating, (m, 7) each."""
    model = edge_models(reflectors(small_design))[0]
    none = Deviation.none(1, len(model))
    table = surface_tables(model, replace(none, **deviation).draws(model))[0, : len(model)]
    return model.table[: len(model)], table


def test_an_offset_moves_the_apex_along_the_normal_a_radius_does_not(
    small_design: MirrorDesign,
) -> None:
    m = len(small_design.arrays[0])
    designed, built = moved(small_design, offset=np.full((1, m), 7.0))
    expected = designed[:, APEX] + 7 * UM * designed[:, 3:6]
    assert built[:, APEX] == pytest.approx(expected, abs=1e-12)
    assert built[:, CURVATURE] == pytest.approx(designed[:, CURVATURE], rel=1e-12)
    _, built = moved(small_design, radius=np.full((1, m), 0.2))
    assert built[:, APEX] == pytest.approx(designed[:, APEX], abs=1e-12)
    assert 1 / built[:, CURVATURE] == pytest.approx(1 / designed[:, CURVATURE] + 0.2, rel=1e-12)


def test_a_tilt_turns_the_normal_at_the_apex(small_design: MirrorDesign) -> None:
    """The sphere's normal at the designed apex: (apex - centre) / r, in the light's direction."""
    m = len(small_design.arrays[0])
    tilt = np.broadcast_to([3.0, -4.0], (1, m, 2)).copy()
    designed, built = moved(small_design, tilt=tilt)
    radius = 1 / designed[:, CURVATURE, None]
    centre = built[:, APEX] - radius * built[:, 3:6]
    normal = (designed[:, APEX] - centre) / radius
    turned = normal - designed[:, 3:6]
    axes = tilt_axes(designed[:, 3:6])
    assert np.einsum("mkd,md->mk", axes, turned) == pytest.approx(tilt[0] * 1e-3, rel=1e-9)
    assert np.abs(np.einsum("md,md->m", turned, designed[:, 3:6])).max() < 1e-12


def test_losses_are_those_of_mirrors_that_deviate_one_by_one(
    small_design: MirrorDesign, found: Sensitivities
) -> None:
    """The slow way: a build for each mirror, of its offset alone."""
    models = edge_models(reflectors(small_design))
    m, half = len(models[0]), 0
    lost = []
    for sign in (1.0, -1.0):
        one_by_one = Deviation.none(m, m)
        np.fill_diagonal(one_by_one.offset, sign)
        others = Deviation.none(m, m).draws(models[1])
        lost.append(found.coverage - coverage(models, (one_by_one.draws(models[half]), others)))
    slow = np.maximum(np.max(lost, axis=0), 0)
    of_half = found.mirror < m
    fast = np.zeros_like(slow)
    fast[found.mirror[of_half], found.camera[of_half]] = found.loss[of_half, 0]
    assert fast == pytest.approx(slow, abs=1e-9)
    assert slow.max() > 1e-3


def test_all_mirrors_at_their_limits_are_good(export: ExportedDesign, limits: MirrorLimits) -> None:
    """At a few times the limits, shells are bad: they are not far too small."""
    assert minimum_at_limits(export, limits, builds=200) >= TARGET
    assert minimum_at_limits(export, replace(limits, each=4 * limits.each)) < TARGET


@pytest.mark.parametrize("wanted", [0.5, 0.99])
def test_the_standard_deviations_give_the_yield(
    export: ExportedDesign, found: Sensitivities, wanted: float
) -> None:
    builds, sigma = 400, mirror_limits(found, TARGET, wanted).sigma
    models, generator = edge_models(export.reflectors), np.random.default_rng(5)
    draws = []
    for model, each in zip(models, np.split(sigma, 2), strict=True):
        normal = generator.standard_normal((builds, len(model), 4))
        tilt = normal[..., 1:3] * each[:, 1, None]
        off = normal[..., 0] * each[:, 0], tilt, normal[..., 3] * each[:, 2], 0 * normal[..., 0]
        draws.append(Deviation(*off).draws(model))
    worst = coverage(models, (draws[0], draws[1]), worst_only=True).min(axis=1)
    spread = np.sqrt(wanted * (1 - wanted) / builds)
    assert (worst >= TARGET).mean() >= wanted - 3 * spread


@given(st.integers(0, 2**32 - 1))
def test_margins_are_never_overdrawn(seed: int) -> None:
    """Of linear losses whatever they are: the sum at all limits is at most the margin."""
    generator = np.random.default_rng(seed)
    cameras, mirrors = 12, 9
    pairs = np.argwhere(generator.random((cameras, mirrors)) < 0.4)
    pairs = np.concatenate([pairs, [[0, one] for one in range(mirrors)]])
    loss = generator.exponential(0.1, (len(pairs), 3))
    seat, margin = generator.exponential(0.01, cameras), generator.uniform(0.1, 2, cameras)
    found = Sensitivities(pairs[:, 0], pairs[:, 1], loss, seat, TARGET + margin)
    limits = mirror_limits(found, TARGET, 0.99)
    used = seat * limits.seat_um
    np.add.at(used, found.camera, (loss * limits.each[found.mirror]).sum(axis=1))
    assert (used <= margin + 1e-12).all()


def test_a_design_without_margin_is_refused(found: Sensitivities) -> None:
    with pytest.raises(InputError, match=r"sees 60.* as designed, of 61 mm .*margin_mm"):
        mirror_limits(found, 61.0, 0.99)
