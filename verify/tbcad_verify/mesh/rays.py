"""Embree, called directly: the first facet along each ray, from several threads.

Embree works in float32, so only the facet's number is taken from it; where the ray meets that
facet is worked out again in float64.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.vectors import dot, unit
from tbcad_verify.record.export import Camera
from tbcad_verify.types import Floats

Ints = NDArray[np.int32]
Floats32 = NDArray[np.float32]
Item = TypeVar("Item")
Result = TypeVar("Result")

RAYS_A_CHUNK = 1 << 14  # such that a chunk's arrays stay in a core's cache
# Half of the cores: the prototype's stages run beside the shells', and STEP files are read as well.
# Threads that wait for a core or the interpreter's lock cost a twentieth of the processor time.
THREADS = max(1, min((os.cpu_count() or 1) // 2, 8))


@dataclass(frozen=True)
class RayScene:
    """All parts' facets, ready to be hit."""

    embree: Any  # the committed scene; queries release the interpreter's lock
    planes: Floats  # (F, 4) unit outward normal and its product with a corner, mm

    def plane(self, facet: NDArray[np.integer]) -> Floats:
        """(4, N) planes of facets (N,); of -1 any."""
        return np.take(self.planes, facet, axis=0).T

    def first(self, start: Floats32, d: Floats32) -> Ints:
        """(N,) the first facet along rays from (N, 3) along (N, 3); -1 for none."""
        return np.asarray(self.embree.run(start, d), dtype=np.int32)


@dataclass(frozen=True)
class ImagePairScene(RayScene):
    """A mesh beside the plane x = 0 and its mirror image, of which Embree has the mesh alone.

    Facets of the image have the numbers after the mesh's. They are met where the ray's own image
    meets the mesh. A ray passes the plane once: what it meets on the side where it starts is first.
    """

    # 1 where the mesh has x >= 0, -1 where it has x <= 0; planes are the mesh's alone
    side: float

    def plane(self, facet: NDArray[np.integer]) -> Floats:
        """(4, N) planes of facets (N,); of -1 any."""
        plane = super().plane(facet % len(self.planes))
        plane[0] *= np.where(facet < len(self.planes), 1.0, -1.0)
        return plane

    @property
    def mesh(self) -> RayScene:
        """The mesh alone, which rays from its side meet before the image."""
        return RayScene(self.embree, self.planes)

    def first(self, start: Floats32, d: Floats32) -> Ints:
        """(N,) the first facet along rays from (N, 3) along (N, 3); -1 for none."""
        half = np.int32(len(self.planes))
        beyond = self.side * start[:, 0] < 0
        start, d = (_flipped(rays, beyond) for rays in (start, d))
        facet = super().first(start, d)
        facet[beyond & (facet >= 0)] += half
        rest = np.flatnonzero(facet < 0)
        found = super().first(*(_flipped(rays[rest]) for rays in (start, d)))
        facet[rest] = np.where((found >= 0) & ~beyond[rest], found + half, found)
        return facet


def _flipped(rays: Floats32, which: NDArray[np.bool_] | bool = True) -> Floats32:
    """(N, 3) points or directions, some of them mirrored in x = 0."""
    flipped = rays.copy()
    flipped[:, 0] *= np.where(which, np.float32(-1), np.float32(1))
    return flipped


def build_scene(mesh: Mesh) -> RayScene:
    """Put a mesh into Embree and commit it."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, mesh.points.astype(np.float32), mesh.faces)
    one = np.ones((1, 3), dtype=np.float32)
    scene.run(one, one)  # the first call commits; later ones may come from any thread
    normal, planes = unit(mesh.area), np.empty((len(mesh.faces), 4))
    planes[:, :3] = normal.T
    planes[:, 3] = dot(normal, np.take(mesh.points, mesh.faces[:, 0], axis=0).T)
    return RayScene(scene, planes)


def with_image(scene: RayScene, mesh: Mesh) -> RayScene | None:
    """The scene of a mesh and of its mirror image in x = 0; None where it is on both sides."""
    x = mesh.points[:, 0]
    side = 1.0 if x.min() >= 0 else -1.0
    if side * x.min() < 0 or side * x.max() < 0:
        return None
    return ImagePairScene(scene.embree, scene.planes, side)


def first_hits(scene: RayScene, origin: Floats, d: Floats) -> Ints:
    """(N,) the first facet along rays from origin (3, 1) or (3, N) along d (3, N); -1 for none."""
    start = np.empty((d.shape[1], 3), dtype=np.float32)
    start[:] = origin.T
    return scene.first(start, d.T.astype(np.float32))


def distances_to_planes(scene: RayScene, facet: Ints, origin: Floats, d: Floats) -> Floats:
    """(N,) lengths of d from origin to the planes of facets, in float64."""
    plane = scene.plane(facet)
    return np.asarray((plane[3] - dot(origin, plane[:3])) / dot(d, plane[:3]))


def pixel_rows(camera: Camera, first: int, last: int) -> Floats:
    """(3, N) directions through the centres of all pixels of rows first ... last - 1, row by row.

    The component along `forward` is 1.
    """
    across = (np.arange(camera.width) + 0.5 - camera.width / 2) * camera.pitch
    downward = (np.arange(first, last) + 0.5 - camera.height / 2) * camera.pitch
    columns = camera.forward[:, None] + camera.right[:, None] * across
    rows = camera.down[:, None] * downward
    return (rows[:, :, None] + columns[:, None, :]).reshape(3, -1)


def row_chunks(camera: Camera) -> list[tuple[int, int]]:
    """Bands of pixel rows, a chunk of rays each: (first, last + 1)."""
    step = max(1, RAYS_A_CHUNK // camera.width)
    return [(k, min(k + step, camera.height)) for k in range(0, camera.height, step)]


def in_threads(
    work: Callable[[Item], Result], items: Iterable[Item], stop: Callable[[], None] = lambda: None
) -> list[Result]:
    """Results in the items' order, whatever the threads do.

    `stop`: ends what the threads wait for; called when one fails, or at an interrupt.
    """
    if THREADS == 1:
        return [work(item) for item in items]
    with ThreadPoolExecutor(THREADS) as pool:
        try:
            return list(pool.map(work, items))
        except BaseException:
            stop()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
