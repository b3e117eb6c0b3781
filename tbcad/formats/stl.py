"""Binary STL: triangles as 32-bit floats, millimetres."""

from pathlib import Path

import trimesh
from trimesh.exchange.stl import export_stl

from tbcad.cad.mesh import Mesh


def write_stl(path: Path, mesh: Mesh) -> None:
    """Write a mesh; the 80 bytes of the header are zero, so equal meshes give equal bytes."""
    solid = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    path.write_bytes(export_stl(solid))
