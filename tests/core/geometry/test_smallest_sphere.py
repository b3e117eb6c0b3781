"""The smallest sphere about points, against closed forms and against all spheres of few points."""

import numpy as np
import pytest

from tbcad.core.geometry.round_cones import smallest_sphere


@pytest.mark.parametrize(
    ("points", "middle", "radius"),
    [
        ([[1, 2, 3]], [1, 2, 3], 0),
        ([[0, 0, 0], [2, 0, 0]], [1, 0, 0], 1),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0], [4, 0, 0]], [2, 0, 0], 2),
        ([[0, 0, 5], [6, 0, 5], [0, 8, 5]], [3, 4, 5], 5),
        ([[0, 0, 0], [10, 0, 0], [5, 1, 0]], [5, 0, 0], 5),
        ([[-1, -1, 7], [1, -1, 7], [1, 1, 7], [-1, 1, 7], [0, 0, 7]], [0, 0, 7], np.sqrt(2)),
        ([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [0, 0, 0], np.sqrt(3)),
    ],
)
def test_closed_forms(points: list[list[float]], middle: list[float], radius: float) -> None:
    found, reach = smallest_sphere(np.array(points, dtype=np.float64))
    assert found == pytest.approx(middle, abs=1e-9)
    assert reach == pytest.approx(radius)


@pytest.mark.parametrize("thickness", [1.0, 1e-6, 1e-13, 0.0])
@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_no_other_middle_is_nearer_to_all(thickness: float, shift: float) -> None:
    """The middle minimises a convex function, so no small step may make the reach shorter."""
    random = np.random.default_rng(4)
    points = random.normal(size=(300, 3)) * [1, 1, thickness] + shift
    middle, reach = smallest_sphere(points)
    for step in np.vstack([1e-3 * random.normal(size=(50, 3)), 1e-3 * np.eye(3)]):
        assert np.linalg.norm(points - middle - step, axis=1).max() > reach - 1e-9
