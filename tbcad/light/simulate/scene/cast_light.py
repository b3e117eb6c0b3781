"""Light with cast shadows, lamp by lamp, at the corners of an object; and highlights of the lamps.

Facets are cut so small that shadows between corners are sharp to `SHADOW_MM`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled_loop
from tbcad.core.geometry.loop_vectors import dot as loop_dot
from tbcad.core.geometry.loop_vectors import minus, plus_scaled, unit, vector
from tbcad.core.geometry.vectors import norm
from tbcad.core.geometry.vectors import unit as unit_rows
from tbcad.core.optics.lamp_light import RectangularLamps, lambertian
from tbcad.core.optics.mirror_light import Lamps, direct_light
from tbcad.light.simulate.object_files.finish import NO_DIELECTRIC, Finish
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
# Of a lamp's area over its squared distance, what is added to alpha^2: the lobe of a perfect mirror
# is then as high as that of a disc which sends light evenly from the lamp.
WIDER = 1 / (4 * np.pi)

Lit = Callable[[Floats, Floats], Floats]
"""Light (n,) without shadows on points (n, 3) with unit normals (n, 3)."""


@dataclass(frozen=True)
class Source:
    """What shines from one place: a lamp, or a part of one."""

    place: Floats  # mm, (3,)
    light: Lit
    area: float = 0.0  # of its face, mm^2


@dataclass(frozen=True)
class CastLight:
    """Light at corners (v,), outside and behind, as shares of what is shown as white."""

    lamp: NDArray[np.float32]  # of each of l sources, (v, 2, l)
    rest: Floats  # of all that is no lamp, (v, 2)
    place: Floats  # of the sources, mm, (l, 3)
    area: Floats  # of their faces, mm^2, (l,)

    @property
    def total(self) -> Floats:
        """All of it, (v, 2)."""
        return np.asarray(self.lamp.sum(axis=2, dtype=np.float64) + self.rest)


def lamp_sources(lamps: RectangularLamps) -> list[Source]:
    """The tiles of a prototype's lamps, and its LEDs above, lux."""
    places, facing, candela = lamps.sources()
    tiles, count = len(places) - len(lamps.leds), len(lamps.places)
    tile = lamps.width * lamps.length * count / tiles
    area = np.repeat([tile, 0.0], [tiles, len(lamps.leds)]).tolist()
    each = zip(places[:, None], facing[:, None], candela[:, None], strict=True)
    return [
        Source(one[0][0], partial(lambertian, *one), size)
        for one, size in zip(each, area, strict=True)
    ]


def led_sources(lamps: Lamps) -> list[Source]:
    """The LEDs of a shell's cameras, straight onto the object, lux."""
    single = [
        Lamps(*(values[k : k + 1] for values in (lamps.places, lamps.normals, lamps.candela)))
        for k in range(len(lamps.places))
    ]
    return [Source(one.places[0], partial(direct_light, one)) for one in single]


def direction_sources(directions: Floats, weights: Floats) -> list[Source]:
    """Lamps far away, in unit directions (l, 3), that give weights (l,) to what faces them."""

    def light(way: Floats, weight: float) -> Lit:
        return lambda _, normals: weight * np.maximum(normals @ way, 0.0)

    pairs = zip(directions, weights.tolist(), strict=True)
    return [Source(FAR_MM * way, light(way, w)) for way, w in pairs]


def cast_light(
    embree: Any, subject: SceneObject, sources: list[Source], rest: Lit, white: float | None
) -> CastLight:
    """Light on an object's corners with the shadows that it casts on itself.

    `rest` is light of no lamp. `white`: what is shown as white; None: that of a good exposure.
    """
    light = np.zeros((len(subject.points), 2, len(sources)), dtype=np.float32)
    even = np.zeros((len(subject.points), 2))
    for side, sign in enumerate((1.0, -1.0)):
        normals = sign * subject.normals
        start = subject.points + LIFT_MM * normals
        for k, source in enumerate(sources):
            own = source.light(subject.points, normals)
            own[own > 0] *= unhidden(embree, start[own > 0], source.place)
            light[:, side, k] = own
        even[:, side] = rest(subject.points, normals)
    if white is None:
        whole = light.sum(axis=2, dtype=np.float64) + even
        front, back = np.percentile(whole, EXPOSED, axis=0)
        white = float(front or back) or 1.0
    places = np.array([source.place for source in sources])
    area = np.array([source.area for source in sources])
    return CastLight(light / np.float32(white), even / white, places, area)


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
    alike = [(np.flatnonzero(parts == count), int(count)) for count in np.unique(parts)]
    pieces = [_pieces(subject, *one) for one in alike]
    points, normals, albedo, *uv = (np.concatenate(values) for values in zip(*pieces, strict=True))
    facet = np.concatenate([np.repeat(own, count**2) for own, count in alike])
    # Corners that pieces share are lit once.
    place = np.rint(np.column_stack([points, normals]) / SAME).astype(np.int64)
    _, first, number = np.unique(place, axis=0, return_index=True, return_inverse=True)
    return replace(
        subject,
        points=points[first],
        faces=number.reshape(-1, 3),
        normals=normals[first],
        albedo=albedo,
        uv=uv[0] if uv else None,
        tiles=None if subject.tiles is None else subject.tiles[facet],
        finish=subject.finish and subject.finish.of(facet),
    )


