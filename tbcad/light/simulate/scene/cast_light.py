"""Light with cast shadows, lamp by lamp, at the corners of an object; and highlights of the lamps.

Facets are cut so small that shadows between corners are sharp to `SHADOW_MM`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.loop_vectors import dot as loop_dot
from tbcad.core.geometry.loop_vectors import minus, plus_scaled, unit, vector
from tbcad.core.geometry.vectors import norm
from tbcad.core.geometry.vectors import unit as unit_rows
from tbcad.core.optics.lamp_light import RectangularLamps, lambertian
from tbcad.core.optics.mirror_light import Lamps, direct_light
from tbcad.light.simulate.scene.lamps import EXPOSED, free_rays
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.types import Bools, Floats, Ints

SHADOW_MM = 1.0  # longest side of a facet that is lit by its corners alone
MOST_FACETS = 400_000  # into which facets are cut at most
SAME = 1e-6  # of corners that are one, mm, and of their normals
LIFT_MM = 0.02  # of corners above the surface, where rays toward lamps begin
FAR_MM = 1e6  # of lamps that are a direction
SKY_RAYS = 96  # directions by which it is found how much of the mirrors' light reaches a corner
# Cosine below which light that falls along a surface is taken as falling at it: between corners it
# is not known better.
GRAZING = 0.1
F0 = 0.04  # share that a dielectric of index 1.5 reflects at normal incidence

Lit = Callable[[Floats, Floats], Floats]
"""Light (n,) without shadows on points (n, 3) with unit normals (n, 3)."""


@dataclass(frozen=True)
class Source:
    """What shines from one place: a lamp, or a part of one."""

    place: Floats  # mm, (3,)
    light: Lit
    lamp: int  # number of the lamp that it is of


@dataclass(frozen=True)
class CastLight:
    """Light at corners (v,), outside and behind, as shares of what is shown as white."""

    lamp: Floats  # of each of l lamps, (v, 2, l)
    rest: Floats  # of all that is no lamp, (v, 2)
    place: Floats  # middles of the lamps, mm, (l, 3)

    @property
    def total(self) -> Floats:
        """All of it, (v, 2)."""
        return np.asarray(self.lamp.sum(axis=2) + self.rest)


def lamp_sources(lamps: RectangularLamps) -> list[Source]:
    """The tiles of a prototype's lamps, and its LEDs above, lux."""
    places, facing, candela = lamps.sources()
    tiles, count = len(places) - len(lamps.leds), len(lamps.places)
    number = [*np.repeat(range(count), tiles // count), *range(count, count + len(lamps.leds))]
    each = zip(places[:, None], facing[:, None], candela[:, None], strict=True)
    return [
        Source(one[0][0], partial(lambertian, *one), k) for one, k in zip(each, number, strict=True)
    ]


def led_sources(lamps: Lamps) -> list[Source]:
    """The LEDs of a shell's cameras, straight onto the object, lux."""
    single = [
        Lamps(*(values[k : k + 1] for values in (lamps.places, lamps.normals, lamps.candela)))
        for k in range(len(lamps.places))
    ]
    return [Source(one.places[0], partial(direct_light, one), k) for k, one in enumerate(single)]


def direction_sources(directions: Floats, weights: Floats) -> list[Source]:
    """Lamps far away, in unit directions (l, 3), that give weights (l,) to what faces them."""

    def light(way: Floats, weight: float) -> Lit:
        return lambda _, normals: weight * np.maximum(normals @ way, 0.0)

    pairs = zip(directions, weights.tolist(), strict=True)
    return [Source(FAR_MM * way, light(way, w), k) for k, (way, w) in enumerate(pairs)]


def cast_light(
    embree: Any, subject: SceneObject, sources: list[Source], rest: Lit, white: float | None
) -> CastLight:
    """Light on an object's corners with the shadows that it casts on itself.

    `rest` is light of no lamp. `white`: what is shown as white; None: that of a good exposure.
    """
    lamps = 1 + max(source.lamp for source in sources)
    light = np.zeros((len(subject.points), 2, lamps))
    even = np.zeros((len(subject.points), 2))
    for side, sign in enumerate((1.0, -1.0)):
        normals = sign * subject.normals
        start = subject.points + LIFT_MM * normals
        for source in sources:
            own = source.light(subject.points, normals)
            own[own > 0] *= unhidden(embree, start[own > 0], source.place)
            light[:, side, source.lamp] += own
        even[:, side] = rest(subject.points, normals)
    if white is None:
        front, back = np.percentile(light.sum(axis=2) + even, EXPOSED, axis=0)
        white = float(front or back) or 1.0
    which = np.array([source.lamp for source in sources])
    places = np.array([source.place for source in sources])
    middles = np.array([places[which == k].mean(axis=0) for k in range(lamps)])
    return CastLight(light / white, even / white, middles)


def unhidden(embree: Any, start: Floats, place: Floats) -> Bools:
    """Which points (n, 3) have nothing between them and a place (3,) beyond the whole object."""
    return free_rays(embree, start, unit_rows(place - start))


def open_share(embree: Any, directions: Floats, points: Floats, normals: Floats) -> Floats:
    """Share (n,) of light from unit directions (k, 3), all alike, that the object lets through.

    By Lambert's law, on points (n, 3) with unit normals (n, 3).
    """
    free, whole = np.zeros(len(points)), np.zeros(len(points))
    start = points + LIFT_MM * normals
    for way in directions[:: max(1, len(directions) // SKY_RAYS)]:
        falls = np.maximum(normals @ way, 0.0)
        whole += falls
        lit = falls > 0
        free[lit] += falls[lit] * free_rays(embree, start[lit], np.tile(way, (lit.sum(), 1)))
    return np.asarray(free / np.maximum(whole, 1e-12))


def cut_small(subject: SceneObject, side_mm: float = SHADOW_MM) -> SceneObject:
    """An object of the same shape and colours whose facets have sides of at most a length.

    Or longer ones, where they would be more than `MOST_FACETS`.
    """
    corners = subject.points[subject.faces]
    longest = norm(corners - np.roll(corners, 1, axis=1)).max(axis=1)
    parts = np.maximum(np.ceil(longest / side_mm - 1e-9), 1)
    if (parts == 1).all():
        return subject
    if (most := (parts**2).sum()) > max(MOST_FACETS, 2 * len(parts)):
        parts = np.maximum(np.floor(parts * np.sqrt(MOST_FACETS / most)), 1)
    pieces = [
        _pieces(subject, np.flatnonzero(parts == count), int(count)) for count in np.unique(parts)
    ]
    points, normals, albedo, *rest = (
        np.concatenate(values) for values in zip(*pieces, strict=True)
    )
    # Corners that pieces share are lit once.
    place = np.rint(np.column_stack([points, normals]) / SAME).astype(np.int64)
    _, first, number = np.unique(place, axis=0, return_index=True, return_inverse=True)
    uv, tiles = rest if rest else (subject.uv, subject.tiles)
    return replace(
        subject,
        points=points[first],
        faces=number.reshape(-1, 3),
        normals=normals[first],
        albedo=albedo,
        uv=uv,
        tiles=tiles,
    )


def _pieces(subject: SceneObject, facets: Ints, count: int) -> list[Floats]:
    """Points, normals, albedo, and uv with tiles, of facets that are cut into count^2 each."""
    weight = _lattice(count)  # (s, 3, 3): corners of pieces by corners of the facet

    def spread(values: Floats) -> Floats:
        mixed = np.einsum("skc,fcx->fskx", weight, values)
        return np.asarray(mixed.reshape(-1, 3, values.shape[-1]))

    own = subject.faces[facets]
    normals = unit_rows(spread(subject.normals[own]).reshape(-1, 3))
    found = [spread(subject.points[own]).reshape(-1, 3), normals, spread(subject.albedo[facets])]
    if subject.uv is not None and subject.tiles is not None:
        found += [spread(subject.uv[facets]), np.repeat(subject.tiles[facets], count**2, axis=0)]
    return found


def _lattice(count: int) -> Floats:
    """Barycentric corners (count^2, 3, 3) of equal pieces of a triangle, turned alike."""
    pieces = []
    for i in range(count):
        for j in range(count - i):
            pieces.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < count - 1:
                pieces.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
    second: Floats = np.array(pieces, dtype=np.float64) / count
    return np.asarray(np.concatenate([1 - second.sum(axis=2, keepdims=True), second], axis=2))


@dataclass(frozen=True)
class Gloss:
    """How a glossy object reflects its lamps: microfacets after GGX, by Smith's shadowing.

    Source: B. Walter and others, Microfacet Models for Refraction, EGSR 2007; Fresnel's share after
    C. Schlick, Computer Graphics Forum 13, 1994; alpha is the square of the roughness, as in glTF.
    """

    light: CastLight
    roughness: float  # 0.05 to 1
    f0: float = F0  # share reflected at normal incidence

    def highlights(
        self, corners: Ints, behind: Bools, weight: Floats, spots: tuple[Floats, Floats, Floats]
    ) -> Floats:
        """Light (k,) that goes back along rays from spots on facets with corners (k, 3).

        `behind` and `weight` as of SurfaceHits; spots: places, unit normals, and directions of the
        rays, (k, 3) each. 1 is that of a matt white surface in full light.
        """
        side = behind.astype(np.int64)
        light = np.einsum("nk,nkl->nl", weight, self.light.lamp[corners, side])
        alpha = self.roughness**2
        return np.asarray(_highlights(*spots, light, self.light.place, alpha**2, self.f0))


@compiled_loop
def _highlights(
    place: Floats,
    normal: Floats,
    ray: Floats,
    light: Floats,
    lamp: Floats,
    alpha2: float,
    f0: float,
) -> Floats:
    total = np.zeros(len(place))
    for k in range(len(place)):
        point, upward, back = vector(place[k]), vector(normal[k]), vector(ray[k])
        sees = -loop_dot(back, upward)
        if sees <= 0:
            continue
        for j in range(len(lamp)):
            if light[k, j] <= 0:
                continue
            way = unit(minus(vector(lamp[j]), point))
            falls = loop_dot(way, upward)
            if falls <= 0:
                continue
            half = unit(plus_scaled(way, -1.0, back))
            up, along = loop_dot(half, upward), -loop_dot(half, back)
            spread = alpha2 / (up * up * (alpha2 - 1) + 1) ** 2  # of the normals, times pi
            falls = max(falls, GRAZING)
            smith = 0.5 / (
                falls * np.sqrt(sees * sees * (1 - alpha2) + alpha2)
                + sees * np.sqrt(falls * falls * (1 - alpha2) + alpha2)
            )
            total[k] += light[k, j] * spread * smith * (f0 + (1 - f0) * (1 - along) ** 5)
    return total
