"""Blind holes of a negative: the sizes of the shell's flanges, a wall away from every mirror."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.record.export import Export
from tbcad_verify.record.flange_holes import Hole, HoleLimits, X, Y, Z
from tbcad_verify.record.spec import FlangeSpec
from tbcad_verify.types import Floats

PARALLEL = 1e-6  # of a hole's axis and x or z
DEPTH_DIAMETERS = 2.0  # of the flange's largest hole
ROUND = 24  # points on a rim


def blind_hole_faults(
    holes: Sequence[Hole], export: Export, camera: str, limits: HoleLimits
) -> list[str]:
    """What is wrong with the holes of one camera's negative.

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
