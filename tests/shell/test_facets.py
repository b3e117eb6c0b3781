"""The middle of a cell sees its whole outline, or the cell is refused."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.surfaces import Surfaces
from tbcad.core.spec.errors import SpecError
from tbcad.shell.cell_outlines import CellOutlines
from tbcad.shell.facets import middles

RADIUS = 1000.0


def outline(corners: list[tuple[float, float]]) -> tuple[CellOutlines, Surfaces]:
    """One cell on top of a sphere that is lit from above; corners run clockwise seen from there."""
    flat = np.array(corners, dtype=float)
    height = np.sqrt(RADIUS**2 - (flat**2).sum(axis=1)) - RADIUS
    points = np.column_stack([flat, height])
    place, none = np.arange(len(points)), np.zeros(0, dtype=np.int64)
    following = np.roll(place, -1)
    cell, corner = np.zeros_like(place), np.ones(len(place), dtype=bool)
    outlines = CellOutlines(
        points, none, none, none, none, cell, place, following, corner, corner.copy()
    )
    up = np.array([[0.0, 0.0, 1.0]])
    return outlines, Surfaces(np.zeros((1, 3)), up, np.array([1 / RADIUS]))


def test_a_convex_cell_has_the_mean_of_its_points() -> None:
    middle = middles(*outline([(0, 0), (0, 6), (6, 6), (6, 0)]))
    assert middle[0, :2] == pytest.approx([3, 3], abs=1e-3)


def test_an_angle_is_seen_whole_from_its_corner_only() -> None:
    """The points of an L, most of them at its ends, have a mean outside of where arms cross."""
    corners = [(0, 0), (0, 9), (2, 9), (2, 2), (9, 2), (9, 0)]
    middle = middles(*outline(corners))
    assert middle[0, :2] == pytest.approx([1, 1], abs=0.02)
    assert norm(middle[0] + [0, 0, RADIUS]) == pytest.approx(RADIUS)


def test_what_no_point_sees_whole_is_refused() -> None:
    corners = [(0, 0), (0, 9), (2, 9), (2, 2), (7, 2), (7, 9), (9, 9), (9, 0)]
    with pytest.raises(
        SpecError, match=r"a0001 bends so far inward .* make optics\.semi_minor_mm larger"
    ):
        middles(*outline(corners))
