"""Light of small lamps that convex mirrors throw onto an object, and that falls on it directly.

A lamp near a pinhole is shown by every mirror near its virtual camera, so surfaces are lit from
every direction that is viewed. Light is followed by the exact reflection of each sphere, once;
light that has met two mirrors is left out, and so is what one mirror takes from another.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tbcad.common.compiled import compiled_loop, compiled_part
from tbcad.common.reuse import kept
from tbcad.core.geometry.loop_vectors import Vector, divided, dot, minus, plus_scaled, unit, vector
from tbcad.core.optics.lamp_light import lambertian
from tbcad.core.optics.surfaces import Surfaces
from tbcad.types import Floats, Ints

STEPS = 20  # at most, of the search for a point of reflection; each gains a digit or so
SETTLED = 1e-20  # square of a step of the unit normal, of which less than a tenth is left to go
# Of each mirror, which of its neighbours' spheres may cover it: more than any cell has sides.
NEIGHBOURS = 14
ROUNDING_MM2 = 1e-9  # of the power of a point that is on two spheres
MM2 = 1e6  # in a square metre
REFLECTED = 0.85  # of aluminised mirrors: 0.88 to 0.92 where clean, by makers' curves; assumed less


@dataclass(frozen=True)
class Lamps:
    """Small flat lamps, brightest along their normals: as the cosine (Lambert)."""

    places: Floats  # mm, (l, 3)
    normals: Floats  # unit, (l, 3)
    candela: Floats  # along the normals, (l,)


@dataclass(frozen=True)
class LitMirrors:
    """The spheres of an array in whose cells lamps are reflected: m of them, on one side of x."""

    centre: Floats  # mm, (m, 3)
    radius: Floats  # mm, (m,)
    neighbours: Ints  # that may cover parts of each, (m, k)
    side: float  # sign of x where the mirrors are
    foot: float  # z below which there are none, mm


def lit_mirrors(mirrors: Surfaces, side: float, foot: float) -> LitMirrors:
    """Spherical mirrors as lamps are reflected in them."""
    count = min(NEIGHBOURS, len(mirrors) - 1)
    _, nearest = cKDTree(mirrors.apex).query(mirrors.apex, count + 1)
    others = np.asarray(nearest)[:, 1:]
    return LitMirrors(mirrors.centre, mirrors.radius, others, side, foot)


@compiled_part
def reflection(centre: Vector, radius: float, lamp: Vector, place: Vector) -> tuple[Vector, float]:
    """Point of a sphere that reflects a lamp to a place, and how far its light spreads, mm2.

    That is the area that a unit of solid angle of the lamp falls on, across the ray. With the
    curvatures 1/s + 2/(r cos i) in the plane of incidence and 1/s + 2 cos i/r across it, of light
    that has gone s from the lamp, it is s^2 (1 + t c1) (1 + t c2) after t more; infinite in the
    sphere's shadow. The point is found as by `tbcad.core.optics.reflection.reflection_points`.
    """
    normal = unit(minus(lamp, centre))
    for _ in range(STEPS):
        point = plus_scaled(centre, radius, normal)
        to_lamp, to_place = minus(lamp, point), minus(place, point)
        s, t = np.sqrt(dot(to_lamp, to_lamp)), np.sqrt(dot(to_place, to_place))
        bisector = plus_scaled(divided(to_lamp, s), 1 / t, to_place)
        before = normal
        normal = unit(plus_scaled(unit(bisector), radius / 2 * (1 / s + 1 / t), before))
        change = minus(normal, before)
        if dot(change, change) < SETTLED:
            break
    outward = minus(point, centre)
    if dot(outward, to_lamp) <= 0 or dot(outward, to_place) <= 0:
        return point, np.inf
    cosine = dot(normal, to_lamp) / s
    within, aside = 1 / s + 2 / (radius * cosine), 1 / s + 2 * cosine / radius
    return point, s**2 * (1 + t * within) * (1 + t * aside)


@kept("light")
def light_by_mirrors(
    lamps: Lamps, mirrors: LitMirrors, places: Floats, normals: Floats, hidden: float = 0.0
) -> Floats:
    """Irradiance (k,) of surfaces at places (k, 3) with unit normals (k, 3), lux.

    All that lamps send is reflected; an object of a radius `hidden` (mm) about the origin stands in
    the light on its way to the mirrors, and only its horizon on the way back.
    """
    lamp = np.column_stack([lamps.places, lamps.normals, lamps.candela])
    spheres = np.column_stack([mirrors.centre, mirrors.radius])
    ends = np.array([mirrors.side, mirrors.foot, hidden**2])
    surfaces = np.column_stack([places, normals]).astype(np.float64)
    return np.asarray(MM2 * _reflected_light(lamp, spheres, mirrors.neighbours, ends, surfaces))


def direct_light(lamps: Lamps, places: Floats, normals: Floats) -> Floats:
    """Irradiance (k,) of surfaces at places (k, 3) with unit normals (k, 3), lux; no shadows."""
    return lambertian(lamps.places, lamps.normals, lamps.candela, places, normals)


@compiled_loop
def _reflected_light(
    lamps: Floats, spheres: Floats, neighbours: Ints, ends: Floats, surfaces: Floats
) -> Floats:
    light = np.zeros(len(surfaces))
    for i in range(len(spheres)):
        centre, radius = vector(spheres[i]), spheres[i, 3]
        for k in range(len(surfaces)):
            place, normal = vector(surfaces[k]), vector(surfaces[k], 3)
            if dot(minus(centre, place), normal) + radius <= 0:
                continue  # all of the sphere is below the surface's horizon
            for j in range(len(lamps)):
                back, lux = _shone(i, lamps[j], spheres, neighbours, ends, place)
                light[k] += lux * max(dot(back, normal), 0.0)
    return light


def light_of_mirrors(lamps: Lamps, mirrors: LitMirrors, places: Floats) -> Floats:
    """Irradiance (m, k) by each mirror of faces at places (k, 3) that are turned to it, lux."""
    lamp = np.column_stack([lamps.places, lamps.normals, lamps.candela])
    spheres = np.column_stack([mirrors.centre, mirrors.radius])
    ends = np.array([mirrors.side, mirrors.foot, 0.0])
    return np.asarray(MM2 * _light_of_mirrors(lamp, spheres, mirrors.neighbours, ends, places))


@compiled_loop
def _light_of_mirrors(
    lamps: Floats, spheres: Floats, neighbours: Ints, ends: Floats, places: Floats
) -> Floats:
    light = np.zeros((len(spheres), len(places)))
    for i in range(len(spheres)):
        for k in range(len(places)):
            for j in range(len(lamps)):
                light[i, k] += _shone(i, lamps[j], spheres, neighbours, ends, vector(places[k]))[1]
    return light


@compiled_part
def _shone(
    i: int, row: Floats, spheres: Floats, neighbours: Ints, ends: Floats, place: Vector
) -> tuple[Vector, float]:
    """Unit direction from a place to a lamp's light by mirror i, and what it gives across that."""
    lamp = vector(row)
    point, spread = reflection(vector(spheres[i]), spheres[i, 3], lamp, place)
    way, back = minus(point, lamp), unit(minus(point, place))
    leaves = dot(way, vector(row, 3))
    if leaves <= 0 or spread == np.inf or not _in_cell(i, point, spheres, neighbours, ends):
        return back, 0.0
    if _passes(lamp, way) < ends[2]:
        return back, 0.0
    return back, row[6] * leaves / np.sqrt(dot(way, way)) / spread


@compiled_part
def _in_cell(i: int, point: Vector, spheres: Floats, neighbours: Ints, ends: Floats) -> bool:
    """Whether a point of sphere i is on its side, above the foot and in no other sphere."""
    if point[0] * ends[0] < 0 or point[2] < ends[1]:
        return False
    for other in neighbours[i]:
        away = minus(point, vector(spheres[other]))
        if dot(away, away) < spheres[other, 3] ** 2 - ROUNDING_MM2:
            return False
    return True


@compiled_part
def _passes(start: Vector, way: Vector) -> float:
    """Square of the distance from the origin at which a way from a point passes, mm2."""
    share = min(max(-dot(start, way) / dot(way, way), 0.0), 1.0)
    nearest = plus_scaled(start, share, way)
    return dot(nearest, nearest)
