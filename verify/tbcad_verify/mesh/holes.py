"""Round holes, through or blind, found on the mesh: patches that are hollow cylinders."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.mesh import Mesh, connected_groups
from tbcad_verify.mesh.segments import BLIND_RAD, CONCAVE_RAD, Edges, half_edge_vectors
from tbcad_verify.mesh.vectors import dot, norm, tangent_basis, unit
from tbcad_verify.record.flange_holes import Hole
from tbcad_verify.types import Floats, Ints

Groups = NDArray[np.int32]

# Neighbours in a hole's wall bend by no more than this: an octagon, 45 degrees, is a coarse hole; a
# hexagon, 60, is a nut's pocket.
BEND_RAD = math.radians(50)
MIN_BENDS = 5  # between facets of a patch: three quarters of an octagon
UPRIGHT_COS = 0.1  # maximum, between a wall's normals and its axis
ROUND = 0.02  # maximum deviation from the circle, of its radius
GAP_RAD = math.pi / 2 + 1e-3  # that may be missing of the full turn


@dataclass(frozen=True)
class RoundHoles:
    """The H holes, in the order of their first facets."""

    diameter: Floats  # (H,) mm of the circle through the corners; facets bulge inside it
    middle: Floats  # (3, H) mm, at half depth
    axis: Floats  # (3, H) unit, of either sign
    depth: Floats  # (H,) mm, of the cylinder
    wall: Ints  # the facets of all their walls, ascending

    @property
    def each(self) -> list[Hole]:
        """The holes one by one."""
        rows = zip(self.middle.T, self.axis.T, self.diameter / 2, self.depth, strict=True)
        return [
            Hole(point, axis, float(radius), float(depth)) for point, axis, radius, depth in rows
        ]


@dataclass(frozen=True)
class FacetPatches:
    """N facets in G patches."""

    facet: Ints  # (N,) indices, ascending
    group: Groups  # (N,) patch of each, 0 ... G - 1.
    count: int  # G


def round_holes(mesh: Mesh, edges: Edges) -> RoundHoles:
    """Find every round hole of which three quarters of the full turn are there."""
    clear, least = edges.noise < BLIND_RAD, CONCAVE_RAD + edges.noise
    bent = clear & (-edges.angle > least) & (-edges.angle < BEND_RAD)
    flat = clear & (np.abs(edges.angle) <= least)
    half, bend = edges.half[bent], -edges.angle[bent]
    links = np.concatenate([half, edges.half[flat]])
    links = np.stack([links // 3, mesh.twin[links] // 3])
    hollow = _bending(_joined(len(mesh.faces), links, np.arange(len(mesh.faces))), half // 3)
    label = np.full(len(mesh.faces), -1, dtype=np.int32)
    label[hollow.facet] = hollow.group
    axis = _axes(mesh, half, bend, label, hollow.count)
    upright = np.abs(dot(_normals(mesh, hollow), axis[:, hollow.group])) < UPRIGHT_COS
    return _round(mesh, _joined(len(mesh.faces), links, hollow.facet[upright]))


def _joined(size: int, links: Ints, facet: Ints) -> FacetPatches:
    """The given facets of `size`, in patches that links (2, L) between facets hold together."""
    number = np.full(size, -1)
    number[facet] = np.arange(facet.size)
    one, two = number[links]
    both = (one >= 0) & (two >= 0)
    count, group = connected_groups(facet.size, one[both], two[both])
    return FacetPatches(facet, group, count)


def _bending(patches: FacetPatches, bent: Ints) -> FacetPatches:
    """The patches with enough bends; `bent` has a facet of every bent edge."""
    enough = np.bincount(patches.group[bent], minlength=patches.count) >= MIN_BENDS
    mine = enough[patches.group]
    number = (np.cumsum(enough) - 1).astype(np.int32)
    return FacetPatches(patches.facet[mine], number[patches.group[mine]], int(enough.sum()))


def _axes(mesh: Mesh, half: Ints, bend: Floats, label: Groups, count: int) -> Floats:
    """(3, G) the direction along which each patch does not bend.

    Source: D. Cohen-Steiner, J.-M. Morvan, Restricted Delaunay Triangulations and Normal Cycle,
    2003: bent edges, by bend times length, add up to the curvature tensor, and lie across bending.
    """
    mine = label[half // 3] >= 0
    half, bend = half[mine], bend[mine]
    edge = half_edge_vectors(mesh, half)[1]
    tensor = _outer(edge, bend / norm(edge), label[half // 3], count)
    return np.ascontiguousarray(np.linalg.eigh(tensor)[1][:, :, 2].T)


def _outer(a: Floats, weight: Floats, group: Groups, count: int) -> Floats:
    """(G, 3, 3) sums of weight a a^T over each group; a is (3, N)."""
    sums = np.empty((count, 3, 3))
    for i in range(3):
        for j in range(i + 1):
            sums[:, i, j] = sums[:, j, i] = np.bincount(group, weight * a[i] * a[j], count)
    return sums


def _normals(mesh: Mesh, patches: FacetPatches) -> Floats:
    return unit(mesh.area[:, patches.facet])


def _round(mesh: Mesh, patches: FacetPatches) -> RoundHoles:
    """Project each patch along its axis, fit a circle, and keep the walls of round holes.

    Patches bend inward, so their normals point to the axis.
    """
    normal, group = _normals(mesh, patches), np.repeat(patches.group, 3)
    spread = _outer(normal, norm(mesh.area[:, patches.facet]), patches.group, patches.count)
    axis = np.ascontiguousarray(np.linalg.eigh(spread)[1][:, :, 0].T)
    sides = tangent_basis(axis)
    corner = np.take(mesh.points, mesh.faces[patches.facet].ravel(), axis=0).T
    flat = np.stack([dot(side[:, group], corner) for side in sides])
    centre, radius = fit_circles(flat, group, patches.count)
    radius = np.where(np.isfinite(radius), radius, 0.0)  # points on a line are no hole
    centre = np.where(radius > 0, centre, 0.0)
    spoke = flat - centre[:, group]
    off = np.abs(np.hypot(*spoke) - radius[group])
    uneven = group[~(off < ROUND * radius[group])]
    good = np.bincount(uneven, minlength=patches.count) == 0
    good &= widest_gaps(np.arctan2(spoke[1], spoke[0]), group, patches.count) < GAP_RAD
    along, (low, high) = dot(axis[:, group], corner), np.full((2, patches.count), np.inf)
    np.minimum.at(low, group, along)
    np.minimum.at(high, group, -along)
    high = -high
    middle = centre[0] * sides[0] + centre[1] * sides[1] + (low + high) / 2 * axis
    return RoundHoles(
        2 * radius[good],
        middle[:, good],
        axis[:, good],
        (high - low)[good],
        patches.facet[good[patches.group]],
    )


def fit_circles(points: Floats, group: Groups, count: int) -> tuple[Floats, Floats]:
    """Least-squares circle of each group; not finite where the points lie on a line.

    `points`: (2, N).
    `group`: (N,) 0 ... G - 1, each with at least one point.

    Returns:
        (2, G) centres and (G,) radii.

    Source: I. Kasa, A Circle Fitting Procedure and Its Error Analysis, 1976.
    """

    def mean(values: Floats) -> Floats:
        return np.asarray(np.bincount(group, values, count) / size)

    size = np.bincount(group, minlength=count)
    middle = np.stack([mean(row) for row in points])
    x, y = points - middle[:, group]  # about the middle, so that large terms do not cancel
    square = x * x + y * y
    xx, xy, yy = mean(x * x), mean(x * y), mean(y * y)
    p, q = mean(x * square) / 2, mean(y * square) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = np.stack([p * yy - q * xy, q * xx - p * xy]) / (xx * yy - xy * xy)
        return middle + offset, np.sqrt(offset[0] ** 2 + offset[1] ** 2 + xx + yy)


def widest_gaps(angle: Floats, group: Groups, count: int) -> Floats:
    """(G,) the widest gap between neighbouring angles of each group, rad; 2 pi of empty groups.

    `angle`: (N,) from -pi to pi; those that are not finite are left out.
    `group`: (N,) 0 ... G - 1.
    """
    angle, group = angle[np.isfinite(angle)], group[np.isfinite(angle)]
    order = np.lexsort((angle, group))
    angle, group = angle[order], group[order]
    widest = np.full(count, 2 * np.pi)
    if not group.size:
        return widest
    first = np.flatnonzero(np.diff(group, prepend=-1))
    last = np.append(first[1:], group.size) - 1
    step = np.diff(angle, append=0.0)
    step[last] = angle[first] + 2 * np.pi - angle[last]
    widest[group[first]] = np.maximum.reduceat(step, first)
    return widest
