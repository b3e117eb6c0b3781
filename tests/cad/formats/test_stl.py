"""STL: what is written is what any reader works out again."""

from pathlib import Path

import numpy as np

from tbcad.cad.formats.mesh_files import write_stl
from tbcad.cad.kernel.mesh import Mesh

FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def test_normals_are_those_of_the_coordinates_as_written(tmp_path: Path) -> None:
    """Rounding to 32 bits tilts this triangle, 5 mm long and 3 um high, by more than 0.001."""
    thin = [[123.4, 40.1, 7.3], [128.3, 40.1, 7.3], [125.0, 40.1000021, 7.3000019]]
    mesh = Mesh(np.array(thin), np.array([[0, 1, 2]]))
    write_stl(tmp_path / "thin.stl", mesh)
    facet = np.fromfile(tmp_path / "thin.stl", FACET, offset=84)[0]
    a, b, c = facet["corners"].astype(float)
    across = np.cross(b - a, c - a)
    np.testing.assert_allclose(facet["normal"], across / np.linalg.norm(across), atol=1e-7)
    exact = np.cross(*(np.array(thin[1:]) - thin[0]))
    assert np.abs(exact / np.linalg.norm(exact) - facet["normal"]).max() > 1e-3
