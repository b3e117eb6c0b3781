"""Form errors of spheres: heights above them as Zernike terms over a disc about an apex.

The surface is where the distance from the sphere's centre is its radius and a height h(x, y), for
x and y across the apex's normal over the disc's radius. Its unit normal is u - grad h to first
order, at the unit direction u from the centre. Power, the term of the order 2 without an angle, is
no form error but another radius: see `radius_of_sagitta`.

A form in the frame of a machine is a row of FORM_COLUMNS figures: its polynomial's coefficients
(tbcad.core.optics.zernike.MONOMIALS), mm; the axes of x and y; and 1 over the disc's radius.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.reflection import ITERATIONS, reflection_points
from tbcad.core.optics.zernike import DEGREE, MONOMIALS, TERMS, term_polynomials
from tbcad.types import Floats

# Columns of a form.
HEIGHT, FIRST, SECOND, PER_MM, FORM_COLUMNS = 0, 15, 18, 21, 22
FORM_TERMS = {
    "astigmatism": ((2, -2), (2, 2)),
    "coma": ((3, -1), (3, 1)),
    "trefoil": ((3, -3), (3, 3)),
    "spherical": ((4, 0),),
}
"""Orders and azimuthal numbers of the terms of a form, by their names, in their order."""
TERM_COUNT = sum(map(len, FORM_TERMS.values()))
LEAST_SAGITTA = 0.05  # of the designed one: a cap stays convex, however wrong it is
CONVERGED = 1e-14  # radians, of the normal
STEPS = 2  # of Newton's method from the sphere, whose heights are micrometres
POWERS = np.array(MONOMIALS).T
POLYNOMIALS = term_polynomials()[[TERMS.index(nm) for group in FORM_TERMS.values() for nm in group]]


@dataclass(frozen=True)
class Forms:
    """Form errors of k spheres at base angle zero."""

    terms: Floats  # factors of FORM_TERMS, each its root mean square over the disc, mm, (k, t)
    axes: Floats  # unit vectors of x and y, which the disc's normal follows from, (k, 2, 3)
    half_aperture: Floats  # radius of the disc, mm, (k,); 0 where a sphere has no form

    @property
    def outward(self) -> Floats:
        """Unit normals of the discs, (k, 3)."""
        return np.cross(self.axes[:, 0], self.axes[:, 1])

    def rows(self) -> Floats:
        """Each as a row of FORM_COLUMNS figures, (k, FORM_COLUMNS)."""
        some = self.half_aperture > 0
        per_mm = np.where(some, 1 / np.where(some, self.half_aperture, 1.0), 0.0)
        polynomial = np.where(some, 1.0, 0.0)[:, None] * (self.terms @ POLYNOMIALS)
        return np.column_stack([polynomial, self.axes.reshape(-1, 6), per_mm])


def sagitta(radius: Floats, half_aperture: Floats) -> Floats:
    """Height of a sphere's apex over a circle of a radius on it, mm."""
    return np.asarray(radius - np.sqrt(radius**2 - half_aperture**2))


def radius_of_sagitta(height: Floats, half_aperture: Floats) -> Floats:
    """Radius of the sphere whose sagitta over a circle is a height, mm: `sagitta` inverted."""
    return np.asarray((half_aperture**2 + height**2) / (2 * height))


def powered_radius(radius: Floats, half_aperture: Floats, power: Floats) -> Floats:
    """Radii (k,) of spheres whose sagittas are larger by their power, mm; 0 half: as they are.

    A sagitta is no smaller than LEAST_SAGITTA of the designed one.
    """
    some = half_aperture > 0
    half = np.where(some, half_aperture, radius / 2)
    designed = sagitta(radius, half)
    height = np.maximum(designed + power, LEAST_SAGITTA * designed)
    return np.where(some, radius_of_sagitta(height, half), radius)


def power_slope(radius: Floats, half_aperture: Floats) -> Floats:
    """Derivative of the radius by the sagitta, (k,); 0 where there is no half aperture."""
    some = half_aperture > 0
    half = np.where(some, half_aperture, radius / 2)
    root = np.sqrt(radius**2 - half**2)
    return np.where(some, -root / (radius - root), 0.0)


def heights(form: Floats, offset: Floats) -> tuple[Floats, Floats]:
    """Heights (n,), mm, and gradients (n, 3) of forms (n, FORM_COLUMNS) at offsets, (n, 3)."""
    axes = form[:, FIRST:PER_MM].reshape(-1, 2, 3)
    value, *slope = _derivatives(form, offset, (0, 0), (1, 0), (0, 1))
    return value, np.asarray(np.einsum("an,nax->nx", slope, axes))


