"""Planes in which a shell or a negative must end, and where the holes of both belong.

Bolts and dowels lie at even distances along a section of a spheroid that is half a flange's width
larger than the back: the seam flange's in the plane of its far face, the foot flange's in the plane
of the foot. The other half lies beyond the seam x = 0, the table or the base below the foot: what
sticks out by a tenth of a millimetre keeps the joint open. A negative has blind holes of the same
sizes, a wall away from every mirror.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.record.export import Camera, Export, Part
from tbcad_verify.record.spec import FlangeSpec
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, short_list
from tbcad_verify.types import Floats

X, Y, Z = range(3)
PARALLEL = 1e-6  # of a hole's axis and its flange's, or x or z
SAMPLES = 20_001  # points on a section
DEPTH_DIAMETERS = 2.0  # of a blind hole, in those of the flange's largest
ROUND = 24  # points on a rim


@dataclass(frozen=True)
class Hole:
    """A round hole."""

    point: Floats  # (3,) mm, on the axis at half depth
    axis: Floats  # (3,) unit; its sign has no meaning
    radius: float  # mm
    depth: float  # mm


@dataclass(frozen=True)
class Flange:
    """A flange with the H holes that it should have."""

    name: str  # "seam" or "foot"
    axis: int  # of the holes, X or Z
    thickness: float  # mm
    middle: Floats  # (H, 3) mm, of each hole at half depth
    diameter: Floats  # (H,) mm


@dataclass(frozen=True)
class HoleLimits:
    """By how much holes may be off."""

    size: float  # of diameter and depth, mm
    place: float  # mm


def flanges(export: Export, camera: Camera, beyond: float) -> tuple[Flange, Flange]:
    """Both flanges of one camera's half.

    `beyond`: by how much the back's semi-axes exceed the ellipsoid's, mm.

    Unknown: the back does not reach the flanges.
    """
    seam, foot = export.spec.shell.seam_flange, export.spec.shell.foot_flange
    low, across = export.foot_z_mm, seam.thickness_mm
    side = np.array([np.sign(camera.pinhole[X]), 1.0, 1.0])  # of camera b's half: its mirror image
    pinhole, semi_minor = side * camera.pinhole, export.semi_minor_mm
    semi_axes = np.array([np.hypot(semi_minor, np.linalg.norm(pinhole) / 2), semi_minor]) + beyond

    def line(flange: FlangeSpec, axis: int, at: float, lowest: float, end: float) -> Floats:
        section = _section(semi_axes + flange.width_mm / 2, pinhole, axis, at)
        return _even(section, lowest, end, flange.bolts + flange.dowels)

    on_seam = line(seam, X, across, low + foot.thickness_mm, seam.width_mm)
    on_foot = line(foot, Z, low, across + seam.width_mm / 2, foot.width_mm / 2)
    return (
        _flange("seam", X, seam, on_seam, across / 2, side),
        _flange("foot", Z, foot, on_foot, low + foot.thickness_mm / 2, side),
    )


def hole_faults(holes: Sequence[Hole], wanted: Sequence[Flange], limits: HoleLimits) -> list[str]:
    """Faults of the holes of a half: number, diameter, direction, depth and place."""
    faults: list[str] = []
    for flange in wanted:
        mine = [hole for hole in holes if _is_along(hole, flange)]
        faults += [f"{flange.name} flange: {fault}" for fault in _faults(mine, flange, limits)]
    return faults + [
        f"a hole of {2 * hole.radius:g} mm in no flange"
        for hole in holes
        if not any(_is_along(hole, flange) for flange in wanted)
    ]


def _section(semi_axes: Floats, pinhole: Floats, axis: int, at: float) -> Floats:
    """(S, 2) a spheroid's section at x or z: y and the other coordinate, up and down again.

    Unknown: the plane misses it.
    """
    major, minor = semi_axes
    major_axis, centre = pinhole / np.linalg.norm(pinhole), pinhole / 2
    along = np.outer(major_axis, major_axis)
    form = (np.eye(3) - along) / minor**2 + along / major**2
    plane, height = [Y, Z - axis], at - centre[axis]
    inner, mixed = form[np.ix_(plane, plane)], form[plane, axis] * height
    middle = -np.linalg.solve(inner, mixed)
    rest = 1 - form[axis, axis] * height**2 - mixed @ middle
    if rest <= 0:
        raise Unknown("the back does not reach its flange")
    angle = np.linspace(-np.pi, np.pi, SAMPLES)
    spoke = np.column_stack([np.sin(angle), np.cos(angle)])
    length = np.sqrt(rest / np.einsum("ni,ij,nj->n", spoke, inner, spoke))
    return np.asarray(centre[plane] + middle + length[:, None] * spoke)


def _even(section: Floats, lowest: float, end: float, count: int) -> Floats:
    """(H, 2) places at even distances along the part of a section above a coordinate.

    Unknown: nothing is above it.
    """
    above = np.flatnonzero(section[:, 1] > lowest)
    if not above.size or above[0] == 0 or above[-1] == len(section) - 1:
        raise Unknown("the back does not reach its flange")
    steps = np.linalg.norm(np.diff(section, axis=0), axis=1)
    along = np.concatenate([[0], np.cumsum(steps)])
    first, last = ([above[0] - 1, above[0]], [above[-1] + 1, above[-1]])
    start, stop = (np.interp(lowest, section[k, 1], along[k]) for k in (first, last))
    places = np.linspace(start + end, stop - end, count)
    return np.column_stack([np.interp(places, along, column) for column in section.T])


def _flange(
    name: str, axis: int, spec: FlangeSpec, places: Floats, height: float, side: Floats
) -> Flange:
    """Put the holes at half depth, dowels near the ends and evenly between."""
    middle = places[:, [1, 0, 1]]
    middle[:, axis] = height
    diameter = np.full(len(middle), spec.bolt_hole_mm)
    dowels = np.round(np.linspace(1, len(middle) - 2, spec.dowels)).astype(int)
    diameter[dowels] = spec.dowel_hole_mm
    return Flange(name, axis, spec.thickness_mm, side * middle, diameter)


def _is_along(hole: Hole, flange: Flange) -> bool:
    return abs(float(hole.axis[flange.axis])) > 1 - PARALLEL


def _faults(holes: Sequence[Hole], flange: Flange, limits: HoleLimits) -> Iterator[str]:
    have = np.array([2 * hole.radius for hole in holes])
    for diameter in sorted({*flange.diameter.tolist(), *_others(have, flange, limits.size)}):
        number = int((np.abs(have - diameter) <= limits.size).sum())
        wanted = int((flange.diameter == diameter).sum())
        if number != wanted:
            yield f"{number} holes of {diameter:g} mm, not {wanted}"
    for hole in holes:
        if abs(hole.depth - flange.thickness) > limits.size:
            yield f"a hole {hole.depth:g} mm deep, not {flange.thickness:g}"
        same = np.abs(flange.diameter - 2 * hole.radius) <= limits.size
        off = np.linalg.norm(flange.middle[same] - hole.point, axis=1).min(initial=np.inf)
        if limits.place < off < np.inf:
            yield f"a hole of {2 * hole.radius:g} mm is {off:.3g} mm from its place"


def _others(have: Floats, flange: Flange, size: float) -> list[float]:
    """Diameters that no hole of a flange should have."""
    known = np.abs(have[:, None] - flange.diameter).min(axis=1, initial=np.inf) <= size
    return [float(one) for one in np.unique(have[~known].round(6))]


def has_joining_planes(export: Export, part: Part) -> bool:
    """Whether a part is one camera's half: other parts may be anywhere."""
    return part.camera in export.cameras


