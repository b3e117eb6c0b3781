"""Coverage of every virtual camera of simulated builds: exact, for cells of any topology."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.reflection import reflect, reflected_rays
from tbcad.tolerancing.montecarlo.cell_edges import CROSSINGS, MISS_SQUARED, trace_cell_edges
from tbcad.tolerancing.montecarlo.draws import ShellDraws
from tbcad.tolerancing.montecarlo.edge_model import (
    APEX,
    CURVATURE,
    NORMAL,
    EdgeModel,
    EdgeModels,
    form_tables,
    surface_tables,
    view_tables,
)
from tbcad.types import Bools, Floats, Ints


@dataclass(frozen=True)
class MirrorCoverage:
    """Coverage of m mirrors of one half in s builds."""

    # twice the minimum distance from the object's centre of all rays camera -> edge of the cell ->
    # reflected (DESIGN.md section 2), mm; inf where there is no edge, (s, m)
    diameter: Floats
    # how often the image of the cell's outline crosses a half line from the object's centre: an odd
    # number where it surrounds the centre, (s, m)
    crossings: Ints


def mirror_coverage(half: EdgeModel, draws: ShellDraws, worst_only: bool = False) -> MirrorCoverage:
    """Coverage of each mirror of one half, for s builds; see `trace_cell_edges` for worst_only."""
    outlines = np.empty((len(draws), len(half), 2))
    surfaces, views = surface_tables(half, draws), view_tables(half, draws)
    forms, faces = form_tables(half, draws), half.pairs
    pairs = faces.pair, faces.offset, faces.face, faces.reach
    mirrors, out = surfaces[:, : len(half)], draws.valley[:, None]
    mirrors[..., APEX] += out[..., None] * mirrors[..., NORMAL]
    mirrors[..., CURVATURE] /= 1 + out * mirrors[..., CURVATURE]
    for build in range(len(draws)):
        tables = surfaces, forms, views
        if build > 0 and all(np.array_equal(one[build - 1], one[build]) for one in tables):
            outlines[build] = outlines[build - 1]
            continue
        outlines[build] = trace_cell_edges(
            surfaces[build], forms[build], pairs, half.halved, views[build], half.screen,
            worst_only,
        )  # fmt: skip
    crossings = outlines[..., CROSSINGS].astype(np.int64)
    return MirrorCoverage(2 * np.sqrt(outlines[..., MISS_SQUARED]), crossings)


def virtual_camera_numbers(halved: Bools) -> Ints:
    """Number of each mirror's virtual camera, a's mirrors, then b's, (2 m,).

    The two halves of a mirror on the seam, halved (m,), share one virtual camera; mirror i of
    camera b is mirror i of camera a reflected in the plane x = 0.
    """
    of_a = np.arange(len(halved))
    separate = len(halved) + np.cumsum(~halved) - 1
    return np.concatenate([of_a, np.where(halved, of_a, separate)])


def coverage(
    edge_models: EdgeModels, draws: tuple[ShellDraws, ShellDraws], worst_only: bool = False
) -> Floats:
    """Exact coverage diameter of v virtual cameras in s builds, mm, (s, v).

    Of the halves of a mirror on the seam the smaller counts. A mirror without a cell, or whose
    image does not surround the object's centre, covers nothing. With worst_only, which takes less
    time, only the minimum of each build is exact, the others are not below theirs.
    """
    camera = virtual_camera_numbers(edge_models[1].halved)
    shape = (len(draws[0]), int(camera.max()) + 1)
    diameter, crossings = np.full(shape, np.inf), np.zeros(shape, int)
    for half, drawn, of_half in zip(edge_models, draws, np.split(camera, 2), strict=True):
        seen, place = mirror_coverage(half, drawn, worst_only), np.s_[:, of_half]
        of_mirrors = seen.diameter - drawn.facets[:, None]
        diameter[place] = np.minimum(diameter[place], of_mirrors)
        crossings[place] += seen.crossings
    surrounds = (crossings % 2 == 1) & np.isfinite(diameter)
    return np.where(surrounds, np.maximum(diameter, 0.0), 0.0)


def pointing(edge_model: EdgeModel, draws: ShellDraws) -> Floats:
    """How far the ray of each mirror's centre pixel is off at the object, mm, (s, m).

    The centre pixel shows the apex, and its designed ray goes through the object's centre, for a
    mirror on the seam past it. A pixel is a fixed place on the sensor: moved and tilted cameras and
    wrong focal lengths count. It is the distance of the ray of s builds after the mirror from the
    point where the designed one is nearest to the object's centre; NaN where it misses the sphere.
    """
    pinhole, middle, scale, _ = np.moveaxis(view_tables(edge_model, draws)[:, :, None], 1, 0)
    ray = _pixel_rays(edge_model, draws)
    mirrors = surface_tables(edge_model, draws)[:, : len(edge_model)]
    point, normal = _entry(mirrors, pinhole / scale, ray / scale)
    out = reflect(unit(ray), unit(normal / scale))
    designed = reflected_rays(edge_model.view.pinhole, edge_model.apex, unit(edge_model.normal))
    nearest = edge_model.apex - dot(edge_model.apex, designed)[:, None] * designed
    shells = [Rotation.from_rotvec(turn) for turn in draws.shell_tilt]
    aim = middle + np.stack([shell.apply(nearest, inverse=True) for shell in shells])
    return norm(np.cross(point * scale - aim, out))


def _pixel_rays(edge_model: EdgeModel, draws: ShellDraws) -> Floats:
    """Rays (s, m, 3) of the same pixels in built cameras, in the frame of the shell."""
    shell = Rotation.from_rotvec(draws.shell_tilt)
    camera = Rotation.from_rotvec(draws.camera_tilt)
    built = [shell.apply(camera.apply(one), inverse=True) for one in edge_model.view.axes]
    axes = np.stack(built)[:, :, None]
    designed = (edge_model.apex - edge_model.view.pinhole) @ edge_model.view.axes.T
    right, down, forward = designed[..., None].swapaxes(0, 1)
    focal = draws.focal[:, None, None] * forward
    return np.asarray(axes[2] + axes[0] * right / focal + axes[1] * down / focal)


def _entry(table: Floats, origin: Floats, ray: Floats) -> tuple[Floats, Floats]:
    """Points where rays enter surfaces (s, m, 7), and normals: see light.simulate.scene.rays."""
    apex, normal, curvature = table[..., APEX], table[..., NORMAL], table[..., CURVATURE, None]
    offset = origin - apex
    c = dot(normal + curvature / 2 * offset, offset)
    b = dot(normal + curvature * offset, ray)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b * b - 2 * curvature[..., 0] * c * dot(ray, ray))
    point = origin + (2 * c / (root - b))[..., None] * ray
    return point, normal + curvature * (point - apex)
