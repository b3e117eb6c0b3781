"""Light with cast shadows, lamp by lamp, at the corners of an object.

Facets are cut so small that shadows between corners are sharp to `SHADOW_MM`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import norm
from tbcad.core.geometry.vectors import unit as unit_rows
from tbcad.core.optics.lamp_light import RectangularLamps, lambertian
from tbcad.core.optics.mirror_light import MM2, Lamps
from tbcad.light.simulate.scene.lamps import EXPOSED, free_rays
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.types import Bools, Floats, Ints

SHADOW_MM = 1.0  # longest side of a facet that is lit by its corners alone
MOST_FACETS = 400_000  # into which facets are cut at most
SAME = 1e-6  # of corners that are one, mm, and of their normals
LIFT_MM = 0.02  # of corners above the surface, where rays toward lamps begin
FAR_MM = 1e6  # of lamps that are a direction
SKY_RAYS = 96  # directions by which it is found how much of the mirrors' light reaches a corner
SUN = 0.00825  # side of a square as large as the sun, seen from far: of lamps that are a direction
LED_MM = 2.66  # side of a square as large as a lit dome of 3 mm

Lit = Callable[[Floats, Floats], Floats]
"""Light (n,) without shadows on points (n, 3) with unit normals (n, 3)."""


@dataclass(frozen=True)
class Source:
    """What shines from one place: a lamp, or a part of one."""

    place: Floats  # mm, (3,)
    light: Lit
    sides: Floats  # half sides of its face, mm, (2, 3)
    exitance: float  # of its face, lux: pi times its luminance


@dataclass(frozen=True)
class CastLight:
    """Light at corners (v,), outside and behind, as shares of what is shown as white."""

    shown: NDArray[np.float32]  # exitance of each of l sources, 0 where it is hidden, (v, 2, l)
    total: Floats  # light on corners, (v, 2)
    rest: Floats  # of all that is no lamp, (v, 2)
    face: Floats  # of the sources: place and half sides, mm, (l, 9)
    white: float  # light that is shown as white


def lamp_sources(lamps: RectangularLamps) -> list[Source]:
    """The tiles of a prototype's lamps, and its LEDs above, lux."""
    places, facing, candela = lamps.sources()
    sides = [*lamps.tile_sides(), *(square_sides(way, LED_MM) for way in -unit_rows(lamps.leds))]
    each = zip(places, facing, candela, strict=True)
    return [_source(one, half) for one, half in zip(each, sides, strict=True)]


def led_sources(lamps: Lamps) -> list[Source]:
    """The LEDs of a shell's cameras, straight onto the object, lux."""
    each = zip(lamps.places, lamps.normals, lamps.candela, strict=True)
    return [_source(one, square_sides(one[1], LED_MM)) for one in each]


def _source(one: tuple[Floats, Floats, float], sides: Floats) -> Source:
    """A small Lambertian face at a place, its normal and candela along it, with half sides."""
    place, facing, candela = one
    area = float(4 * np.linalg.norm(np.cross(*sides)))
    light = partial(lambertian, place[None], facing[None], np.array([candela]))
    return Source(place, light, sides, np.pi * MM2 * candela / area)


def square_sides(normal: Floats, side: float) -> Floats:
    """Half sides (2, 3) of a square with a unit normal (3,)."""
    first = unit_rows(np.cross(np.eye(3)[np.abs(normal).argmin()], normal))
    return side / 2 * np.stack([first, np.cross(normal, first)])


def direction_sources(directions: Floats, weights: Floats) -> list[Source]:
    """Lamps far away, in unit directions (l, 3), that give weights (l,) to what faces them."""

    def light(way: Floats, weight: float) -> Lit:
        return lambda _, normals: weight * np.maximum(normals @ way, 0.0)

    return [
        Source(FAR_MM * way, light(way, w), square_sides(way, SUN * FAR_MM), np.pi * w / SUN**2)
        for way, w in zip(directions, weights.tolist(), strict=True)
    ]


def cast_light(
    embree: Any, subject: SceneObject, sources: list[Source], rest: Lit, white: float | None
) -> CastLight:
    """Light on an object's corners with the shadows that it casts on itself.

    `rest` is light of no lamp. `white`: what is shown as white; None: that of a good exposure.
    """
    shown = np.zeros((len(subject.points), 2, len(sources)), dtype=np.float32)
    total, even = np.zeros((2, len(subject.points), 2))
    for side, sign in enumerate((1.0, -1.0)):
        normals = sign * subject.normals
        start = subject.points + LIFT_MM * normals
        for k, source in enumerate(sources):
            own = source.light(subject.points, normals)
            lit = np.flatnonzero(own > 0)
            lit = lit[unhidden(embree, start[lit], source.place)]
            total[lit, side] += own[lit]
            shown[lit, side, k] = source.exitance
        even[:, side] = rest(subject.points, normals)
    total += even
    if white is None:
        front, back = np.percentile(total, EXPOSED, axis=0)
        white = float(front or back) or 1.0
    face = np.array([[source.place, *source.sides] for source in sources]).reshape(-1, 9)
    return CastLight(shown / np.float32(white), total / white, even / white, face, white)


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