def _pieces(subject: SceneObject, facets: Ints, count: int) -> list[Floats]:
    """Points, normals, albedo, and uv, of facets that are cut into count^2 each."""
    weight = _lattice(count)  # (s, 3, 3): corners of pieces by corners of the facet

    def spread(values: Floats) -> Floats:
        mixed = np.einsum("skc,fcx->fskx", weight, values)
        return np.asarray(mixed.reshape(-1, 3, values.shape[-1]))

    own = subject.faces[facets]
    normals = unit_rows(spread(subject.normals[own]).reshape(-1, 3))
    found = [spread(subject.points[own]).reshape(-1, 3), normals, spread(subject.albedo[facets])]
    return found if subject.uv is None else [*found, spread(subject.uv[facets])]


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

    Source: B. Walter and others, Microfacet Models for Refraction, EGSR 2007; alpha is the square
    of the roughness, as in glTF. Dielectrics reflect by Fresnel's equations, metals by C. Schlick,
    Computer Graphics Forum 13, 1994, which lacks up to a fifth of a dielectric's.
    """

    light: CastLight
    finish: Finish  # of the object's facets

    def highlights(
        self,
        facet: Ints,
        corners: Ints,
        behind: Bools,
        spots: tuple[Floats, Floats, Floats, Floats],
        f0: Floats,
    ) -> Floats:
        """Light (k, 3) that goes back along rays from spots on facets (k,) with corners (k, 3).

        `behind` as of SurfaceHits; spots: barycentric weights, places, unit normals, and directions
        of the rays, (k, 3) each; `f0`: shares (k, 3) reflected at normal incidence. 1 is that of a
        matt white surface in full light.
        """
        own, one = self.finish.of(facet), self.light
        lamps = one.lamp, one.place, one.area
        surface = corners, behind.astype(np.int64), own.roughness**4, own.index
        part = _highlights(spots, surface, lamps)
        return np.asarray(part[:, :1] * f0 + part[:, 1:] * (1 - f0))


@compiled_loop
def _highlights(
    spots: tuple[Floats, Floats, Floats, Floats],
    surface: tuple[Ints, Ints, Floats, Floats],
    lamps: tuple[NDArray[np.float32], Floats, Floats],
) -> Floats:
    """What is to be multiplied by F0, and by 1 - F0, (k, 2). Lamps of an area widen the lobe."""
    weight, place, normal, ray = spots
    corners, behind, alpha2, index = surface
    light, lamp, area = lamps
    total = np.zeros((len(place), 2))
    for k in range(len(place)):
        point, upward, back = vector(place[k]), vector(normal[k]), vector(ray[k])
        sees = -loop_dot(back, upward)
        if sees <= 0 or not alpha2[k] >= 0:  # NaN: matt
            continue
        for j in range(len(lamp)):
            own = 0.0
            for i in range(3):
                own += weight[k, i] * light[corners[k, i], behind[k, i], j]
            if own <= 0:
                continue
            toward = minus(vector(lamp[j]), point)
            way = unit(toward)
            falls = loop_dot(way, upward)
            if falls <= 0:
                continue
            a2 = alpha2[k] + WIDER * area[j] / loop_dot(toward, toward)
            half = unit(plus_scaled(way, -1.0, back))
            up, along = loop_dot(half, upward), -loop_dot(half, back)
            spread = a2 / (up * up * (a2 - 1) + 1) ** 2  # of the normals, times pi
            falls = max(falls, GRAZING)
            smith = 0.5 / (
                falls * np.sqrt(sees * sees * (1 - a2) + a2)
                + sees * np.sqrt(falls * falls * (1 - a2) + a2)
            )
            total[k, 0] += own * spread * smith
            total[k, 1] += own * spread * smith * _fresnel_rise(along, index[k])
    return total


@compiled_loop
def _fresnel_rise(cosine: float, index: float) -> float:
    """How far reflection has risen from that at normal incidence, 0, to 1, as at grazing.

    Of a dielectric of an index by Fresnel's equations, unpolarised; without one by Schlick.
    """
    if index >= NO_DIELECTRIC:
        return (1 - cosine) ** 5
    inner = np.sqrt(index * index - 1 + cosine * cosine)
    across = (cosine - inner) / (cosine + inner)
    along = (index * index * cosine - inner) / (index * index * cosine + inner)
    normal = ((index - 1) / (index + 1)) ** 2
    rise: float = ((across * across + along * along) / 2 - normal) / (1 - normal)
    return rise
