"""Groups of mirrors that share a ball: k-means on radius and polar angle."""

from dataclasses import dataclass

import numpy as np
from scipy.cluster.vq import ClusterError, kmeans2

from tbcad.core.spec.errors import SpecError
from tbcad.types import Floats, Ints

MAX_ITERATIONS = 200
# Mirrors closer together than this, in degrees of polar angle, are the same to k-means.
SAME_DEG = 1e-6


@dataclass(frozen=True)
class MirrorGroups:
    """Groups of m mirrors by rising polar angle, k of them."""

    group_of: Ints  # group of each mirror, (m,)
    polar: Floats  # mean polar angle of each group, radians, (k,)
    radius: Floats  # mean radius, mm, (k,)

    def __len__(self) -> int:
        """Number of groups."""
        return len(self.polar)

    def minimum(self, values: Floats) -> Floats:
        """Minimum (k,) in each group of values (m,)."""
        result = np.full(len(self), np.inf)
        np.minimum.at(result, self.group_of, values)
        return result

    def mean(self, values: Floats) -> Floats:
        """Mean (k,) in each group of values (m,)."""
        return _means(self.group_of, values, len(self))


def _means(group_of: Ints, values: Floats, k: int) -> Floats:
    return np.asarray(np.bincount(group_of, values, k) / np.bincount(group_of))


def group_mirrors(polar: Floats, radius: Floats, k: int, radius_weight_deg: float) -> MirrorGroups:
    """Group mirrors by k-means (the paper, section 5.1): polar angles, rad, radii, mm, (m,).

    The starting points are spread evenly over polar angle instead of drawn at random: the result is
    the same every time, and its largest error of direction is nearly the minimum. 1 mm of radius
    counts as radius_weight_deg degrees. SpecError when there are too few mirrors, or too few that
    differ.
    """
    features = _features(polar, radius, radius_weight_deg)
    start = _start(features, k)
    try:
        _, labels = kmeans2(features, start, iter=MAX_ITERATIONS, minit="matrix", missing="raise")
    except ClusterError:
        raise SpecError(f"k-means leaves a group empty: make prototype.k less than {k}") from None
    group_of = _by_polar_angle(np.asarray(labels, dtype=np.int64), polar, k)
    return MirrorGroups(group_of, _means(group_of, polar, k), _means(group_of, radius, k))


def _by_polar_angle(group_of: Ints, polar: Floats, k: int) -> Ints:
    """Groups (m,) renumbered by rising mean polar angle."""
    order = np.argsort(_means(group_of, polar, k), kind="stable")
    return np.argsort(order)[group_of]


def max_groups(polar: Floats, radius: Floats, radius_weight_deg: float) -> int:
    """Number of mirrors that differ, the maximum of k; arguments as of group_mirrors."""
    return len(_distinct(_features(polar, radius, radius_weight_deg)))


def _features(polar: Floats, radius: Floats, radius_weight_deg: float) -> Floats:
    return np.column_stack([np.degrees(polar), radius_weight_deg * radius])


def _distinct(features: Floats) -> Floats:
    return np.asarray(np.unique(np.round(features / SAME_DEG) * SAME_DEG, axis=0))


def _start(features: Floats, k: int) -> Floats:
    """Of the mirrors that differ, k with polar angles spread as evenly as possible, (k, 2)."""
    distinct = _distinct(features)
    if k > len(distinct):
        raise SpecError(
            f"prototype.k is {k}, but camera a has {len(features)} mirrors, of which "
            f"{len(distinct)} differ in radius or polar angle: make it {len(distinct)} or less"
        )
    low, high = distinct[[0, -1], 0]
    even = low + (high - low) * (np.arange(k) + 0.5) / k
    nearest = np.searchsorted(distinct[:, 0], even) - np.arange(k)
    chosen = np.clip(np.maximum.accumulate(nearest), 0, len(distinct) - k) + np.arange(k)
    return np.asarray(distinct[chosen])
