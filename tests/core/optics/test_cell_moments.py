"""Moments of cells against sums over fine facets of the same cells."""

import numpy as np
import pytest

from tbcad.core.geometry.vectors import norm
from tbcad.core.mirrors.array import MirrorArray
from tbcad.core.optics.cell_moments import cell_moments

STEPS = 60  # points along each side of a cell


def test_they_are_sums_over_facets(small_half: MirrorArray) -> None:
    cells, origin = small_half.modelled_cells, np.array([10.0, -20.0, 30.0])
    found = cell_moments(cells, origin)
    offsets, sides = cells.rings
    for k in range(0, cells.mirrors, 7):
        n, weight = facets(small_half, k, sides[offsets[k] : offsets[k + 1]])
        area = weight.sum()
        assert found.area[k] == pytest.approx(area, rel=5e-3)
        np.testing.assert_allclose(found.first[k], weight @ n, atol=2e-3 * area)
        second = np.einsum("f,fi,fj->ij", weight, n, n)
        np.testing.assert_allclose(found.second[k], second, atol=2e-3 * area)


def facets(array: MirrorArray, k: int, sides: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Normals and areas of thin triangles from the apex to the outline, cut up on the sphere."""
    cells = array.modelled_cells
    surfaces = cells.mirror_surfaces
    centre = surfaces.apex[k] - surfaces.radius[k] * surfaces.normal[k]
    t = np.linspace(0, 1, STEPS)
    share = np.linspace(0, 1, STEPS)[:, None, None]
    normals, areas = [], []
    for side in sides.tolist():
        edge = cells.arcs.at(np.full(STEPS, side // 2), t[::-1] if side % 2 else t)
        grid = surfaces.apex[k] + share * (edge - surfaces.apex[k]) - centre
        grid *= surfaces.radius[k] / norm(grid)[..., None]
        along, across = grid[:-1, 1:] - grid[:-1, :-1], grid[1:, :-1] - grid[:-1, :-1]
        middle = (grid[:-1, :-1] + grid[1:, 1:]) / 2
        areas.append(norm(np.cross(along, across)).ravel())
        last = grid[1:, 1:] - grid[1:, :-1], grid[1:, 1:] - grid[:-1, 1:]
        areas[-1] = (areas[-1] + norm(np.cross(*last)).ravel()) / 2
        normals.append((middle / norm(middle)[..., None]).reshape(-1, 3))
    return np.concatenate(normals), np.concatenate(areas)
