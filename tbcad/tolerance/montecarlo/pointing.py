"""Pointing errors of uncalibrated builds: rays that are assumed to be the designed ones."""

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.optics.reflection import reflect, reflected_rays
from tbcad.tolerance.montecarlo.draws import ShellDraws
from tbcad.tolerance.montecarlo.edge_model import (
    APEX,
    CURVATURE,
    NORMAL,
    EdgeModel,
    surface_tables,
    view_tables,
)
from tbcad.types import Floats


def pointing(edge_model: EdgeModel, draws: ShellDraws) -> tuple[Floats, Floats]:
    """Errors of the ray of each mirror's centre pixel, for s builds of one edge_model.

    The centre pixel shows the apex, and its designed ray goes through the object's centre, for a
    mirror on the seam past it. A pixel is a fixed place on the sensor: moved and tilted cameras and
    wrong focal lengths count.

    Returns:
        Angle between the designed and the built ray after the mirror, radians, and distance of the
        built ray from the point where the designed one is nearest to the object's centre, mm,
        (s, m) each; NaN where it misses the sphere.
    """
    pinhole, middle, scale, *axes = np.moveaxis(view_tables(edge_model, draws)[:, :, None], 1, 0)
    ray = _pixel_rays(edge_model, draws, axes)
    mirrors = surface_tables(edge_model, draws)[:, : len(edge_model)]
    point, normal = _entry(mirrors, pinhole / scale, ray / scale)
    out = reflect(unit(ray), unit(normal / scale))
    designed = reflected_rays(edge_model.view.pinhole, edge_model.apex, unit(edge_model.normal))
    nearest = edge_model.apex - dot(edge_model.apex, designed)[:, None] * designed
    shells = [Rotation.from_rotvec(turn) for turn in draws.shell_tilt]
    aim = middle + np.stack([shell.apply(nearest, inverse=True) for shell in shells])
    offset = norm(np.cross(point * scale - aim, out))
    built = np.stack([shell.apply(rays) for shell, rays in zip(shells, out, strict=True)])
    return np.arctan2(norm(np.cross(built, designed)), dot(built, designed)), offset


def _pixel_rays(edge_model: EdgeModel, draws: ShellDraws, axes: list[Floats]) -> Floats:
    """Rays (s, m, 3) of the same pixels in built cameras, whose axes are three of (s, 1, 3)."""
    designed = (edge_model.apex - edge_model.view.pinhole) @ edge_model.view.axes.T
    right, down, forward = designed[..., None].swapaxes(0, 1)
    focal = draws.focal[:, None, None] * forward
    return np.asarray(axes[2] + axes[0] * right / focal + axes[1] * down / focal)


def _entry(table: Floats, origin: Floats, ray: Floats) -> tuple[Floats, Floats]:
    """Points where rays enter surfaces (s, m, 7), and normals: see tbcad.simulate.scene.rays."""
    apex, normal, curvature = table[..., APEX], table[..., NORMAL], table[..., CURVATURE, None]
    offset = origin - apex
    c = dot(normal + curvature / 2 * offset, offset)
    b = dot(normal + curvature * offset, ray)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b * b - 2 * curvature[..., 0] * c * dot(ray, ray))
    point = origin + (2 * c / (root - b))[..., None] * ray
    return point, normal + curvature * (point - apex)
