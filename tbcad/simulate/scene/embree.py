"""Embree, called directly: the first facet along each ray."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def embree_scene(points: NDArray[Any], faces: NDArray[Any] | None = None) -> Any:
    """A scene of facets, ready for queries from several threads, which release the lock.

    Args:
        points: corners, mm, (v, 3); or, without faces, facets by their corners, (f, 3, 3).
        faces: corners of the facets, (f, 3).
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    corners = points.astype(np.float32)
    if faces is None:
        TriangleMesh(scene, corners)
    else:
        TriangleMesh(scene, corners, faces.astype(np.int32))
    one = np.ones((1, 3), dtype=np.float32)
    scene.run(one, one)  # the first call commits
    return scene
