"""Rays off fronts of caps: the product and the verification share no code, and agree."""

import numpy as np
import pytest
from tbcad_verify.as_built.forms import TERMS, Fronts
from tbcad_verify.mesh.surfaces import Surfaces, prepare_for_rays, reflect

from tbcad.core.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.core.optics.reflection import reflection_points
from tbcad.core.optics.sphere_forms import (
    TERM_COUNT,
    Forms,
    effective_centres,
    heights,
    powered_radius,
    ray_reach,
    sagitta,
    surface_normals,
)
from tbcad.types import Floats

PINHOLE = np.array([100.0, 5.0, -90.0])
COUNT = 6
RANDOM = np.random.default_rng(0)
CENTRE = np.array([-60.0, 10.0, 20.0]) + RANDOM.normal(0, 3, (COUNT, 3))
RADIUS = np.linspace(15, 45, COUNT)
LIGHT = np.array([5.0, -3.0, 2.0])
OUTWARD = unit(unit(PINHOLE - CENTRE) + unit(LIGHT - CENTRE) + RANDOM.normal(0, 0.05, (COUNT, 3)))
HALF = np.linspace(4, 9, COUNT)
# Ten times what a hand leaves, so that what is of the second order would be seen.
FORMS = Forms(RANDOM.normal(0, 0.01, (COUNT, TERM_COUNT)), perpendicular_axes(OUTWARD), HALF)


def rays() -> tuple[Floats, Floats]:
    """Number of the front and unit direction of rays that meet the parts in use."""
    which = np.repeat(np.arange(COUNT), 50)
    across = np.einsum("na,nax->nx", RANDOM.uniform(-0.7, 0.7, (300, 2)), FORMS.axes[which])
    aim = CENTRE[which] + RADIUS[which, None] * OUTWARD[which] + HALF[which, None] * across
    return which, unit(aim - PINHOLE)


def test_both_reflect_alike() -> None:
    which, direction = rays()
    assert TERMS == TERM_COUNT
    surfaces = Surfaces((CENTRE + RADIUS[:, None] * OUTWARD).T, OUTWARD.T, 1 / RADIUS)
    spheres = reflect(prepare_for_rays(PINHOLE, surfaces), which, direction.T)
    fronts = Fronts(CENTRE.T, RADIUS, FORMS.axes.transpose(1, 2, 0), HALF, FORMS.terms.T)
    found = fronts.rays(PINHOLE, which, direction.T, spheres)
    form = FORMS.rows()[which]
    reach = ray_reach(PINHOLE, direction, (CENTRE[which], RADIUS[which], form), spheres.reach)
    point = PINHOLE + reach[:, None] * direction
    normal = surface_normals(CENTRE[which], point, form)
    assert pytest.approx(point, abs=1e-7) == found.point.T
    toward = direction - 2 * dot(direction, normal)[:, None] * normal
    assert pytest.approx(toward, abs=1e-7) == found.toward.T
    assert norm(found.point - spheres.point).max() > 1e-3
    assert norm(found.toward - spheres.toward).max() > 1e-3


def test_a_gradient_is_that_of_its_height() -> None:
    which, direction = rays()
    offset, form = RADIUS[which, None] * unit(-direction), FORMS.rows()[which]
    fronts = Fronts(CENTRE.T, RADIUS, FORMS.axes.transpose(1, 2, 0), HALF, FORMS.terms.T)
    ours, theirs = heights(form, offset)[1], fronts.gradient(which, offset.T).T
    for step in 1e-5 * np.eye(3):
        for gradient, height in (
            (ours, lambda at: heights(form, at)[0]),
            (theirs, lambda at: fronts.height(which, at.T)),
        ):
            slope = (height(offset + step) - height(offset - step)) / 2e-5
            assert gradient @ step / 1e-5 == pytest.approx(slope, abs=1e-7)


def test_light_takes_the_shortest_way() -> None:
    """Fermat's principle, with no normals and no slopes in it."""
    form = FORMS.rows()
    touching = effective_centres(CENTRE, RADIUS, form, LIGHT, PINHOLE)
    point = reflection_points(touching, RADIUS, LIGHT, PINHOLE)
    toward = unit(point - CENTRE)
    across = perpendicular_axes(toward)

    def way(shift: Floats) -> Floats:
        direction = unit(toward + np.einsum("a,nax->nx", shift, across))
        at = CENTRE + RADIUS[:, None] * direction
        for _ in range(5):
            at = CENTRE + (RADIUS + heights(form, at - CENTRE)[0])[:, None] * direction
        return norm(at - LIGHT) + norm(at - PINHOLE)

    for shift in 1e-4 * np.array([[1.0, 0], [0, 1.0], [0.7, 0.7]]):
        slope = (way(shift) - way(-shift)) / (2 * norm(shift))
        assert slope == pytest.approx(np.zeros(COUNT), abs=1e-5)
    on_spheres = reflection_points(CENTRE, RADIUS, LIGHT, PINHOLE)
    assert norm(on_spheres - point).max() > 1e-2


def test_ten_micrometres_of_sagitta() -> None:
    """On a radius of 214 mm they are 860 um over a part of 65 mm in use."""
    radius, half = np.array([214.0]), np.array([32.6])
    wrong = powered_radius(radius, half, np.array([-0.01]))
    assert wrong - radius == pytest.approx(0.86, abs=0.01)
    assert sagitta(wrong, half) == pytest.approx(sagitta(radius, half) - 0.01)
    assert powered_radius(radius, 0 * half, np.array([0.01])) == radius
