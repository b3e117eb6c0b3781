"""Walls of pedestals in closed form, from the record alone.

A mirror on a pedestal ends at planes. Seen from the pinhole their corners are those of the planar
mirrors with the same apices and normals. From each corner a groove's bottom lies so far down the
ray as a groove is deep below the lowest mirror there; on the seam and the foot plane it lies down
the line in which these meet the plane of groove and pinhole. The wall on either side of a groove
contains the bottom and leans away from the plane through bottom and pinhole, by half the groove's
width at the height of the lower of its corners. Borders that would be shorter than the groove is
wide end in one corner. At the bounding planes see `pedestal_rims`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tbcad_verify.report.checks import Unknown
from tbcad_verify.step.pedestal_graph import Graph, Mirrors, graph_of, means, unit
from tbcad_verify.step.pedestal_rims import with_corners_farther_off, without_crowded_corners
from tbcad_verify.types import Bools, Floats, Ints

if TYPE_CHECKING:
    from tbcad_verify.step.sphere_union import CellEdges

DEPTH_WIDTHS = 4.0  # depth of a groove, in its width
MAX_ROUNDS = 100
# Sides of planar mirrors are longer than so many grooves, and at the bounding planes by this share
# of the mirrors' pitch; those of mirrors with radii, than WIDTHS grooves. A corner too near to a
# plane moves by a share of the shortest side there.
PLANAR_WIDTHS, PLANAR_SHARE, WIDTHS, RISE_SHARE = 1.2, 0.05, 0.25, 0.25


@dataclass(frozen=True)
class PedestalWalls:
    """The planes that end each of M mirrors, K at most.

    Attributes:
        point: (M, K, 3) mm, on each plane.
        normal: (M, K, 3) unit, into the pedestal.
        real: (M, K) false beyond the last plane of a mirror.
        across: (M, K) the mirror beyond; M + w for bounding plane w.
        bottom: (N, 3) mm, corners of the grooves' bottoms.
    """

    point: Floats
    normal: Floats
    real: Bools
    across: Ints
    bottom: Floats


def pedestal_walls(mirrors: Mirrors, planar: Mirrors, flat: CellEdges) -> PedestalWalls:
    """Walls of all pedestals; `flat` are the edges of planar mirrors in the same places.

    Raises:
        Unknown: no outline is left of a mirror.
    """
    graph = graph_of(flat, len(mirrors.point))
    more = PLANAR_SHARE * planar.pitch
    for _ in range(MAX_ROUNDS):
        settled = _settled(_Rule(planar, PLANAR_WIDTHS, more), graph, None)
        standing = _settled(_Rule(mirrors, WIDTHS, 0.0), settled.graph, settled.joined)
        if standing.graph is settled.graph:
            return standing.walls()
        graph = standing.graph
    raise Unknown("grooves do not end at seam and foot")


@dataclass(frozen=True)
class _Rule:
    """Which sides are too short: of which mirrors, in widths of the groove, and more at planes."""

    mirrors: Mirrors
    widths: float
    more: float


def _settled(rule: _Rule, graph: Graph, joined: Bools | None) -> _Standing:
    """Grooves and pedestals without short sides, nor ends of grooves too near to a plane.

    Args:
        rule: what too short is.
        graph: of planar mirrors.
        joined: (B,) borders whose ends are one corner; None: those shorter than a groove.
    """
    mirrors, groove = rule.mirrors, rule.mirrors.groove
    rise = RISE_SHARE * (groove + rule.more)
    for _ in range(MAX_ROUNDS):
        joined = graph.length < groove if joined is None else joined
        group = graph.groups(joined)
        eased = without_crowded_corners(mirrors, graph, group, rise)
        if eased is graph:
            standing = _Standing(mirrors, graph, joined)
            short = standing.short(rule.widths * groove, rule.more)
            if short.any():
                joined = joined | short
                continue
            near = standing.near_planes((min(rule.widths, 1.0) * groove + rule.more) / 2)[group]
            eased = with_corners_farther_off(mirrors, graph, near, rise)
            if eased is graph:
                return standing
        graph, joined = eased, None
    raise Unknown("grooves do not end at seam and foot")


class _Standing:
    """Grooves and pedestals for some borders joined to corners."""

    def __init__(self, mirrors: Mirrors, graph: Graph, joined: Bools) -> None:
        self.mirrors, self.graph, self.joined = mirrors, graph, joined
        self.count = len(mirrors.point)
        self.group = graph.groups(joined)
        number = int(self.group.max()) + 1
        ends = self.group[graph.ends]
        self.kept = np.flatnonzero(ends[:, 0] != ends[:, 1])
        self.faces, self.ends = graph.faces[self.kept], ends[self.kept]
        self.grooved = self.faces[:, 1] < self.count
        self.flat, self.plane = self._places(number)
        self._bottoms(number)
        self._planes()
        self.ring = self._rings()

    def _places(self, number: int) -> tuple[Floats, Ints]:
        """Joined corners, and the bounding plane that each lies on, -1 for none."""
        place = means(self.group, self.graph.place, self.graph.weight)
        plane = np.full(number, -1)
        for w, bound in enumerate(self.mirrors.bounds):
            ends = self.graph.ends[self.graph.faces[:, 1] == self.count + w]
            on = np.unique(self.group[ends])
            place[on] -= (place[on] @ bound[:3] - bound[3])[:, None] * bound[:3]
            plane[on] = w
        return place, plane

    def _bottoms(self, number: int) -> None:
        mirrors, bounds = self.mirrors, self.mirrors.bounds[:, :3]
        down = unit(self.flat - mirrors.pinhole)
        corner, mirror = self._meeting()
        light = np.zeros((number, 3))
        np.add.at(light, corner, mirrors.normal[mirror])
        grooves = self.ends[self.grooved]
        view = self.flat[grooves] - mirrors.pinhole
        across = np.cross(view[:, 0], view[:, 1])
        along = np.zeros((number, 3))
        for end in grooves.T:
            on = self.plane[end] >= 0
            line = unit(np.cross(across[on], bounds[self.plane[end[on]]]))
            into = -np.sign((line * light[end[on]]).sum(axis=1))
            np.add.at(along, end[on], into[:, None] * line)
        deep = np.isin(np.arange(number), grooves)
        both = np.cross(*bounds)
        along = np.where(deep[:, None], unit(along), -np.sign(light @ both)[:, None] * both)
        down = np.where((self.plane >= 0)[:, None], along, down)
        drop = np.zeros(number)
        np.maximum.at(drop, corner, mirrors.drop(mirror, self.flat[corner], down[corner]))
        self.top = self.flat + drop[:, None] * down
        self.bottom = self.top + (deep * mirrors.groove * DEPTH_WIDTHS)[:, None] * down
        self.deep = deep

    def _meeting(self) -> tuple[Ints, Ints]:
        """Corners and the mirrors that meet there, each pair once."""
        graph = self.graph
        tied = [
            np.column_stack([self.group[graph.ends[:, e]], graph.faces[:, f]])
            for e in (0, 1)
            for f in (0, 1)
        ]
        pairs = np.unique(np.concatenate(tied), axis=0)
        pairs = pairs[pairs[:, 1] < self.count]
        return pairs[:, 0], pairs[:, 1]

    def _planes(self) -> None:
        """For both faces of each kept border the inward normal of the plane that ends it."""
        mirrors = self.mirrors
        self.normal = np.zeros((len(self.kept), 2, 3))
        bounded = ~self.grooved
        self.normal[bounded, 0] = mirrors.bounds[self.faces[bounded, 1] - self.count, :3]
        ends, faces = self.ends[self.grooved], self.faces[self.grooved]
        start, end = self.bottom[ends[:, 0]], self.bottom[ends[:, 1]]
        along = unit(end - start)
        middle = unit(np.cross(start - mirrors.pinhole, along))
        apart = mirrors.point[faces[:, 0]] - mirrors.point[faces[:, 1]]
        middle *= np.sign((middle * apart).sum(axis=1))[:, None]
        view = mirrors.pinhole - start
        up = unit(view - (view * along).sum(axis=1)[:, None] * along)
        rise = np.min([((self.top - self.bottom)[e] * up).sum(axis=1) for e in ends.T], axis=0)
        lean = (mirrors.groove / 2 / rise)[:, None] * up
        self.normal[self.grooved] = unit(np.stack([middle - lean, -middle - lean], axis=1))

    def _rings(self) -> list[list[tuple[int, int]]]:
        """Borders round each mirror in order, and which of their faces it is."""
        leaving: list[dict[int, tuple[int, int]]] = [{} for _ in range(self.count)]
        for border, ((one, other), (a, b)) in enumerate(
            zip(self.faces.tolist(), self.ends.tolist(), strict=True)
        ):
            leaving[one][a] = (border, 0)
            if other < self.count:
                leaving[other][b] = (border, 1)
        rings = []
        for sides in leaving:
            corner, ring = next(iter(sides), -1), []
            for _ in sides:
                if corner not in sides:
                    raise Unknown("a mirror's outline is not closed")
                border, face = sides[corner]
                ring.append((border, face))
                corner = int(self.ends[border, 1 - face])
            if len(ring) < 3:
                raise Unknown("grooves leave no outline of a mirror")
            rings.append(ring)
        return rings

    def near_planes(self, limit: float) -> Bools:
        """(G,) corners off the bounding planes whose bottoms are nearer to one than a limit, mm."""
        bounds = self.mirrors.bounds
        height = self.bottom @ bounds[:, :3].T - bounds[:, 3]
        return np.asarray((height < limit).any(axis=1) & (self.plane < 0))

    def short(self, limit: float, more: float) -> Bools:
        """(B,) borders along which a side is shorter than a limit, at bounding planes by more."""
        mirror = np.repeat(np.arange(self.count), [len(ring) for ring in self.ring])
        here = np.array([side for ring in self.ring for side in ring])
        before = np.array([side for ring in self.ring for side in [ring[-1], *ring[:-1]]])
        after = np.concatenate(
            [np.roll(np.arange(len(ring)), -1) + shift for ring, shift in self._shifted()]
        )
        corner = self.ends[here[:, 0], here[:, 1]]
        line = unit(
            np.cross(self.normal[before[:, 0], before[:, 1]], self.normal[here[:, 0], here[:, 1]])
        )
        k, offset = self.mirrors.curvature[mirror], self.bottom[corner] - self.mirrors.point[mirror]
        slope = ((self.mirrors.normal[mirror] + k[:, None] * offset) * line).sum(axis=1)
        line *= np.where(slope > 0, -1.0, 1.0)[:, None]
        point = (
            self.bottom[corner]
            + self.mirrors.drop(mirror, self.bottom[corner], line)[:, None] * line
        )
        along = unit(self.flat[corner[after]] - self.flat[corner])
        bottom = self.bottom[corner]
        length = np.min([((at[after] - at) * along).sum(axis=1) for at in (point, bottom)], axis=0)
        short = np.zeros(len(self.graph.faces), dtype=np.bool_)
        at_plane = (self.plane[self.ends[here[:, 0]]] >= 0).any(axis=1)
        short[self.kept[here[length < limit + more * at_plane, 0]]] = True
        return short

    def _shifted(self) -> list[tuple[list[tuple[int, int]], int]]:
        starts = np.cumsum([0, *(len(ring) for ring in self.ring)]).tolist()
        return list(zip(self.ring, starts, strict=False))

    def walls(self) -> PedestalWalls:
        """Tables of the planes round each mirror."""
        most = max(len(ring) for ring in self.ring)
        shape = self.count, most
        point, normal = np.zeros((*shape, 3)), np.zeros((*shape, 3))
        real, across = np.zeros(shape, dtype=np.bool_), np.full(shape, -1)
        for mirror, ring in enumerate(self.ring):
            border, face = np.array(ring).T
            n = len(ring)
            point[mirror, :n] = self.bottom[self.ends[border, 0]]
            normal[mirror, :n] = self.normal[border, face]
            across[mirror, :n] = self.faces[border, 1 - face]
            real[mirror, :n] = True
        return PedestalWalls(point, normal, real, across, self.bottom[self.deep])
