"""Cast shadows and highlights against closed forms."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import facet_vectors, norm
from tbcad.light.simulate.object_files.finish import F0, Finish
from tbcad.light.simulate.scene.cast_light import (
    CastLight,
    Source,
    cast_light,
    cut_small,
    direction_sources,
    open_share,
)
from tbcad.light.simulate.scene.highlights import Gloss
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import Scene, cast_rays, embree_scene
from tbcad.types import Floats

UP = np.array([0.0, 0.0, 1.0])


def plates() -> SceneObject:
    """A plate of 40 mm at z = 0, and one of 10 mm over its middle, 5 mm above it."""
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    points = np.concatenate([20 * square, 5 * square + 5 * UP])
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    return SceneObject("plates", points, faces, np.tile(UP, (8, 1)), np.ones((4, 3, 3)))


def lit(direction: Floats) -> tuple[SceneObject, CastLight]:
    small = cut_small(plates())
    embree = embree_scene(small.points, small.faces)
    sources = direction_sources(direction[None], np.ones(1))
    return small, cast_light(embree, small, sources, lambda points, _: 0.1 + 0 * points[:, 0], 1.0)


def test_a_plate_casts_its_shadow() -> None:
    direction = np.array([0.6, 0, 0.8])
    small, light = lit(direction)
    x, y, z = small.points.T
    shift = 5 * 0.6 / 0.8  # of the shadow
    within = (np.abs(x + shift) < 4.99) & (np.abs(y) < 4.99) & (z == 0)
    beside = (np.abs(x + shift) > 5.1) | (np.abs(y) > 5.1) | (z > 0)
    assert within.sum() > 60
    assert light.total[within, 0] == pytest.approx(0.1)
    assert light.total[beside, 0] == pytest.approx(0.9)
    assert light.total[:, 1] == pytest.approx(0.1)  # behind


def test_cut_facets_are_the_same_surface() -> None:
    small, whole = cut_small(plates()), plates()
    corners = small.points[small.faces]
    assert norm(corners - np.roll(corners, 1, axis=1)).max() <= 1.0
    areas = [norm(facet_vectors(one.points[one.faces])).sum() for one in (small, whole)]
    assert areas[0] == pytest.approx(areas[1])
    assert len(small.points) < len(small.faces)  # corners are shared
    assert cut_small(small) is small


def test_open_share_of_the_sky() -> None:
    """Under an upright edge, half of the sky."""
    points = np.array([[0.0, -30, 0], [0, 30, 0], [0, 30, 30], [0, -30, 30]]) * 1.0
    embree = embree_scene(points, np.array([[0, 1, 2], [0, 2, 3]]))
    draw = np.random.default_rng(0).normal(size=(20_000, 3))
    way = draw / norm(draw)[:, None]
    place = np.array([[0.05, 0, 1.0], [100.0, 0, 1.0]])
    share = open_share(embree, way[way[:, 2] > 0][:960], place, np.tile(UP, (2, 1)))
    assert share[0] == pytest.approx(0.5, abs=0.1)
    assert share[1] > 0.95


def test_highlight_where_a_mirror_would_show_the_lamp() -> None:
    """There it is E F0 / (4 alpha^2), with lamp and eye along the normal; off it far less."""
    small, light = lit(UP)
    gloss = Gloss(light, Finish.even(len(small.faces), 0.3))
    scene = Scene(
        small, embree_scene(small.points, small.faces), light.total, 30.0, 0.0, None, gloss
    )
    matt = Scene(small, scene.embree, light.total, 30.0)
    start = np.array([[12.0, 3, 25], [12.0 + 25, 3, 25]])
    direction = np.array([[0.0, 0, -1], [-np.sqrt(0.5), 0, -np.sqrt(0.5)]])
    seen = (cast_rays(one, start, direction).colour[:, 0] / 255 for one in (scene, matt))
    highlight = np.subtract(*seen)
    assert highlight[0] == pytest.approx(F0 / (4 * 0.3**4), rel=1e-3)
    assert 0 < highlight[1] < 0.02 * highlight[0]


def shiny(finish: Finish, sources: list[Source], white: float = 1.0) -> Scene:
    """A plate of 40 mm that faces upward, with no light but that of lamps."""
    square = np.array([[-20.0, -20, 0], [20, -20, 0], [20, 20, 0], [-20, 20, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    colours = np.broadcast_to([0.9, 0.6, 0.3], (2, 3, 3))
    plate = cut_small(
        SceneObject("plate", square, faces, np.tile(UP, (4, 1)), colours, finish=finish)
    )
    embree = embree_scene(plate.points, plate.faces)
    light = cast_light(embree, plate, sources, lambda points, _: 0 * points[:, 0], white)
    return Scene(plate, embree, light.total, 30.0, microfacets=Gloss(light, plate.finish))


def test_a_dielectric_reflects_by_fresnel_and_a_metal_its_colour() -> None:
    """At 60 degrees an index of 1.5 reflects 8.92 %, 0.04 + 0.96 / 2^5 = 7 % by Schlick."""
    way = np.array([np.sqrt(3) / 2, 0, 0.5])
    eye = np.array([[-30 * way[0], 0.0, 15.0]]), np.array([[way[0], 0.0, -0.5]])
    sources, rough = direction_sources(way[None], np.ones(1)), 0.5
    matt, glass, metal = (
        cast_rays(shiny(finish, sources), *eye).colour[0] / 255
        for finish in (
            Finish.even(2),
            Finish.even(2, rough),
            Finish.even(2, rough, 1.0),
        )
    )
    assert matt == pytest.approx(0.5 * np.array([0.9, 0.6, 0.3]))
    # E D V pi F, with D pi = 1 / alpha^2 and V by Smith at 60 degrees on both sides.
    alpha2 = rough**4
    whole = 0.5 / alpha2 * 0.5 / (2 * 0.5 * np.sqrt(0.25 * (1 - alpha2) + alpha2))
    assert (glass - matt) / whole == pytest.approx(0.0892, rel=2e-3)
    colour = np.array([0.9, 0.6, 0.3])
    assert metal / whole == pytest.approx(colour + (1 - colour) / 32, rel=2e-3)
