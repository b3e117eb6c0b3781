"""Groups of mirrors that share a ball: k-means on radius and polar angle."""

from dataclasses import dataclass

import numpy as np
from scipy.cluster.vq import ClusterError, kmeans2

from tbcad.spec.errors import SpecError
from tbcad.types import Floats, Ints

ROUNDS = 200
# Mirrors nearer to each other than this, in degrees of polar angle, are the same to k-means.
SAME_DEG = 1e-6


@dataclass(frozen=True)
class MirrorGroups:
    """Groups of m mirrors by rising polar angle, over k groups.

    Attributes:
        of: group of each mirror, (m,).
        polar: mean polar angle of each group, radians, (k,).
        radius: mean radius, mm, (k,).
    """

    of: Ints
    polar: Floats
    radius: Floats

    def __len__(self) -> int:
        """Number of groups."""
        return len(self.polar)

    def least(self, values: Floats) -> Floats:
        """Least value (k,) of each group, of values (m,)."""
        result = np.full(len(self), np.inf)
        np.minimum.at(result, self.of, values)
        return result

    def mean(self, values: Floats) -> Floats:
        """Mean value (k,) of each group, of values (m,)."""
        result: Floats = np.bincount(self.of, values, len(self)) / np.bincount(self.of)
        return result


def group_mirrors(polar: Floats, radius: Floats, k: int, radius_weight_deg: float) -> MirrorGroups:
    """Group mirrors by k-means (the paper, section 5.1).

    The start is spread evenly over polar angle instead of drawn at random: the same every time,
    and of the local optima one with nearly the least worst error of direction.

    Args:
        polar: radians, (m,).
        radius: mm, (m,).
        k: number of groups.
        radius_weight_deg: degrees of polar angle that 1 mm of radius counts as.

    Raises:
        SpecError: when there are fewer mirrors than groups, or too few that differ.
    """
    places = _places(polar, radius, radius_weight_deg)
    start = _start(places, k)
    try:
        _, of = kmeans2(places, start, iter=ROUNDS, minit="matrix", missing="raise")
    except ClusterError:
        raise SpecError(f"k-means leaves a group empty: make prototype.k less than {k}") from None
    return ordered(np.asarray(of, dtype=np.int64), polar, radius, k)


def ordered(of: Ints, polar: Floats, radius: Floats, k: int) -> MirrorGroups:
    """Groups (m,) renumbered by rising mean polar angle."""
    loose = MirrorGroups(of, np.zeros(k), np.zeros(k))
    order = np.argsort(loose.mean(polar), kind="stable")
    rank = np.empty(k, dtype=np.int64)
    rank[order] = np.arange(k)
    named = MirrorGroups(rank[of], np.zeros(k), np.zeros(k))
    return MirrorGroups(named.of, named.mean(polar), named.mean(radius))


def max_groups(polar: Floats, radius: Floats, radius_weight_deg: float) -> int:
    """Number of mirrors that differ, beyond which no grouping goes; arguments as of clusters."""
    return len(_different(_places(polar, radius, radius_weight_deg)))


def _places(polar: Floats, radius: Floats, radius_weight_deg: float) -> Floats:
    return np.column_stack([np.degrees(polar), radius_weight_deg * radius])


def _different(places: Floats) -> Floats:
    result: Floats = np.unique(np.round(places / SAME_DEG) * SAME_DEG, axis=0)
    return result


def _start(places: Floats, k: int) -> Floats:
    """Of the mirrors that differ, k with polar angles spread as evenly as they allow, (k, 2)."""
    different = _different(places)
    if k > len(different):
        raise SpecError(
            f"prototype.k is {k}, but camera a has {len(places)} mirrors, of which "
            f"{len(different)} differ in radius or polar angle: make it {len(different)} or less"
        )
    low, high = different[[0, -1], 0]
    wanted = low + (high - low) * (np.arange(k) + 0.5) / k
    nearest = np.searchsorted(different[:, 0], wanted) - np.arange(k)
    chosen = np.clip(np.maximum.accumulate(nearest), 0, len(different) - k) + np.arange(k)
    result: Floats = different[chosen]
    return result
