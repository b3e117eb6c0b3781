"""Changes to what closes a half's mesh: one bolt hole of its foot flange, its foot, its back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tbcad.types import Floats
from tests.verify.corpus.facets import Ball, Corners, patch, replaced

WAY_MM = 0.05
LARGEST_SIDE_MM = 3.0  # of the facets of a bore, across
LARGEST_BORE_MM = 6.0
SEAM_MM = 5.1  # the seam flange, and a little
RIM_MM = 0.1  # from the flanges, of points of the back
# Of the export that is broken.
PINHOLE = np.array([100.0, 0.0, -100.0])
AXIS = PINHOLE / np.linalg.norm(PINHOLE)
SEMI_AXES = np.array([np.hypot(100.0, np.linalg.norm(PINHOLE) / 2), 100.0])


def widened(corners: Corners, _: list[Ball]) -> Corners:
    """Its diameter larger."""
    rims = bore(corners)
    spoke = (rims - _axis(rims)) * [1, 1, 0]
    return replaced(corners, rims, rims + WAY_MM / 2 * spoke / _length(spoke)[:, None])


def aside(corners: Corners, _: list[Ball]) -> Corners:
    rims = bore(corners)
    return replaced(corners, rims, rims + np.array([0, WAY_MM, 0]))


def closed(corners: Corners, _: list[Ball]) -> Corners:
    """Both rims drawn together to a point; what has no area then is left out."""
    rims = bore(corners)
    tight = np.where([[True, True, False]], _axis(rims), rims).astype(np.float32)
    corners = replaced(corners, rims, tight)
    a, b, c = corners.transpose(1, 0, 2)
    kept = (a != b).any(axis=1) & (b != c).any(axis=1) & (c != a).any(axis=1)
    return corners[kept]


def bore(corners: Corners) -> Corners:
    """(N, 3) points on both rims of the foot flange's hole that is farthest along x."""
    low, top = _flange(corners)
    upright = ((corners[:, :, 2] == low) | (corners[:, :, 2] == top)).all(axis=1)
    sides = np.ptp(corners, axis=1)
    some = corners[upright & (sides[:, 2] > 0) & (_length(sides[:, :2]) < LARGEST_SIDE_MM)]
    points = np.unique(some.reshape(-1, 3), axis=0)
    last = points[points[:, 0].argmax()]
    return points[_length((points - last)[:, :2]) < LARGEST_BORE_MM]


def _flange(corners: Corners) -> tuple[np.float32, np.float32]:
    """Heights of the foot flange's faces: the lowest, and the next that has as many corners."""
    heights, counts = np.unique(corners[:, :, 2], return_counts=True)
    return heights[0], heights[1:][counts[1:].argmax()]


def _axis(rims: Corners) -> Floats:
    return np.asarray((rims.min(axis=0) + rims.max(axis=0)) / 2, dtype=float)


def hanging(corners: Corners, _: list[Ball]) -> Corners:
    """A tip below the foot: the corner of its flange that is farthest along x."""
    points = np.unique(corners.reshape(-1, 3), axis=0)
    foot = points[points[:, 2] == points[:, 2].min()]
    tip = foot[[foot[:, 0].argmax()]]
    return replaced(corners, tip, tip - np.array([0, 0, WAY_MM]))


def grown(way: float) -> Callable[[Corners, list[Ball]], Corners]:
    """Both semi-axes of the back longer, mm."""

    def job(corners: Corners, every: list[Ball]) -> Corners:
        points = _back(corners, every)
        return replaced(corners, points, _grown(points, way))

    return job


def dented_back(corners: Corners, every: list[Ball]) -> Corners:
    """The corner of the back that is nearest to a valley between mirrors pushed in."""
    points = _back(corners, every)
    mirror = np.unique(corners[patch(corners, every[0])].reshape(-1, 3), axis=0)
    valley = mirror[_length(mirror - every[0].apex).argmax()]
    dented = points[[_length(points - valley).argmin()]]
    return replaced(corners, dented, _grown(dented, -WAY_MM))


def _back(corners: Corners, every: list[Ball]) -> Corners:
    """(N, 3) points on the spheroid that holds most points outside the mirrors, but its rim."""
    faces = corners[~np.any([patch(corners, ball) for ball in every], axis=0)]
    points = np.unique(faces.reshape(-1, 3), axis=0)
    points = points[(points[:, 0] > SEAM_MM) & (points[:, 2] > _flange(corners)[1] + RIM_MM)]
    beyond = _beyond(points)
    values, counts = np.unique(beyond.round(3), return_counts=True)
    return points[np.abs(beyond - values[counts.argmax()]) < 2e-3]


def _beyond(points: Corners) -> Floats:
    """(N,) by how much the spheroid through points is longer than the ellipsoid, mm."""
    low, high = np.full(len(points), -SEMI_AXES[1] / 2), np.full(len(points), SEMI_AXES[1])
    places = _along_and_across(points)
    for _ in range(50):
        middle = (low + high) / 2
        outside = ((places / (SEMI_AXES + middle[:, None])) ** 2).sum(axis=1) > 1
        low, high = np.where(outside, middle, low), np.where(outside, high, middle)
    return low


def _along_and_across(points: Corners) -> Floats:
    offset = points - PINHOLE / 2
    along = offset @ AXIS
    return np.column_stack([along, _length(offset - along[:, None] * AXIS)])


def _grown(points: Corners, way: float) -> Floats:
    """Points moved from one spheroid to another."""
    offset = points - PINHOLE / 2
    scale = 1 + way / (SEMI_AXES + _beyond(points)[:, None])
    along = (offset @ AXIS)[:, None] * AXIS
    return np.asarray(PINHOLE / 2 + scale[:, :1] * along + scale[:, 1:] * (offset - along))


def _length(vectors: np.ndarray) -> Floats:
    return np.asarray(np.linalg.norm(vectors, axis=-1))
