"""Whether the object stands in its own light, and with which sizes it would not."""

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.optimize import brentq

from tbcad.core.geometry.conics import Ellipsoid
from tbcad.core.geometry.vectors import dot, norm
from tbcad.core.optics.cells import Cells
from tbcad.core.optics.reflection import miss_distances
from tbcad.core.optics.windows import (
    cell_sides,
    minima_by_mirror,
    parabola_minima,
    samples_about_minima,
)
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.sizes import MAX_SEMI_MINOR, OpticsSpec
from tbcad.types import Floats, Ints

# Light in use ends at a share of the way from the apex to the edge of the cell, found to 2^-16 of
# it: micrometres on a cell of a hand's width.
BISECTIONS = 16
ROUNDS = 2  # after two rounds the samples are a 32nd of the side apart; a parabola does the rest
TRIES = 5  # sizes are tried until one clears: the first that is computed mostly does
STEPS_PER_MM = 10  # of the sizes tried


def closest_passage(cells: Cells, pinhole: Floats, capture: float) -> tuple[float, int]:
    """Smallest distance (mm) from the origin at which light passes, and its mirror.

    Light is in use where its mirror shows the capture sphere of a radius (mm). If it passes closer,
    the object stands in it. Apices show the origin, and in the picture a mirror's part in use does
    not contain it, so what passes closest is at the edge of that part: where rays graze the capture
    sphere, or at the edge of the cell.
    """
    mirror, arc = cell_sides(cells)

    def passing(point: Floats) -> Floats:
        return passing_distances(pinhole, point)

    def in_use(edge: Floats) -> Floats:
        mirrors = np.broadcast_to(mirror[:, None], edge.shape[:-1])
        return passing(_last_in_use(cells, mirrors, edge, pinhole, capture))

    # An apex is in use: a mirror all of whose cell is farther off than one needs no closer look.
    at_edge = minima_by_mirror(mirror, _minima(cells, arc, passing), cells.mirrors)
    enough = max(passing(cells.mirror_surfaces.apex).min(), at_edge.min())
    close = at_edge[mirror] <= enough
    mirror, arc = mirror[close], arc[close]
    distance = _minima(cells, arc, in_use)
    return float(distance.min()), int(mirror[distance.argmin()])


def passing_distances(pinhole: Floats, point: Floats) -> Floats:
    """Distances (...) from the origin of straight ways from a pinhole to points (..., 3), mm."""
    ray = point - pinhole
    share = np.clip(-(ray @ pinhole) / dot(ray, ray), 0, 1)
    return norm(pinhole + share[..., None] * ray)


def _minima(cells: Cells, arc: Ints, function: Callable[[Floats], Floats]) -> Floats:
    """Smallest value (k,) on each arc (k,) of a function of points (k, s, 3)."""

    def values(t: Floats) -> Floats:
        return function(cells.arcs.at(np.broadcast_to(arc[:, None], t.shape), t))

    return parabola_minima(samples_about_minima(values, len(arc), ROUNDS))


def _last_in_use(
    cells: Cells, mirror: Ints, edge: Floats, pinhole: Floats, capture: float
) -> Floats:
    """Points (..., 3) on mirrors (...) where light in use ends from the apex toward an edge."""
    apex = cells.surfaces.apex[mirror]
    low, high = np.zeros(mirror.shape), np.ones(mirror.shape)
    for _ in range(BISECTIONS):
        share = (low + high) / 2
        point = _seen_at(cells, mirror, apex + share[..., None] * (edge - apex), pinhole)
        normal = cells.surfaces.gradient(mirror, point)
        used = miss_distances(pinhole, point, normal) <= capture
        low, high = np.where(used, share, low), np.where(used, high, share)
    return _seen_at(cells, mirror, apex + low[..., None] * (edge - apex), pinhole)


def _seen_at(cells: Cells, mirror: Ints, chord: Floats, pinhole: Floats) -> Floats:
    """Points (..., 3) on mirrors (...) that a pinhole sees in line with points of their chords."""
    ray = chord - pinhole
    return pinhole + cells.surfaces.first_reach(mirror, pinhole, ray)[..., None] * ray