def ends_check(
    name: CheckName,
    export: Export,
    part: Part,
    box: tuple[Sequence[float], Sequence[float]],
    limit: float,
) -> Check:
    """A half ends in the planes of seam and foot, neither beyond nor short of them.

    `box`: its minimum and maximum x, y, z, mm.
    `limit`: mm.
    """
    beyond = _beyond(export, part, box)
    worst = max(abs(way) for way in beyond.values())
    told = [_told(plane, way) for plane, way in beyond.items() if not abs(way) <= limit]
    return at_most(name, worst, limit, f"{part.name} ends {short_list(told)}")


def _beyond(
    export: Export, part: Part, box: tuple[Sequence[float], Sequence[float]]
) -> dict[str, float]:
    """How far a half reaches beyond each plane, mm; negative: how far it falls short."""
    low, high = box
    side = float(np.sign(export.cameras[part.camera].pinhole[X]))
    nearest = low[X] if side > 0 else -high[X]
    return {"seam": -nearest, "foot": export.foot_z_mm - low[Z]}


def _told(plane: str, way: float) -> str:
    return f"{abs(way):.3g} mm {'beyond' if way > 0 else 'short of'} the {plane}"


def blind_hole_faults(
    holes: Sequence[Hole], export: Export, camera: str, limits: HoleLimits
) -> list[str]:
    """Faults of the holes of one camera's negative.

    `holes`: of its seam (along x) and its foot (along z).
    `limits`: by how much sizes and places may be off.
    """
    shell = export.spec.shell
    faults: list[str] = []
    for plane, axis, flange in (("seam", X, shell.seam_flange), ("foot", Z, shell.foot_flange)):
        mine = [hole for hole in holes if abs(float(hole.axis[axis])) > 1 - PARALLEL]
        mouth = 0.0 if axis == X else export.foot_z_mm
        inward = float(np.sign(export.cameras[camera].pinhole[X])) if axis == X else 1.0
        faults += [f"{plane}: {one}" for one in _sizes(mine, flange, limits.size)]
        faults += [
            f"{plane}: {one}" for one in _depths(mine, axis, mouth, inward, _depth(flange), limits)
        ]
    faults += [
        f"a hole of {2 * hole.radius:g} mm is square to neither plane"
        for hole in holes
        if max(abs(float(hole.axis[axis])) for axis in (X, Z)) <= 1 - PARALLEL
    ]
    return faults + list(_thin_walls(holes, export, camera, limits))


