"""The surface of a field: a closed mesh where its density passes a level, with colours.

A fit leaves a body hollow: light is stopped within a node or two, and what no ray reaches stays as
empty as it began. So what is not seen from the hemisphere of virtual cameras is taken as full: the
inside, and below the object what it hides.

The mesh is that of flying edges (W. Schroeder, R. Maynard and B. Geveci, LDAV 2015), as VTK has
it: closed, and each edge of two facets, whatever the values are. The number of the density is
linear between nodes, and so is a place on an edge of the lattice.
"""

from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.geodesic import geodesic
from tbcad.errors import InputError
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.fit import medium_of
from tbcad.light.reconstruction.marching import MATT, SOFTNESS, Singles, composited
from tbcad.light.reconstruction.rays import CapturedRays
from tbcad.light.reconstruction.start import NUMBERS
from tbcad.light.simulate.parallel import first_then_threads, in_threads, over_chunks
from tbcad.light.simulate.scene.lamps import free_rays
from tbcad.light.simulate.scene.ray_casting import embree_scene
from tbcad.types import Bools, Bytes, Floats, Ints

TRIED = np.geomspace(0.08, 5.12, 19)  # 1/mm: three to a factor of two
MOST_TRIED = 100_000  # held rays
OFF_NODES = 2e-3  # of the number: points so near to a node would be points of no distance
SEEN_FROM = 2  # directions at least: one ray may slip through between two nodes
FULL = 8.0  # number of a node that is as good as opaque
EVENED = 0.5  # nodes, standard deviation: the numbers, against noise from node to node
SMOOTHED = 1.0  # nodes, standard deviation: the boundary of what is not seen
RIM = 0.1  # nodes from the capture sphere, where everything ends
STEEP = 10.0  # number across it, for each node or so
SPECK_NODES = 3.0  # smallest body that is kept, when no capture says it
OUTSIDE, INSIDE = 1.5, 3.0  # of a point, where its colour's rays begin and end, nodes
FACING = 0.3  # cosine to the normal of rays that see a point well
STRIDE = 0.3  # of their samples, nodes
POINTS_PER_CHUNK = 1 << 14