class LitMirrors(Protocol):
    """What is asked of a camera's mirrors."""

    @property
    def ids(self) -> list[str]: ...  # noqa: D102
    @property
    def ellipsoid(self) -> Ellipsoid: ...  # noqa: D102
    @property
    def u(self) -> Floats: ...  # noqa: D102
    @property
    def cells(self) -> Cells: ...  # noqa: D102


Solve = Callable[[Spec], LitMirrors]
Size = Callable[[OpticsSpec, LitMirrors, float], float | None]


def check_clearance(spec: Spec, array: LitMirrors, solve: Solve) -> None:
    """Refuse a design whose object stands between its mirrors and the camera.

    SpecError names the mirror, and sizes with which the light passes the object.
    """
    radius = spec.optics.capture_diameter_mm / 2
    distance, mirror = _passage(spec.optics, array)
    if distance >= radius:
        return
    raise SpecError(
        f"the object stands in its own light: on the way from mirror {array.ids[mirror]} to the "
        f"camera light passes {distance:.4g} mm from the object's centre, closer than the capture "
        f"sphere's radius of {radius:.4g} mm: {_remedies(spec, array, solve)}"
    )


def _remedies(spec: Spec, array: LitMirrors, solve: Solve) -> str:
    sizes: dict[str, tuple[Size, str]] = {
        "capture_diameter_mm": (_smaller_sphere, "less"),
        "semi_minor_mm": (_wider_ellipsoid, "more"),
    }
    tried = [
        f"optics.{key} {value:g} or {which}"
        for key, (size, which) in sizes.items()
        if (value := _size_that_clears(spec, array, solve, key, size))
    ]
    if not tried:
        return "make optics.capture_diameter_mm smaller or bring optics.camera_mm farther away"
    return f"make {', or '.join(tried)} ({'both ' if len(tried) > 1 else ''}tried)"


def _size_that_clears(
    spec: Spec, array: LitMirrors, solve: Solve, key: str, size: Size
) -> float | None:
    """The size nearest to the spec's that was tried and clears, mm; None where none was found."""
    tried = spec
    for _ in range(TRIES):
        value = size(spec.optics, array, _spread(tried.optics, array))
        if value is None:
            return None
        tried = spec.model_copy(update={"optics": spec.optics.model_copy(update={key: value})})
        try:
            array = solve(tried)
        except SpecError:
            return None
        if _passage(tried.optics, array)[0] >= tried.optics.capture_diameter_mm / 2:
            return value
    return None


def _passage(optics: OpticsSpec, array: LitMirrors) -> tuple[float, int]:
    return closest_passage(array.cells, array.ellipsoid.pinhole, optics.capture_diameter_mm / 2)


def _apex_passage(ellipsoid: Ellipsoid, u: Floats) -> float:
    """Smallest distance from the origin of the ways between the camera and all apices, mm."""
    return float(passing_distances(ellipsoid.pinhole, ellipsoid.apices(u)).min())


def _spread(optics: OpticsSpec, array: LitMirrors) -> float:
    """How much closer light in use passes than that of the apices, a mm of capture diameter.

    It hardly depends on the sizes, so a size that clears follows from the apices in closed form.
    """
    apices = _apex_passage(array.ellipsoid, array.u)
    return (apices - _passage(optics, array)[0]) / optics.capture_diameter_mm


def _smaller_sphere(_: OpticsSpec, array: LitMirrors, spread: float) -> float | None:
    diameter = _apex_passage(array.ellipsoid, array.u) / (0.5 + spread)
    return math.floor(diameter * STEPS_PER_MM) / STEPS_PER_MM or None


def _wider_ellipsoid(optics: OpticsSpec, array: LitMirrors, spread: float) -> float | None:
    needed = optics.capture_diameter_mm * (0.5 + spread)

    def spare(semi_minor: float) -> float:
        return _apex_passage(Ellipsoid(array.ellipsoid.pinhole, semi_minor), array.u) - needed

    if not spare(optics.semi_minor_mm) < 0 <= spare(MAX_SEMI_MINOR):
        return None
    semi_minor = brentq(spare, optics.semi_minor_mm, MAX_SEMI_MINOR)
    return math.ceil(semi_minor * STEPS_PER_MM) / STEPS_PER_MM
