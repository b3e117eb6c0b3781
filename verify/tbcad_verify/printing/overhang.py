"""Faces that need support while a part grows upwards."""

from __future__ import annotations

import math

import numpy as np

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.types import Floats

BED_MM = 0.01  # facets within this of the lowest point lie on the bed; far less than a layer
# Normals of fine facets are uncertain by this: faces at just the allowed lean are allowed.
UNCERTAINTY_RAD = 1e-3


def overhang_area(mesh: Mesh, double: Floats, down: Floats, lean_rad: float) -> float:
    """Area of facets that lean more than allowed and do not lie on the bed, mm^2.

    Args:
        mesh: a part's.
        double: (F,) twice the facets' areas, mm^2.
        down: (3,) unit, the direction that points down.
        lean_rad: maximum lean from the vertical without support: 0 for walls, pi/2 for ceilings.
    """
    limit = math.sin(min(lean_rad + UNCERTAINTY_RAD, math.pi / 2))
    below = np.flatnonzero(np.einsum("in,i->n", mesh.area, down) > limit * double)
    depth = np.einsum("ni,i->n", mesh.points, down)
    lying = depth > depth.max() - BED_MM
    on_bed = lying[mesh.faces[below]].all(axis=1)
    return float(double[below[~on_bed]].sum()) / 2
