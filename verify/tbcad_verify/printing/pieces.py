"""The separate pieces of a mesh: solids that would fall apart, and cavities closed in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.mesh import Mesh, connected_groups


@dataclass(frozen=True)
class MeshPieces:
    """How many connected surfaces there are.

    Attributes:
        solids: that enclose material; one more than one is a loose shell.
        cavities: that enclose a void: turned inside out.
    """

    solids: int
    cavities: int


def mesh_pieces(mesh: Mesh) -> MeshPieces:
    """Connected surfaces by the sign of their volume."""
    half = np.flatnonzero(mesh.twin > np.arange(mesh.twin.size))
    count, label = connected_groups(len(mesh.faces), half // 3, mesh.twin[half] // 3)
    corner = np.take(mesh.points - mesh.points.mean(axis=0), mesh.faces[:, 0], axis=0)
    share = np.einsum("ni,in->n", corner, mesh.area)
    inside_out = int((np.bincount(label, share, count) < 0).sum())
    return MeshPieces(count - inside_out, inside_out)