def bends(form: Floats, offset: Floats) -> Floats:
    """Second derivatives of the heights, 1/mm, (n, 3, 3); arguments as of `heights`."""
    axes = form[:, FIRST:PER_MM].reshape(-1, 2, 3)
    along, mixed, across = _derivatives(form, offset, (2, 0), (1, 1), (0, 2))
    second = np.array([[along, mixed], [mixed, across]])
    return np.asarray(np.einsum("abn,nax,nby->nxy", second, axes, axes))


def term_heights(form: Floats, offset: Floats) -> tuple[Floats, Floats]:
    """Of each term alone: heights (n, t), without unit, and gradients (n, t, 3), 1/mm."""
    every = [form.copy() for _ in range(TERM_COUNT)]
    for one, polynomial in zip(every, POLYNOMIALS, strict=True):
        one[:, HEIGHT:FIRST] = polynomial * (form[:, [PER_MM]] > 0)
    found = [heights(one, offset) for one in every]
    return np.stack([one for one, _ in found], axis=1), np.stack([one for _, one in found], axis=1)


def _derivatives(form: Floats, offset: Floats, *orders: tuple[int, int]) -> list[Floats]:
    """Derivatives (n,) of heights by the lengths along both axes, by their orders."""
    axes, per_mm = form[:, FIRST:PER_MM].reshape(-1, 2, 3), form[:, PER_MM]
    place = per_mm[:, None] * np.einsum("nax,nx->na", axes, offset)
    x, y = np.cumprod([np.ones_like(place), *[place] * DEGREE], axis=0).transpose(2, 1, 0)
    (i, j), factor = POWERS, form[:, HEIGHT:FIRST]

    def by(along: int, across: int) -> Floats:
        left, right = np.maximum(i - along, 0), np.maximum(j - across, 0)
        falling = _falling(i, along) * _falling(j, across)
        summed = np.einsum("nk,k,nk,nk->n", factor, falling, x[:, left], y[:, right])
        return np.asarray(per_mm ** (along + across) * summed)

    return [by(*order) for order in orders]


def _falling(power: np.ndarray, order: int) -> np.ndarray:
    return power * (power - 1) if order > 1 else power**order


def turned_axes(form: Floats, factors: Floats) -> Floats:
    """Forms (..., FORM_COLUMNS) in a frame whose axes are turned by factors (3,) of +-1."""
    ones = np.ones(FIRST)
    return np.asarray(form * np.concatenate([ones, factors, factors, [1.0]]))


def surface_normals(centre: Floats, point: Floats, form: Floats) -> Floats:
    """Unit normals (n, 3) of surfaces at points (n, 3) on them."""
    offset = point - centre
    return unit(unit(offset) - heights(form, offset)[1])


def ray_reach(
    start: Floats, direction: Floats, sphere: tuple[Floats, Floats, Floats], reach: Floats
) -> Floats:
    """Distances (n,) at which rays meet surfaces: centre, radius, form; from those of the spheres.

    Starts are (3,) or (n, 3), unit directions (n, 3).
    """
    centre, radius, form = sphere
    for _ in range(STEPS):
        offset = start + reach[:, None] * direction - centre
        height, gradient = heights(form, offset)
        rise = dot(unit(offset) - gradient, direction)
        reach = reach - (norm(offset) - radius - height) / rise
    return reach


def effective_centres(
    centre: Floats, radius: Floats, form: Floats, light: Floats, pinhole: Floats
) -> Floats:
    """Centres (n, 3) of spheres that have point and normal of the surfaces where these reflect.

    Surfaces (n,) reflect lights (3,) or (n, 3) to a pinhole (3,). The search is that of
    `tbcad.core.optics.reflection.reflection_points`; what has no form keeps its centre.
    """
    touching, some = centre.copy(), form[:, HEIGHT:FIRST].any(axis=1)
    middle, size, form = centre[some], radius[some, None], form[some]
    light = np.broadcast_to(light, centre.shape)[some]
    toward = unit(reflection_points(middle, size[:, 0], light, pinhole) - middle)
    point = middle + size * toward
    for _ in range(ITERATIONS):
        height, gradient = heights(form, point - middle)
        point, normal = middle + (size + height[:, None]) * toward, unit(toward - gradient)
        ways = light - point, pinhole - point
        weight = size / 2 * (1 / norm(ways[0]) + 1 / norm(ways[1]))[:, None]
        turned = unit(unit(unit(ways[0]) + unit(ways[1])) + weight * normal)
        toward = unit(toward + turned - normal)
        if np.abs(turned - normal).max(initial=0) < CONVERGED:
            break
    touching[some] = point - size * normal
    return touching
