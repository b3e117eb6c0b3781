"""Binary STL: triangles as 32-bit floats, millimetres."""

from pathlib import Path

import numpy as np
import trimesh
from trimesh.exchange.stl import export_stl

from tbcad.cad.mesh import Mesh


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write a mesh; the 80 bytes of the header are zero, so equal meshes give equal bytes.

    Normals are those of the vertices as written: rounding tilts thin triangles, and programs that
    compute the normals again would take others for faults.
    """
    written = np.asarray(mesh.vertices, dtype=np.float32)
    solid = trimesh.Trimesh(written, mesh.triangles, process=False)
    path.write_bytes(export_stl(solid))