def best_level(made: Field, rays: CapturedRays, held: Bools) -> float:
    """The density, 1/mm, whose surface has the silhouettes of rays that were held out, (n,).

    Of all levels it is the one where fewest rays see the background though they meet the surface,
    or something though they miss it. Rays that do so at any level, as those of black things, do not
    matter. The place where rays become half opaque is no measure: it lies behind the surface.
    InputError: the field is empty.
    """
    which = np.flatnonzero(held)
    which = which[:: -(-len(which) // MOST_TRIED)]
    bright = rays.colour[which].max(axis=1) >= rays.dark_level()
    lattice, corner = _lattice(made)

    def wrong(level: float) -> int:
        points, faces = _contour(lattice, corner, made.grid.pitch_mm, _number(level))
        if len(faces) == 0:
            return len(which) + 1
        scene = embree_scene(points, faces)
        met = scene.run(rays.entry[which], rays.direction[which], query="OCCLUDED") == 0
        return int((met != bright).sum())

    errors = in_threads(wrong, TRIED.tolist())
    if min(errors) > len(which):
        raise _empty(made, float(TRIED[0]))
    return float(TRIED[int(np.argmin(errors))])


def resolved_mm(rays: CapturedRays) -> float:
    """Width, at the object, of a pixel of a mirror: the capture sphere's, by a mirror's pixels."""
    pixels = np.bincount(rays.mirror)
    return float(rays.capture_mm * np.sqrt(np.pi / 4 / np.median(pixels[pixels > 0])))


def field_mesh(made: Field, level: float, least_mm: float | None = None) -> trimesh.Trimesh:
    """The surface of a level, 1/mm, as a closed mesh with colours (sRGB) at its points, mm.

    Bodies below a size of least_mm go; None: three distances of nodes, about what a mirror resolves
    (`resolved_mm`): what lies within one pixel of each view may be noise as well. InputError:
    nothing is as dense.
    """
    pitch, number = made.grid.pitch_mm, _number(level)
    lattice, corner = _lattice(made)
    thin = _contour(lattice, corner, pitch, number)
    if len(thin[1]) == 0:
        raise _empty(made, level)
    full = _filled(lattice, corner, pitch, number, embree_scene(*thin))
    least = SPECK_NODES * pitch if least_mm is None else least_mm
    points, faces = _bodies(*_contour(full, corner, pitch, number), least)
    if len(faces) == 0:
        raise InputError(
            f"nothing in the field is larger than {least:.2g} mm at level {level:g} 1/mm: give a "
            "lower level, or fit it to more rays"
        )
    mesh = trimesh.Trimesh(points, faces, process=False)
    mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=_colours(made, mesh))
    return mesh


def _number(level: float) -> float:
    """The number whose density is a level: the inverse of `density_of`."""
    return level - float(SOFTNESS) / (4 * level)


def _empty(made: Field, level: float) -> InputError:
    most = made.density().max(initial=0.0)
    return InputError(
        f"the field has no surface at level {level:g} 1/mm: nothing in it is denser than "
        f"{most:.2g}; give a lower level, or fit it to photographs that show something"
    )


def _lattice(made: Field) -> tuple[Singles, float]:
    """Numbers of the nodes, with a border of nothing, and its first corner along each axis, mm.

    They fall toward the capture sphere, past which no ray tells anything, and are smoothed by
    half a node: facets are then smoother by a quarter, and not farther from the truth.
    """
    grid, nothing = made.grid, NUMBERS[0]
    inside = (grid.width_mm / 2 - norm(grid.points)) / grid.pitch_mm - RIM
    number = np.minimum(made.values[:, 0], STEEP * inside)
    dense = grid.dense(np.clip(number, nothing, FULL).astype(np.float32), nothing)
    dense = ndimage.gaussian_filter(np.pad(dense, 1, constant_values=nothing), EVENED)
    return dense, -grid.width_mm / 2 - grid.pitch_mm


def _contour(
    lattice: Singles, corner: float, pitch: float, number: float
) -> tuple[Singles, NDArray[np.int64]]:
    """Points (v, 3), mm, and facets (f, 3), outward, where a lattice passes a number."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    away = lattice - np.float32(number)
    away = np.where(np.abs(away) < OFF_NODES, np.copysign(np.float32(OFF_NODES), away), away)
    image = vtkImageData()
    image.SetDimensions(*lattice.shape)
    image.SetOrigin(corner, corner, corner)
    image.SetSpacing(pitch, pitch, pitch)
    values = away.ravel(order="F")
    image.GetPointData().SetScalars(numpy_to_vtk(values))
    edges = vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, 0.0)
    edges.ComputeNormalsOff()
    edges.ComputeScalarsOff()
    edges.Update()
    found = edges.GetOutput()
    if found.GetNumberOfPolys() == 0:
        return np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.int64)
    points = vtk_to_numpy(found.GetPoints().GetData()).copy()
    facets = vtk_to_numpy(found.GetPolys().GetConnectivityArray())
    return points, facets.reshape(-1, 3).astype(np.int64)


def _filled(lattice: Singles, corner: float, pitch: float, number: float, embree: Any) -> Singles:
    """The lattice, with what cannot be seen full."""
    unseen = np.zeros(lattice.shape, dtype=np.float32)
    empty = np.argwhere(lattice < number)
    empty = empty[_hidden(embree, (corner + pitch * empty).astype(np.float32))]
    unseen[tuple(empty.T)] = 1
    share = ndimage.gaussian_filter(unseen, SMOOTHED)
    full = np.maximum(lattice, np.float32(number) + np.float32(STEEP) * (share - np.float32(0.5)))
    holes = ndimage.binary_fill_holes(full > number) & (full <= number)
    full[holes] = number + 1
    return np.asarray(full)


def _hidden(embree: Any, points: Singles) -> Bools:
    """Which points (n, 3) are seen from fewer than two directions of the hemisphere."""

    def part(here: slice) -> Bools:
        place = points[here]
        seen = np.zeros(len(place), dtype=np.int64)
        for toward in _hemisphere(4):
            left = np.flatnonzero(seen < SEEN_FROM)
            ways = np.broadcast_to(toward, (len(left), 3))
            seen[left] += free_rays(embree, place[left], ways)
        return np.asarray(seen < SEEN_FROM)

    return over_chunks(part, len(points), POINTS_PER_CHUNK)


def _hemisphere(n: int) -> Singles:
    """Directions (k, 3) of the virtual cameras of a design of that n, the steepest first."""
    directions = geodesic(n)[0].astype(np.float32)
    order = np.argsort(-directions[:, 2], kind="stable")
    return np.asarray(directions[order[directions[order, 2] > 0]])


def _bodies(points: Singles, faces: Ints, least: float) -> tuple[Singles, Ints]:
    """The surfaces of all bodies of at least that size, mm."""
    edges = np.concatenate([faces[:, :2], faces[:, 1:]])
    label = trimesh.graph.connected_component_labels(edges, node_count=len(points))
    count = label.max() + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label, points)
    np.maximum.at(high, label, points)
    kept = (norm(high - low) >= least)[label]
    number = np.cumsum(kept) - 1
    return np.asarray(points[kept]), number[faces[kept[faces[:, 0]]]]


def _colours(made: Field, mesh: trimesh.Trimesh) -> Bytes:
    """Colours (v, 3) of a mesh's points: the mean over the directions that see them.

    Each is that of a short ray into the field, as a camera would see it. Points that nothing sees
    have the colour of the nearest that is seen.
    """
    points = np.asarray(mesh.vertices, dtype=np.float32)
    normals, pitch = np.asarray(mesh.vertex_normals), made.grid.pitch_mm
    embree, medium = embree_scene(points, np.asarray(mesh.faces)), medium_of(made, STRIDE)

    def seen(toward: Singles) -> tuple[Ints, Singles]:
        rows = np.flatnonzero(normals @ toward > FACING)
        begin = points[rows] + np.float32(OUTSIDE * pitch) * toward
        free = free_rays(embree, begin, np.broadcast_to(toward, begin.shape))
        length = np.full(int(free.sum()), (OUTSIDE + INSIDE) * pitch, dtype=np.float32)
        back = np.ascontiguousarray(np.broadcast_to(-toward, (len(length), 3)))
        return rows[free], composited(begin[free], back, length, medium)[:, :MATT]

    total = np.zeros((len(points), MATT))
    for rows, light in first_then_threads(seen, list(_hemisphere(3))):
        total[rows] += light
    known = total[:, 3] > 0
    if not known.any():
        return np.full((len(points), 3), 128, dtype=np.uint8)
    colour: Floats = total[known, :3] / total[known, 3:]
    nearest = cKDTree(points[known]).query(points)[1]
    return np.rint(255 * np.clip(colour[nearest], 0, 1)).astype(np.uint8)
