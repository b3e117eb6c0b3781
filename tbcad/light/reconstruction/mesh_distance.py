"""How far a found mesh is from the true object of a simulated capture."""

from dataclasses import dataclass

import numpy as np
import trimesh

from tbcad.light.reconstruction.marching import Singles
from tbcad.light.reconstruction.rays import CapturedRays
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import embree_scene
from tbcad.types import Floats

SAMPLES = 100_000  # points on each whole surface
SEED = 0
CELL_MM = 0.25  # of what is seen, one point in each cell of that size


@dataclass(frozen=True)
class MeshDistance:
    """Distances between two surfaces, mm.

    Means are over the points of both; a Hausdorff distance is the largest of any point to the
    other surface. Distances of points are exact; between the points a Hausdorff distance may be
    larger by no more than their distance, about 0.25 mm.
    """

    mean_mm: float  # of points that some captured ray meets first
    percentile_95_mm: float  # of the same
    hausdorff_mm: float  # of the same
    # of points spread evenly over all of both surfaces, the underside and what lies inside
    # included, which no ray shows
    whole_mean_mm: float
    whole_hausdorff_mm: float  # of the same


def mesh_distance(mesh: trimesh.Trimesh, truth: SceneObject, rays: CapturedRays) -> MeshDistance:
    """Compare a found mesh with the true object.

    Args:
        mesh: the found one, mm.
        truth: `tbcad.light.simulate.capture.files.read_object`.
        rays: of the capture: what they meet first is seen.
    """
    true = trimesh.Trimesh(truth.points, truth.faces, process=False)
    seen = _both(mesh, true, _seen(mesh, rays), _seen(true, rays))
    whole = _both(mesh, true, _even(mesh), _even(true))
    return MeshDistance(
        float(seen.mean()),
        float(np.percentile(seen, 95)) if len(seen) else float("nan"),
        float(seen.max(initial=0.0)),
        float(whole.mean()),
        float(whole.max()),
    )


def _both(found: trimesh.Trimesh, true: trimesh.Trimesh, first: Floats, second: Floats) -> Floats:
    """Distances of points on one to the other, and the other way round."""
    return np.concatenate([_distances(first, true), _distances(second, found)])


def _distances(points: Floats, surface: trimesh.Trimesh) -> Floats:
    """Distances (n,) of points (n, 3) to the nearest of a surface's facets."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    places, facets = vtkPoints(), vtkCellArray()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(surface.vertices, dtype=np.float64)))
    corners = np.ascontiguousarray(surface.faces, dtype=np.int64)
    facets.SetData(3, numpy_to_vtkIdTypeArray(corners.ravel()))
    body = vtkPolyData()
    body.SetPoints(places)
    body.SetPolys(facets)
    measure, result = vtkImplicitPolyDataDistance(), vtkDoubleArray()
    measure.SetInput(body)
    measure.FunctionValue(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float64)), result)
    return np.asarray(np.abs(vtk_to_numpy(result)))


def _even(surface: trimesh.Trimesh) -> Floats:
    points = trimesh.sample.sample_surface(surface, SAMPLES, seed=SEED)[0]
    return np.asarray(points, dtype=np.float64)


def _seen(surface: trimesh.Trimesh, rays: CapturedRays) -> Floats:
    """Points that rays meet first, at most one in each cell of a lattice."""
    scene = embree_scene(np.asarray(surface.vertices), np.asarray(surface.faces))
    hits = scene.run(rays.entry, rays.direction, output=1)
    met = hits["primID"] >= 0
    points: Singles = rays.entry[met] + hits["tfar"][met][:, None] * rays.direction[met]
    cells = np.floor(points / CELL_MM).astype(np.int64)
    first = np.unique(cells, axis=0, return_index=True)[1]
    return points[first].astype(np.float64)
