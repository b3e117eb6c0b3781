"""Filament and hours of a print, estimated from its mesh; docs/prototype.md has the errors.

The print is by a 0.4 mm nozzle in layers of 0.2 mm: four perimeters, five layers at top and bottom,
25 % of infill, support below 40 degrees. Thicknesses, shares and flows were fitted on what
PrusaSlicer 2.5 says of 29 printed parts of two designs, with its default speeds.
"""

from dataclasses import dataclass

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

from tbcad.cad.kernel.mesh import Mesh
from tbcad.core.geometry.vectors import norm
from tbcad.types import Bools, Floats

LAYER_MM, INFILL = 0.2, 0.25
SIDE_MM, FLAT_MM = 1.65, 1.0  # what is solid behind a wall, and below or above a flat face
SUPPORT = 0.29  # share of the space below an overhang
# mm^3 in a second, of walls, solid layers, infill and support; seconds more for each layer.
FLOWS = (5.5, 1.5, 3.1, 2.2)
LAYER_S = 6.2
OVERHANG = np.cos(np.radians(40))  # of the downward part of a facet's normal, from which on
FLAT = 0.5  # of the vertical part of a normal, from which on a facet counts as flat
TOUCHING_MM = 0.05  # a facet no higher lies on the bed
BELOW_MM = 0.02  # where rays begin, off the facet they are for
HOUR_S = 3600.0


@dataclass(frozen=True)
class PrintEstimate:
    """Filament in mm^3, supports included, and hours of printing."""

    filament_mm3: float
    hours: float


def print_estimate(mesh: Mesh) -> PrintEstimate:
    """The print of a mesh that stands on the bed."""
    corners = mesh.vertices[mesh.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    area = np.maximum(norm(across), np.finfo(float).tiny)
    up = across[:, 2] / area
    solid = np.array(
        [
            SIDE_MM * (area * np.sqrt(np.maximum(1 - up**2, 0))).sum(),
            FLAT_MM * (area * np.abs(up))[np.abs(up) > FLAT].sum(),
        ]
    )
    solid *= min(1.0, mesh.volume / solid.sum())
    infill = INFILL * (mesh.volume - solid.sum())
    heights = corners[..., 2]
    bottom = heights.min()
    over = (up < -OVERHANG) & (heights.max(axis=1) > bottom + TOUCHING_MM)
    columns = _room_below(corners, over, bottom)
    volumes = np.array([*solid, infill, SUPPORT * float((-across[over, 2]) @ columns)])
    layers = (heights.max() - bottom) / LAYER_MM
    seconds = (volumes / FLOWS).sum() + layers * LAYER_S
    return PrintEstimate(float(volumes.sum()), float(seconds / HOUR_S))


def _room_below(corners: Floats, which: Bools, bottom: float) -> Floats:
    """Heights of what is free below the middles of some facets, down to the part or the bed, mm."""
    middles = corners[which].mean(axis=1) - [0.0, 0.0, BELOW_MM]
    if not len(middles):
        return np.zeros(0)
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, corners.astype(np.float32))
    down = np.zeros_like(middles, dtype=np.float32)
    down[:, 2] = -1
    hit = scene.run(middles.astype(np.float32), down, query="DISTANCE")
    return np.asarray(np.minimum(hit.astype(float), middles[:, 2] - bottom))
