"""Many circles at once, against circles that are known."""

from __future__ import annotations

import numpy as np
import pytest
from tbcad_verify.mesh.holes import fit_circles, widest_gaps


def test_circles_of_uneven_points() -> None:
    rng = np.random.default_rng(4)
    centre, radius = rng.uniform(-99, 99, (2, 20)), rng.uniform(0.1, 50, 20)
    group = np.repeat(np.arange(20, dtype=np.int32), 7)
    angle = rng.uniform(0, 4, group.size)  # not all of the turn
    points = centre[:, group] + radius[group] * np.stack([np.cos(angle), np.sin(angle)])
    order = rng.permutation(group.size)
    found, size = fit_circles(points[:, order], group[order], 20)
    np.testing.assert_allclose(found, centre, atol=1e-8)
    np.testing.assert_allclose(size, radius, rtol=1e-8)


def test_points_on_a_line_have_no_circle() -> None:
    points = np.array([[0.0, 1, 2, 3], [0, 0, 0, 0]])
    _, size = fit_circles(points, np.zeros(4, dtype=np.int32), 1)
    assert not np.isfinite(size).any()


@pytest.mark.parametrize(
    ("degrees", "widest"),
    [([0, 90, 180, -90], 90), ([170, -170], 340), ([-10, 10, 100], 250), ([7], 360), ([], 360)],
)
def test_gaps(degrees: list[float], widest: float) -> None:
    angle = np.radians(np.array(degrees, dtype=float))
    group = np.full(angle.size, 1, dtype=np.int32)
    others = np.radians([-90.0, 0, 135])
    both = np.concatenate([angle, others]), np.append(group, np.full(3, 2, dtype=np.int32))
    assert np.degrees(widest_gaps(*both, 3)) == pytest.approx([360, widest, 135])


def test_gaps_pass_over_what_is_not_finite() -> None:
    angle, group = np.array([np.nan, 0, np.pi]), np.zeros(3, dtype=np.int32)
    assert widest_gaps(angle, group, 1) == pytest.approx([np.pi])
