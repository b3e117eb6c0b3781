"""A screw of a record, on a plate at the origin unless told otherwise, and shapes of bodies."""

from typing import Any

import manifold3d
import numpy as np
from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.record.prototype import PlacedFastener

SCREW = {
    "name": "M5x16_1",
    "part": "M5x16",
    "position_mm": [0.0, 0.0, 0.0],
    "along": [0.0, 0.0, -1.0],
    "through": ["plate"],
    "turns": False,
    "finish": None,
}


def screw(**changed: Any) -> PlacedFastener:
    return PlacedFastener.model_validate(SCREW | changed)


def shape(solid: Any) -> Shape:
    mesh = solid.to_mesh64()
    faces = np.array(mesh.tri_verts, dtype=np.int64, order="C")
    return np.array(mesh.vert_properties[:, :3]), faces


def box(*low_high: float) -> Shape:
    low, high = np.array(low_high[:3]), np.array(low_high[3:])
    return shape(manifold3d.Manifold.cube(high - low).translate(low))
