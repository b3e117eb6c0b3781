"""Grooves between mirrors on pedestals: planes of a STEP file, against record and spec.

Where a groove runs is the build's choice, and its areas are in the record. How deep it is and how
its walls lean follows: its bottom ends four widths below the lowest mirror there, along the ray
from the pinhole, or on the seam and the foot plane along the line in which these meet the plane of
groove and pinhole. The wall on either side contains the bottom and leans away from that plane, by
half the groove's width at the height of the lower of its corners.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.report.checks import Unknown
from tbcad_verify.step.cell_boundaries import partners
from tbcad_verify.step.part21 import StepTable
from tbcad_verify.step.step_file import StepFaces
from tbcad_verify.types import Bools, Floats, Ints

VERTEX = "VERTEX_POINT"
DEPTH_WIDTHS = 4.0  # depth of a groove, in its width
ON_PLANE_MM = 1e-6


@dataclass(frozen=True)
class Grooves:
    """The W walls of M mirrors in a STEP file; those on both sides of a groove end at its bottom.

    Attributes:
        mirror: (W,) ascending, number of the mirror that each ends.
        across: (W,) number of the mirror across the groove.
        point: (3, W) mm, on each plane; NaN where a wall is none.
        normal: (3, W) unit, into the pedestal.
        corner: (2, W) numbers of the corners where the bottom ends.
        bottom: (C, 3) mm, corners of the bottoms; NaN stands for those of walls that have not two.
        names: W, of the faces.
    """

    mirror: Ints
    across: Ints
    point: Floats
    normal: Floats
    corner: Ints
    bottom: Floats
    names: Sequence[str]

    def planes(self, count: int, bounds: Floats) -> tuple[Floats, Floats, Bools]:
        """Points and normals (M, K, 3) of what ends each mirror, and which (M, K) there are.

        The last two are the bounding planes (2, 4).
        """
        number = np.bincount(self.mirror, minlength=count)
        column = np.arange(len(self.mirror)) - np.repeat(np.cumsum(number) - number, number)
        shape = count, int(number.max()) + len(bounds)
        point, normal, real = (
            np.zeros((*shape, 3)),
            np.zeros((*shape, 3)),
            np.zeros(shape, np.bool_),
        )
        point[self.mirror, column], normal[self.mirror, column] = self.point.T, self.normal.T
        real[self.mirror, column] = True
        normal[:, -len(bounds) :], real[:, -len(bounds) :] = bounds[:, :3], True
        point[:, -len(bounds) :] = bounds[:, :3] * bounds[:, 3:]
        return point, normal, real


def fronts(names: Sequence[str], ids: frozenset[str]) -> frozenset[str]:
    """Names of the faces that are mirrors, whose names are `ids`, or walls below them."""
    return frozenset(name for name in names if ids.issuperset(name.split("_")))


def read_grooves(table: StepTable, faces: StepFaces, ids: Sequence[str]) -> Grooves:
    """The walls of mirrors (M,) with these names; `faces` are seen from the light.

    A wall has the names of its mirror and of the one across its groove.

    Unknown: there are none.
    """
    number = {one: k for k, one in enumerate(ids)}
    row = {one: k for k, one in enumerate(faces.names)}
    pairs = [wall.split("_") for wall in fronts(faces.names, frozenset(ids)) - {*ids}]
    if not pairs or any(len(pair) != 2 for pair in pairs):
        raise Unknown("no walls of pedestals, or of more than two mirrors")
    pairs.sort(key=lambda pair: [number[one] for one in pair])
    names = ["_".join(pair) for pair in pairs]
    mirror, across = np.array([[number[one] for one in pair] for pair in pairs]).T
    corners = {
        table.label(face): {one for one in table.reached(face) if table.kinds.get(one) == VERTEX}
        for face in table.of("ADVANCED_FACE")
    }
    shared = [corners[f"{a}_{b}"] & corners.get(f"{b}_{a}", set()) for a, b in pairs]
    ends = np.array([sorted(some) if len(some) == 2 else [-1, -1] for some in shared])
    vertices, corner = np.unique(ends, return_inverse=True)
    bottom = [
        table.triple(table.references(one)[0]) if one >= 0 else [np.nan] * 3
        for one in vertices.tolist()
    ]
    at = [row[name] for name in names]
    point, normal = faces.point[at].T, -faces.normal[at].T
    corner = corner.reshape(-1, 2).T
    return Grooves(mirror, across, point, normal, corner, np.array(bottom), names)


def wall_errors(
    grooves: Grooves, light: Surfaces, pinhole: Floats, bounds: Floats, width: float
) -> Floats:
    """(W,) how far each wall is from where its groove's bottom has it, mm and unit vectors.

    The largest of the plane's distance from the bottom, the difference of the normals, and the
    error of the bottom's depth; infinite for what is no wall of a groove.

    `pinhole`: (3,) mm.
    `bounds`: (2, 4) planes of seam and foot.
    `width`: of the grooves, mm.
    """
    start, end = (grooves.bottom[corner] for corner in grooves.corner)
    along = _unit(end - start)
    middle = _unit(np.cross(start - pinhole, along))
    apart = (light.point[:, grooves.mirror] - light.point[:, grooves.across]).T
    middle *= np.sign((middle * apart).sum(axis=1))[:, None]
    view = pinhole - start
    up = _unit(view - (view * along).sum(axis=1)[:, None] * along)
    ways = [_way_down(grooves, middle, at, pinhole, bounds) for at in (start, end)]
    rise = DEPTH_WIDTHS * width * np.min([-(way * up).sum(axis=1) for way in ways], axis=0)
    lean = (width / 2 / rise)[:, None] * up
    error = np.max(
        [
            np.abs(((grooves.point.T - start) * grooves.normal.T).sum(axis=1)),
            np.linalg.norm(grooves.normal.T - _unit(middle - lean), axis=1),
            *(
                np.abs(_depth(grooves, light, corner, way) - DEPTH_WIDTHS * width)
                for corner, way in zip(grooves.corner, ways, strict=True)
            ),
        ],
        axis=0,
    )
    return np.where(np.isnan(error), np.inf, error)


def _way_down(
    grooves: Grooves, middle: Floats, place: Floats, pinhole: Floats, bounds: Floats
) -> Floats:
    """(W, 3) unit, from the mirrors down to ends (W, 3) of bottoms."""
    down = _unit(place - pinhole)
    for bound in bounds:
        line = _unit(np.cross(middle, bound[:3]))
        line *= np.where((line * down).sum(axis=1) < 0, -1.0, 1.0)[:, None]
        on = np.abs(place @ bound[:3] - bound[3]) < ON_PLANE_MM
        down = np.where(on[:, None], line, down)
    return down


def _depth(grooves: Grooves, light: Surfaces, corner: Ints, down: Floats) -> Floats:
    """(W,) mm from ends of bottoms up to the lowest of the mirrors whose grooves end there."""
    ends, mirror = np.unique([grooves.corner.ravel(), np.tile(grooves.mirror, 2)], axis=1)
    meeting, one = partners(corner, ends)
    mirrors = light.take(mirror[one])
    bottom = grooves.bottom[corner[meeting]].T
    way, k = down[meeting].T, mirrors.curvature
    offset = bottom - mirrors.point
    height = (offset * mirrors.normal).sum(axis=0) + k / 2 * (offset**2).sum(axis=0)
    slope = ((mirrors.normal + k * offset) * way).sum(axis=0)
    up = 2 * height / (slope - np.sqrt(slope**2 - 2 * k * height))
    depth = np.full(len(corner), np.inf)
    with np.errstate(invalid="ignore"):
        np.minimum.at(depth, meeting, up)
    return depth


def _unit(v: Floats) -> Floats:
    """Vectors (N, 3) divided by their lengths; NaN for zero."""
    with np.errstate(invalid="ignore"):
        return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))
