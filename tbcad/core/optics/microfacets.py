"""How a rough surface reflects a lamp that is seen as a rectangle: microfacets after GGX, exactly.

Normals of microfacets have slopes s with the density 1 / (pi alpha^2 (1 + s^2 / alpha^2)^2) (B.
Walter and others, Microfacet Models for Refraction, EGSR 2007, by dw cos / ds = cos^4). Those that
reflect a lamp are a piece of the plane of slopes. By Gauss's theorem the share of normals in it is
a sum over its edges, closed for straight ones: with d the distance of an edge's line from the
origin and t the places of its ends along it, in units of alpha, and D^2 = 1 + d^2, an edge gives
d / (2 pi D) (atan(t2 / D) - atan(t1 / D)). Without roughness that is the whole lamp or nothing.
"""

import numpy as np

from tbcad.common.compiled import compiled_part
from tbcad.core.geometry.loop_vectors import (
    Vector,
    cross,
    divided,
    dot,
    minus,
    plus_scaled,
    reflect,
    scaled,
    unit,
)

Axes = tuple[Vector, Vector, Vector]
Face = tuple[Vector, Vector, Vector]  # middle and two half sides, mm

NO_DIELECTRIC = 1e9  # index of refraction of what reflects as metals do
# Distance in the plane of slopes, in radii of a face, from which the face's middle will do.
FAR = 3.0
LEAST_RISE = 1e-6  # of a half vector above the surface


@compiled_part
def axes_about(normal: Vector) -> Axes:
    """Two unit vectors across a unit normal, and the normal."""
    sign = 1.0 if normal[2] >= 0 else -1.0
    a = -1.0 / (sign + normal[2])  # T. Duff and others, JCGT 6(1), 2017
    b = normal[0] * normal[1] * a
    first = (1.0 + sign * normal[0] * normal[0] * a, sign * b, -sign * normal[0])
    return first, (b, sign + normal[1] * normal[1] * a, -normal[1]), normal


@compiled_part
def reflected_face(
    face: Face, axes: Axes, place: Vector, back: Vector, alpha2: float, index: float
) -> tuple[float, float]:
    """Light of a face of unit exitance off a place: to be multiplied by F0, and by 1 - F0.

    1 is what a matt white surface gives back of an even sky of that luminance. `axes` of the
    surface, `back`: the unit direction of the ray that meets it; alpha2 is GGX's alpha squared.
    """
    normal, sees = axes[2], -dot(back, axes[2])
    toward = minus(face[0], place)
    square = dot(toward, toward)
    half = unit(minus(divided(toward, np.sqrt(square)), back))
    up, along = dot(half, normal), -dot(half, back)
    size2 = (dot(face[1], face[1]) + dot(face[2], face[2])) / square
    slope2, size2 = 1 / (up * up) - 1, size2 / (2 * along * up * up) ** 2
    if up <= 0 or sees <= 0:
        return 0.0, 0.0
    if slope2 + alpha2 > FAR * FAR * size2:
        density = alpha2 / (np.pi * (alpha2 + slope2) ** 2)
        share = density * _solid_angle(face, toward, square) / (4 * along * up**3)
    else:
        share = _lobe_share(face, axes, place, back, np.sqrt(alpha2))
        toward = plus_scaled(
            toward, size2 / (size2 + alpha2), _brightest(face, normal, place, back)
        )
    way = unit(toward)
    falls = dot(way, normal)
    if falls <= 0:
        return 0.0, 0.0
    half = unit(minus(way, back))
    up, along = dot(half, normal), -dot(half, back)
    smith = 2 / (  # G2 / (cos i cos o)
        falls * np.sqrt(sees * sees * (1 - alpha2) + alpha2)
        + sees * np.sqrt(falls * falls * (1 - alpha2) + alpha2)
    )
    light = share * smith * falls * along / up
    return light, light * fresnel_rise(along, index)


@compiled_part
def _brightest(face: Face, normal: Vector, place: Vector, back: Vector) -> Vector:
    """From a face's middle to what a smooth surface shows, or to what of the face is next to it."""
    mirrored, across = reflect(back, normal), cross(face[1], face[2])
    far = dot(minus(face[0], place), across) / dot(mirrored, across)
    if not far > 0:
        return 0.0, 0.0, 0.0
    beside = minus(plus_scaled(place, far, mirrored), face[0])
    u = dot(beside, face[1]) / dot(face[1], face[1])
    v = dot(beside, face[2]) / dot(face[2], face[2])
    first = scaled(min(max(u, -1.0), 1.0), face[1])
    return plus_scaled(first, min(max(v, -1.0), 1.0), face[2])


@compiled_part
def _solid_angle(face: Face, toward: Vector, square: float) -> float:
    """Of a small face, sr."""
    angle: float = 4 * abs(dot(cross(face[1], face[2]), toward)) / (square * np.sqrt(square))
    return angle


@compiled_part
def _lobe_share(face: Face, axes: Axes, place: Vector, back: Vector, alpha: float) -> float:
    """Share of the normals, by their area on the surface, that reflect a face."""
    total = 0.0
    x0, y0 = _slope(face, -1.0, -1.0, axes, place, back, alpha)
    px, py = x0, y0
    for k in range(1, 5):
        if k == 4:
            qx, qy = x0, y0
        else:
            qx, qy = _slope(
                face, 1.0 if k < 3 else -1.0, 1.0 if k > 1 else -1.0, axes, place, back, alpha
            )
        ex, ey = qx - px, qy - py
        length = np.sqrt(ex * ex + ey * ey)
        if length > 0:
            d = (px * qy - py * qx) / length
            away2 = 1 + d * d
            first, last = (px * ex + py * ey) / length, (qx * ex + qy * ey) / length
            away = np.sqrt(away2)
            total += d / away * np.arctan2(length * away, away2 + first * last)
        px, py = qx, qy
    share: float = abs(total) / (2 * np.pi)
    return share


@compiled_part
def _slope(
    face: Face, u: float, v: float, axes: Axes, place: Vector, back: Vector, alpha: float
) -> tuple[float, float]:
    """Slope, over alpha, of the normals that reflect a corner of a face."""
    corner = plus_scaled(plus_scaled(face[0], u, face[1]), v, face[2])
    half = minus(unit(minus(corner, place)), back)
    rise = alpha * max(dot(half, axes[2]), LEAST_RISE)
    return dot(half, axes[0]) / rise, dot(half, axes[1]) / rise


@compiled_part
def fresnel_rise(cosine: float, index: float) -> float:
    """How far reflection has risen from that at normal incidence, 0, to 1, as at grazing.

    Of a dielectric of an index by Fresnel's equations, unpolarised; without one by C. Schlick,
    Computer Graphics Forum 13, 1994, which lacks up to a fifth of a dielectric's.
    """
    if index >= NO_DIELECTRIC:
        return (1 - cosine) ** 5
    inner = np.sqrt(index * index - 1 + cosine * cosine)
    across = (cosine - inner) / (cosine + inner)
    along = (index * index * cosine - inner) / (index * index * cosine + inner)
    normal = ((index - 1) / (index + 1)) ** 2
    rise: float = ((across * across + along * along) / 2 - normal) / (1 - normal)
    return rise
