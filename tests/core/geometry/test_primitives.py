"""Volumes of primitives against their closed surfaces."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from tbcad.core.geometry.primitives import (
    Cylinder,
    Primitive,
    Prism,
    Revolved,
    Slot,
    box,
    enclosing_triangles,
    volume,
)

TILTED = np.array([0.6, 0.0, 0.8])


@pytest.mark.parametrize(
    ("body", "rounding"),
    [
        (box(np.zeros(3), np.array([2.0, 3.0, 4.0]), np.eye(3)), 0.0),
        (Prism(np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]]), np.array([1.0, 2.0, 5.0])), 0.0),
        (Cylinder(np.ones(3), TILTED, 2.0, 7.0), 0.01),
        (Slot(np.ones(3), np.array([0.0, 3.0, 0.0]), 2.0, 7 * TILTED), 0.01),
        (Revolved(np.array([[0.0, 0.0], [0.0, 3.0], [5.0, 1.0], [5.0, 0.0]])), 0.01),
    ],
    ids=["box", "oblique prism", "cylinder", "slot", "cone"],
)
def test_volume_of_convex_bodies(body: Primitive, rounding: float) -> None:
    """The circumscribed polygons of round bodies enclose up to 0.4 % more."""
    hull = ConvexHull(enclosing_triangles(body).reshape(-1, 3)).volume
    assert volume(body) <= hull * (1 + 1e-12)
    assert volume(body) == pytest.approx(hull, rel=rounding or 1e-12)
