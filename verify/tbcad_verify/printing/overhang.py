"""Faces that would need support while a part grows upwards."""

from __future__ import annotations

import math

import numpy as np

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.types import Floats

BED_MM = 0.01  # facets within this of the lowest point lie on the bed; far less than a layer
# Normals of fine facets are in doubt by so much: faces at just the allowed lean are allowed.
DOUBT_RAD = 1e-3


def overhang_area(mesh: Mesh, double: Floats, down: Floats, lean_rad: float) -> float:
    """Area of facets that lean more than allowed and do not lie on the bed, mm^2.

    Args:
        mesh: a part's.
        double: (F,) twice the facets' areas, mm^2.
        down: (3,) unit, which way is down.
        lean_rad: most lean from the vertical that needs no support: 0 for walls, pi/2 for ceilings.
    """
    least = math.sin(min(lean_rad + DOUBT_RAD, math.pi / 2))
    below = np.flatnonzero(np.einsum("in,i->n", mesh.area, down) > least * double)
    depth = np.einsum("ni,i->n", mesh.points, down)
    lying = depth > depth.max() - BED_MM
    on_bed = lying[mesh.faces[below]].all(axis=1)
    return float(double[below[~on_bed]].sum()) / 2
