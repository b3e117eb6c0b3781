"""The virtual cameras of the seam see the whole object: by rays from its points, without cells.

For a point of the object the law of reflection gives the point of a sphere that shows it to a
camera. It does show it where no other sphere covers that point, on the mirror's side of seam and
foot. Source: the law of reflection alone; no cell, arc or outline of tbcad takes part.
"""

from collections.abc import Iterator

import numpy as np
import pytest

from tbcad.core.geometry.vectors import unit
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign, design
from tbcad.core.spec.load import load_spec

# Fixed-point steps of the point of reflection.
STEPS = 60


def reflection_points(
    centre: np.ndarray, radius: float, pinhole: np.ndarray, seen: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Points (k, 3) of a sphere where light from points (k, 3) is reflected to the pinhole."""
    normal = np.broadcast_to(normal, seen.shape)
    for _ in range(STEPS):
        point = centre + radius * normal
        ways = pinhole - point, seen - point
        lengths = [np.linalg.norm(way, axis=1)[:, None] for way in ways]
        halfway = unit(ways[0] / lengths[0] + ways[1] / lengths[1])
        # A move along the sphere turns the halfway direction back, by about this slope.
        slope = radius * (1 / lengths[0] + 1 / lengths[1]) / 2
        error = halfway - normal
        normal = unit(normal + error / (1 + slope))
    assert np.abs(error).max() < 1e-9
    return centre + radius * normal


def shown(array: MirrorArray, i: int, points: np.ndarray) -> np.ndarray:
    """Which points (k, 3) of the object the camera sees in its mirror i, (k,)."""
    mirrors, side = array.mirrors, np.sign(array.ellipsoid.pinhole[0])
    pinhole = array.ellipsoid.pinhole
    at = reflection_points(mirrors.centre[i], mirrors.radius[i], pinhole, points, mirrors.normal[i])
    others = np.delete(np.arange(len(array)), i)
    away = np.linalg.norm(at[:, None] - mirrors.centre[others], axis=2)
    free = (away >= mirrors.radius[others]).all(axis=1)
    return free & (side * at[:, 0] >= 0) & (at[:, 2] >= array.foot)


def unseen(made: MirrorDesign, diameter: float) -> Iterator[np.ndarray]:
    """For each mirror on the seam the points of its disc that neither half shows."""
    grid = np.linspace(-1, 1, 61) * diameter / 2
    x, along = (one.ravel() for one in np.meshgrid(grid, grid))
    inside = np.hypot(x, along) <= diameter / 2
    rim = np.linspace(0, 2 * np.pi, 120) + 1e-3
    x = np.concatenate([x[inside], diameter / 2 * np.cos(rim)])
    along = np.concatenate([along[inside], diameter / 2 * np.sin(rim)])
    a, b = made.arrays
    for i in np.flatnonzero(np.abs(a.u[:, 0]) < 1e-12):
        across = np.array([1.0, 0, 0])
        points = x[:, None] * across + along[:, None] * np.cross(a.u[i], across)
        yield points[~(shown(a, i, points) | shown(b, i, points))]


@pytest.mark.parametrize(
    "options",
    [["n=3"], ["n=5", "mirrors.margin_mm=0.01"], pytest.param(["n=18"], marks=pytest.mark.slow)],
)
def test_every_point_is_seen_in_a_half(options: list[str]) -> None:
    made = design(load_spec(None, options))
    missing = list(unseen(made, made.spec.optics.capture_diameter_mm))
    assert len(missing) == made.arrays[0].cells.halved.sum()
    assert sum(map(len, missing)) == 0


def test_halves_that_are_not_aimed_leave_a_gap() -> None:
    """So the rays can fail: with the paper's poses, well inside what each outline surrounds."""
    made = design(load_spec(None, ["n=6", "mirrors.radius_rule=paper"]))
    missing = list(unseen(made, 40.0))
    assert sum(len(points) > 0 for points in missing) > 6
    widest = max(np.ptp(points[:, 0]) for points in missing if len(points))
    assert widest < 4  # a wedge along the seam, nothing else