def _depth(flange: FlangeSpec) -> float:
    return DEPTH_DIAMETERS * max(
        flange.bolt_hole_mm, flange.dowel_hole_mm if flange.dowels else 0.0
    )


def _sizes(holes: Sequence[Hole], flange: FlangeSpec, size: float) -> Iterator[str]:
    wanted = Counter({flange.bolt_hole_mm: flange.bolts})
    wanted[flange.dowel_hole_mm] += flange.dowels
    found = sum(
        any(abs(2 * hole.radius - diameter) <= size for diameter in wanted) for hole in holes
    )
    if found != len(holes):
        yield f"{len(holes) - found} holes of another size"
    for diameter, number in wanted.items():
        have = sum(abs(2 * hole.radius - diameter) <= size for hole in holes)
        if have != number:
            yield f"{have} holes of {diameter:g} mm, not {number}"


def _depths(
    holes: Sequence[Hole], axis: int, mouth: float, inward: float, depth: float, limits: HoleLimits
) -> Iterator[str]:
    for hole in holes:
        if abs(hole.depth - depth) > limits.size:
            yield f"a hole {hole.depth:g} mm deep, not {depth:g}"
        opening = hole.point[axis] - inward * hole.depth / 2
        if abs(opening - mouth) > limits.place:
            yield f"a hole begins {abs(opening - mouth):.3g} mm from its plane"


def _thin_walls(
    holes: Sequence[Hole], export: Export, camera: str, limits: HoleLimits
) -> Iterator[str]:
    mirrors = export.mirrors.take(np.flatnonzero(export.mirrors.camera == camera))
    surfaces = mirrors.surfaces().coated(-export.coating_mm)
    for hole in holes:
        left = _distance(surfaces, _rims(hole))
        if left < export.spec.shell.wall_mm - limits.place:
            yield f"a hole is {left:.3f} mm from a mirror, not {export.spec.shell.wall_mm:g}"


def _rims(hole: Hole) -> Floats:
    """(3, N) points round both ends of a hole along x or z, mm."""
    angle = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)
    across = [Y, Z] if abs(hole.axis[X]) > abs(hole.axis[Z]) else [X, Y]
    offset = np.zeros((3, ROUND))
    offset[across] = hole.radius * np.stack([np.cos(angle), np.sin(angle)])
    half = hole.depth / 2 * hole.axis[:, None]
    return np.concatenate([hole.point[:, None] + end * half + offset for end in (-1, 1)], axis=1)


def _distance(surfaces: Surfaces, points: Floats) -> float:
    """Least distance of points (3, N) from any of M mirrors, mm."""
    return min(float(surfaces.height(point[:, None]).min()) for point in points.T)
