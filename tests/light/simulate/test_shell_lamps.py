"""Objects in the light of a shell's own lamps: fitted as it is computed surface by surface."""

from pathlib import Path

import numpy as np
import pytest

from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.mirrors.record import write_record
from tbcad.core.optics.mirror_light import (
    REFLECTED,
    light_by_mirrors,
    light_of_mirrors,
    lit_mirrors,
)
from tbcad.errors import InputError
from tbcad.light.simulate.scene import shell_lamps
from tbcad.light.simulate.scene.highlights import _glows
from tbcad.light.simulate.scene.mirror_glow import mirror_glow
from tbcad.light.simulate.scene.object import patterned_ball
from tbcad.light.simulate.scene.real_scene import real_scene
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.light.simulate.scene.shell_lamps import (
    lit_by_mirrors,
    mirror_light_factors,
    read_shell_lamps,
)
from tbcad.prototype.purchased.parts import load_parts
from tbcad.shell_lamps.files import printed_ring, ring_record
from tbcad.shell_lamps.ring import lamp_ring


@pytest.fixture(scope="module")
def folder(small_design: MirrorDesign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lit")
    ring = lamp_ring(small_design, load_parts())
    assert ring is not None
    part = printed_ring(ring, small_design.spec.printer)
    write_record(folder, small_design, True, (), ring_record(ring, part, small_design))
    return folder


def test_fitted_light_is_that_of_each_surface(folder: Path) -> None:
    export, lamps = read_export(folder), read_shell_lamps(folder)
    factors = mirror_light_factors(export, lamps)
    draw = np.random.default_rng(1)
    places, normals = 18 * unit(draw.normal(size=(60, 3))), unit(draw.normal(size=(60, 3)))
    total = np.zeros(60)
    for one in export.reflectors:
        mirrors = lit_mirrors(one.mirrors, one.side, one.foot)
        total += REFLECTED * light_by_mirrors(lamps, mirrors, places, normals)
    fitted = shell_lamps._terms(export, places, normals) @ factors
    assert np.abs(fitted - total).max() < 0.1 * total.max()
    assert np.sqrt(np.mean((fitted - total) ** 2)) < 0.04 * total.max()


def test_a_ball_casts_no_shadow_on_itself(folder: Path) -> None:
    """So its outside has the light that it has without shadows; behind there is none."""
    export, lamps, ball = read_export(folder), read_shell_lamps(folder), patterned_ball(15.0)
    shadowed = real_scene(export, ball, lamps).shade
    even = lit_by_mirrors(export, lamps, ball).light
    assert even is not None
    assert shadowed[:, 0] == pytest.approx(even[:, 0], abs=0.03)
    assert shadowed[:, 1].max() < 0.01


def test_a_build_without_lamps_is_refused(small_design: MirrorDesign, tmp_path: Path) -> None:
    write_record(tmp_path, small_design, True)
    with pytest.raises(InputError, match="leave out --own-light"):
        read_shell_lamps(tmp_path)


@pytest.mark.parametrize(("roughness", "within"), [(0.3, 0.5), (0.5, 0.4)])
def test_a_glossy_ball_shows_the_leds_by_the_mirrors(
    folder: Path, roughness: float, within: float
) -> None:
    """As the sum over each LED in each mirror has it: in the mean, and point by point."""
    export, lamps = read_export(folder), read_shell_lamps(folder)
    draw = np.random.default_rng(4)
    normal = unit(draw.normal(size=(400, 3)))
    apex = np.concatenate([one.mirrors.apex for one in export.reflectors])
    place = 15 * normal
    ray = unit(place - draw.choice(apex, 400))
    sees = -(ray * normal).sum(axis=1)
    place, normal, ray = (one[sees > 0.2] for one in (place, normal, ray))
    whole = np.ones((1, 2))
    glow = mirror_glow(export, lamps, np.array([roughness]), whole, 1.0)
    corners = np.zeros((len(place), 3), dtype=np.int64)
    surface = corners, corners, np.full(len(place), roughness**4), np.zeros(len(place))
    spots = np.full((len(place), 3), 1 / 3), place, normal, ray
    shown = glow.distance, glow.rough, glow.light, glow.even
    found = _glows(spots, surface, whole, shown) @ [0.04, 0.96]
    exact = np.zeros(len(place))
    for one in export.reflectors:
        mirrors = lit_mirrors(one.mirrors, one.side, one.foot)
        alpha2 = roughness**4
        light = REFLECTED * light_of_mirrors(lamps, mirrors, place)
        for point, lux in zip(one.mirrors.apex, light, strict=True):
            way = unit(point - place)
            half = unit(way - ray)
            falls, seen = (np.maximum((a * normal).sum(axis=1), 0) for a in (way, -ray))
            up, along = ((a * half).sum(axis=1) for a in (normal, way))
            spread = alpha2 / (up**2 * (alpha2 - 1) + 1) ** 2
            roots = [np.sqrt(alpha2 + (1 - alpha2) * c * c) for c in (falls, seen)]
            smith = 0.5 / (falls * roots[1] + seen * roots[0])
            exact += lux * falls * spread * smith * (0.04 + 0.96 * (1 - along) ** 5)
    assert found.mean() == pytest.approx(exact.mean(), rel=0.2)
    assert np.sqrt(np.mean((found - exact) ** 2)) < within * np.sqrt(np.mean(exact**2))
