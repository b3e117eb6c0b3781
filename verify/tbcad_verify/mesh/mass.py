"""Mass properties of a mesh: volume, area, centroid and box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.mesh import Mesh, facet_volumes
from tbcad_verify.mesh.vectors import norm


@dataclass(frozen=True)
class MassProperties:
    """Volume, area, centroid and box, as plain numbers."""

    volume: float  # signed, mm^3
    area: float  # mm^2
    centroid: list[float]  # x, y, z of the volume's centroid, mm
    low: list[float]  # minimum x, y, z, mm
    high: list[float]  # maximum x, y, z, mm
    # largest growth of the area of an offset surface with its distance, mm^2 / mm: by Steiner, the
    # sum over edges of length times angle. None if it was not computed.
    bend: float | None = None


def mass_properties(mesh: Mesh) -> MassProperties:
    """Figures of a closed mesh, by the divergence theorem facet by facet."""
    middle, share = mesh.points.mean(axis=0), facet_volumes(mesh)
    volume = float(share.sum())
    corners = np.take(mesh.points - middle, mesh.faces, axis=0)
    moment = np.einsum("n,ni->i", share, corners.sum(axis=1) / 4)
    return MassProperties(
        volume,
        float(norm(mesh.area).sum() / 2),
        (middle + moment / (volume or np.nan)).tolist(),
        mesh.points.min(axis=0).tolist(),
        mesh.points.max(axis=0).tolist(),
    )
