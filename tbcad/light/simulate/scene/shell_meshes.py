"""The meshes of a build: facets say which mirror a ray meets, spheres fitted to them where it goes.

A facet reflects like a flat mirror, which deflects rays by some 2 mm at the object
(docs/decisions/0003). Its vertices lie on the sphere, though, so the ray is reflected by the
sphere through the vertices of the mirror's facets.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from tbcad.cad.formats.checked_files import REBUILD
from tbcad.core.geometry.vectors import dot, facet_vectors, norm, perpendicular_axes
from tbcad.core.optics.surfaces import Surfaces
from tbcad.errors import InputError
from tbcad.light.simulate.scene.ray_casting import embree_scene
from tbcad.light.simulate.scene.rays import (
    MirrorNumbers,
    TracedRays,
    pixel_directions,
    reflect_pixels,
)
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.types import Floats, Ints

MAX_FILE_BYTES = 4 << 30  # bytes
# Mirrors whose apices are nearest to a facet, out of which the one it lies on is found.
CANDIDATE_MIRRORS = 8
# Corners of a facet lie on its mirror but for what float32 in the file leaves.
ON_MIRROR_MM = 1e-3
# Facets of a mirror lie along it within a few degrees, walls at its rim nearly across.
MIN_FACET_COSINE = 0.9


@dataclass(frozen=True)
class ShellMeshes:
    """Both shells' facets."""

    # number of the mirror that each facet is of, from 1; less than 0 for those of camera b; 0 for
    # none, (f,)
    mirror: MirrorNumbers
    embree: Any  # the facets, committed
    # of camera a's and of camera b's mirrors, recovered from the facets, coat on
    surfaces: tuple[Surfaces, Surfaces]


def read_shell_meshes(export: ExportedDesign) -> ShellMeshes:
    """Read both shells' STL files.

    InputError: they are not there, cannot be read, or lack mirrors.
    """
    coat = export.spec.mirrors.coating_um / 1000
    corners, owners, surfaces = [], [], []
    for reflector, sign in zip(export.reflectors, (1, -1), strict=True):
        path = export.folder / f"shell_{reflector.camera_id}.stl"
        facets = read_facets(path)
        owner = facet_owners(reflector.mirrors.offset(-coat), facets)
        if len(missing := np.setdiff1d(np.arange(len(reflector)), owner)):
            raise InputError(f"{path} has no facets of {len(missing)} recorded mirrors: {REBUILD}")
        corners.append(facets)
        owners.append(sign * (owner + 1))
        surfaces.append(fitted_surfaces(reflector.mirrors, facets, owner).offset(coat))
    mirror = np.concatenate(owners).astype(np.int32)
    return ShellMeshes(mirror, embree_scene(np.concatenate(corners)), (surfaces[0], surfaces[1]))


def mesh_tracer(
    shells: ShellMeshes, reflector: Reflector
) -> Callable[[range, tuple[float, float]], TracedRays]:
    """A function that traces rows of a camera's pixels off the mirrors of the mesh."""
    sign, surfaces = (
        (1, shells.surfaces[0]) if reflector.camera_id == "a" else (-1, shells.surfaces[1])
    )

    def trace(rows: range, shift: tuple[float, float]) -> TracedRays:
        direction = pixel_directions(reflector.camera, rows, shift)
        start = np.empty((direction.shape[0] * direction.shape[1], 3), dtype=np.float32)
        start[:] = reflector.camera.pinhole
        facet = np.asarray(shells.embree.run(start, direction.reshape(-1, 3).astype(np.float32)))
        mirror = np.where(facet >= 0, np.maximum(sign * shells.mirror[facet], 0), 0)
        numbers = mirror.reshape(direction.shape[:2]).astype(np.int32)
        return reflect_pixels(reflector.camera.pinhole, direction, surfaces, numbers)

    return trace


def fitted_surfaces(nominal: Surfaces, corners: Floats, owner: Ints) -> Surfaces:
    """The surfaces (m,) that fit the corners (f, 3, 3) of facets of owners (f,) best; -1: none.

    In a frame with z along the nominal normal, at the nominal apex, a surface is
    z = h + a x + b y - k/2 (x^2 + y^2 + z^2): least squares in (h, a, b, k), spheres and planes
    alike. Each facet's corners count, so vertices count by the facets about them.
    """
    owned = owner >= 0
    i = np.repeat(owner[owned], 3)
    axes = perpendicular_axes(nominal.normal)
    frames = np.concatenate([axes, nominal.normal[:, None]], axis=1)
    local = np.einsum("nkx,nx->nk", frames[i], corners[owned].reshape(-1, 3) - nominal.apex[i])
    terms = np.column_stack([np.ones(len(i)), local[:, :2], -(local**2).sum(axis=1) / 2])
    products = np.einsum("nj,nk->njk", terms, np.column_stack([terms, local[:, 2]]))
    sums = np.zeros((len(nominal), 4, 5))
    np.add.at(sums, i, products)
    h, a, b, k = np.linalg.solve(sums[:, :, :4], sums[:, :, 4:])[..., 0].T
    slope = np.stack([-a, -b, np.ones_like(a)], axis=1)
    steep = (slope**2).sum(axis=1)
    size = np.sqrt(steep + 2 * k * h)
    foot = (2 * h / (steep + np.sqrt(steep) * size))[:, None] * slope
    normal = (slope + k[:, None] * foot) / size[:, None]
    back = np.swapaxes(frames, 1, 2)
    apex = nominal.apex + np.einsum("mxk,mk->mx", back, foot)
    return Surfaces(apex, np.einsum("mxk,mk->mx", back, normal), k / size)


def read_facets(path: Path) -> Floats:
    """Corners (f, 3, 3) of the facets of a shell's STL file, mm.

    InputError: it is not there, or cannot be read.
    """
    import trimesh

    if not path.is_file():
        raise InputError(f"{path} is not there: build the shell too, or leave --mesh out")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise InputError(f"{path} is over 4 GiB: {REBUILD}")
    try:
        corners = np.asarray(trimesh.load_mesh(path, process=False).triangles, dtype=np.float64)
    except Exception as error:  # trimesh's readers raise whatever their libraries do
        raise InputError(f"{path} cannot be read: {error}: {REBUILD}") from error
    if len(corners) == 0 or not np.isfinite(corners).all():
        raise InputError(f"{path} has no facets, or some that are not finite: {REBUILD}")
    return corners


def facet_owners(bare: Surfaces, corners: Floats) -> Ints:
    """The mirror (f,) on whose surface all corners (f, 3, 3) of a facet lie; -1 for none."""
    _, near = cKDTree(bare.apex).query(
        corners.mean(axis=1), k=min(CANDIDATE_MIRRORS, len(bare)), workers=-1
    )
    owner = np.full(len(corners), -1)
    for likely in near.reshape(len(corners), -1).T:
        unassigned = np.flatnonzero(owner < 0)
        i = np.repeat(likely[unassigned, None], 3, axis=1)
        on = np.abs(bare.value(i, corners[unassigned])).max(axis=1) < ON_MIRROR_MM
        owner[unassigned[on]] = likely[unassigned[on]]
    # A wall's corners may all be on the rim of a mirror, along which it does not lie.
    area, normal = facet_vectors(corners), bare.gradient(owner, corners.mean(axis=1))
    along = np.abs(dot(area, normal)) > MIN_FACET_COSINE * norm(area) * norm(normal)
    owner[~along] = -1
    return owner
