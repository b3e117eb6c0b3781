"""Where rays go that are taken for the designed ones: what an uncalibrated machine gets wrong."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.tolerance.montecarlo.draws import Draws
from tbcad.tolerance.montecarlo.edge_model import EdgeModel, axes, places, tables
from tbcad.types import Floats


@dataclass(frozen=True)
class Pointing:
    """How far the ray of each mirror's middle pixel is off, of s machines.

    The middle pixel shows the apex, and its ray, as designed, goes through the object's middle.

    Attributes:
        angle: between the designed and the made ray after the mirror, radians, (s, m).
        offset: distance of the made ray from the object's middle, mm, (s, m).
    """

    angle: Floats
    offset: Floats


def pointing(half: EdgeModel, draws: Draws) -> Pointing:
    """Errors of the rays of one half's middle pixels, for s machines.

    A pixel is where it is on the sensor: moved and turned cameras and wrong focal lengths count.
    NaN where the ray passes the mirror's sphere by.
    """
    pinhole, middle, scale, *camera = np.moveaxis(places(half, draws)[:, :, None], 1, 0)
    way = _ways(half, draws, camera)
    point, normal = _hit(tables(half, draws)[:, : len(half)], pinhole / scale, way / scale)
    out = _mirrored(way, normal / scale)
    offset = norm(np.cross(point * scale - middle, out))
    designed = _mirrored(_rays(half), half.table[: len(half), 3:6])
    made = np.stack(list(map(_turned, draws.shell_tilt, out)))
    return Pointing(np.arctan2(norm(np.cross(made, designed)), dot(made, designed)), offset)


def _rays(half: EdgeModel) -> Floats:
    """From the pinhole to the apices as designed, (m, 3)."""
    result: Floats = half.table[: len(half), :3] - half.view.pinhole
    return result


def _ways(half: EdgeModel, draws: Draws, camera: list[Floats]) -> Floats:
    """Rays of the same pixels of the made cameras, whose axes are three of (s, 1, 3), (s, m, 3)."""
    across, down, depth = (_rays(half) @ axes(half.view).T)[..., None].swapaxes(0, 1)
    focal = draws.focal[:, None, None] * depth
    result: Floats = camera[2] + camera[0] * across / focal + camera[1] * down / focal
    return result


def _hit(table: Floats, origin: Floats, way: Floats) -> tuple[Floats, Floats]:
    """Where rays enter surfaces (s, m, 7), and the normals there: see tbcad.simulate.scene.rays."""
    apex, normal, curvature = table[..., :3], table[..., 3:6], table[..., 6:]
    away = origin - apex
    c = dot(normal + curvature / 2 * away, away)
    b = dot(normal + curvature * away, way)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b * b - 2 * curvature[..., 0] * c * dot(way, way))
    point = origin + (2 * c / (root - b))[..., None] * way
    return point, normal + curvature * (point - apex)


def _mirrored(ray: Floats, normal: Floats) -> Floats:
    ray, normal = unit(ray), unit(normal)
    result: Floats = ray - 2 * dot(ray, normal)[..., None] * normal
    return result


def _turned(turn: Floats, vectors: Floats) -> Floats:
    result: Floats = Rotation.from_rotvec(turn).apply(vectors)
    return result
