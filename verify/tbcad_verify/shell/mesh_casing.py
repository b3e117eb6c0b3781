"""Casing of a shell behind its mirrors, measured on its mesh: wall and holes.

Rays start at the valleys between mirrors and leave through the back, along the normal of the
ellipsoid. The facets that they meet say how far the back is beyond the ellipsoid, the valleys how
deep the mirrors reach; the wall is what is left between, as long as a ray needs for it. Between the
deepest valley and the back is nothing, and beyond the back nothing but flanges: so every corner of
the casing away from joining faces and flanges is on the back, and so are its facets' middles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.holes import RoundHoles
from tbcad_verify.mesh.rays import first_hits
from tbcad_verify.mesh.segments import rounding
from tbcad_verify.mesh.spheroids import growth, least_wall
from tbcad_verify.mesh.vectors import dot, unit
from tbcad_verify.record.export import Camera, Export, Part
from tbcad_verify.record.flange_holes import HoleLimits, flanges, hole_faults
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    check_names,
    guarded,
    require,
    short_list,
)
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.types import Bools, Floats

# Corners of facets are on the exact surfaces, but for float32: its rounding comes on top.
WALL_MM, SIZE_MM, PLACE_MM = 1e-3, 1e-3, 2e-3
ROUNDINGS = 8
# Maximum distance of a facet's middle from the back, of the mesh's error, which the kernel's mesher
# keeps along edges: middles of its largest facets are off by up to 2.3 of it.
CHORDS = 3.0
SQUARE_COS = math.cos(math.radians(30))  # of a ray and the back's normal; a joining face has less
LIFT_MM = 1e-3  # by which rays start below the valley
NOT_MEASURED = "holes were not looked for: see the checks of printers"
CHECKS = {"mesh wall": "mm", "mesh holes": "faults"}


@dataclass(frozen=True)
class Valleys:
    """Corners of one part's mesh where mirrors meet, or the walls of their pedestals."""

    point: Floats  # (3, V) mm; of joining faces, where mirrors end; of grooves, their bottoms
    inner: Bools  # (V,) whether only mirrors meet there, and no joining face


@dataclass(frozen=True)
class MeshCasing:
    """Where a half's mirrors end and its back begins."""

    semi_axes: Floats  # of the camera's ellipsoid along its axis and across it, (2,) mm
    deepest: float  # by how much the ellipsoid must grow to hold all valleys, mm
    beyond: float  # by how much to be the back, mm: half of its corners are within
    ends: tuple[float, float]  # the same, where the back is nearest and farthest

    def walls(self) -> list[float]:
        """Material behind the deepest valley: as usual, where the back is nearest, and farthest."""
        return [
            least_wall(self.semi_axes, self.deepest, more) for more in (self.beyond, *self.ends)
        ]


def casing_checks(setup: OpticalSetup, holes: Mapping[str, RoundHoles]) -> list[Check]:
    """Wall and holes of every camera's half that has a STEP, against the spec."""
    return [
        check
        for number, part in enumerate(setup.export.parts)
        if _is_cased(setup.export, part)
        for check in _of_part(setup, number, holes.get(part.name))
    ]


def casing_names(export: Export) -> list[CheckName]:
    """Name, file and unit of these checks."""
    halves = [part for part in export.parts if _is_cased(export, part)]
    return [name for part in halves for name in check_names(CHECKS, part.stl)]


def _is_cased(export: Export, part: Part) -> bool:
    """Whether a part is a camera's half with its casing: what is a mesh only may have none."""
    return bool(part.step) and part.camera in export.cameras


def measure_casing(setup: OpticalSetup, number: int) -> MeshCasing:
    """Valleys and back of one part. Unknown: no mirrors meet, or no ray leaves through a back."""
    export = setup.export
    camera = export.cameras[export.parts[number].camera]
    focal = float(np.linalg.norm(camera.pinhole)) / 2
    semi_axes = np.array([np.hypot(export.semi_minor_mm, focal), export.semi_minor_mm])
    valleys = find_valleys(setup, number)
    back = _back(setup, valleys, camera)
    if not back.size:
        raise Unknown("no ray from a valley between mirrors leaves through a back")
    deepest = float(growth(semi_axes, camera, valleys.point).max())
    beyond = float(np.median(growth(semi_axes, camera, back)))
    more = _back_wall(setup, number, lambda point: growth(semi_axes, camera, point) - beyond)
    if export.spec.shell.edges == "pedestal":  # whose walls end at the deepest valley
        more = more[more > deepest - beyond + ROUNDINGS * rounding(setup.mesh)]
    ends = beyond + float(more.min(initial=0)), beyond + float(more.max(initial=0))
    return MeshCasing(semi_axes, deepest, beyond, ends)


def _back_wall(setup: OpticalSetup, number: int, far: Callable[[Floats], Floats]) -> Floats:
    """How far each corner of the casing but of flanges is beyond the back, mm, and each middle.

    A middle's chord error is taken off, as far as it is allowed.

    `far`: of points (3, N), mm.
    """
    mesh, export, label = setup.mesh, setup.export, setup.recovery.segments.label
    blur = ROUNDINGS * rounding(mesh)
    facets = mesh.faces[(setup.part[label] == number) & (setup.owner()[label] < 0)]
    heights = mesh.points[:, [0, 2]] - [0, export.foot_z_mm]
    flanges = export.spec.shell.seam_flange, export.spec.shell.foot_flange
    thick = np.array([flange.thickness_mm for flange in flanges])
    corner = np.unique(facets)
    distance = np.zeros(len(mesh.points))
    distance[corner] = far(mesh.points[corner].T)
    flat = (np.abs(heights) <= blur).any(axis=1)
    in_flange = (np.abs(heights) <= thick + blur).any(axis=1) & (distance >= -blur)
    free = corner[~(flat | in_flange)[corner]]
    on_back = (np.abs(distance) <= WALL_MM)[facets].all(axis=1)
    level = (np.abs(heights)[facets] <= thick + blur).all(axis=1).any(axis=1)
    middles = far(mesh.points[facets[on_back & ~level]].mean(axis=1).T)
    allowed = CHORDS * export.mesh_error_mm
    chords = np.minimum(middles + allowed, 0) + np.maximum(middles - allowed, 0)
    return np.concatenate([distance[free], chords])


def _of_part(setup: OpticalSetup, number: int, round_holes: RoundHoles | None) -> list[Check]:
    export, part = setup.export, setup.export.parts[number]
    wall, holes = check_names(CHECKS, part.stl)
    asked, blur = export.spec.shell.wall_mm, ROUNDINGS * rounding(setup.mesh)

    def work() -> list[Check]:
        casing = measure_casing(setup, number)
        measured = max(casing.walls(), key=lambda one: abs(one - asked))
        detail = f"the wall is {measured:.3f} mm, the spec has {asked:g}"
        wanted = flanges(export, export.cameras[part.camera], casing.beyond)
        limits = HoleLimits(SIZE_MM + blur, PLACE_MM + blur)
        faults = hole_faults(require(round_holes, NOT_MEASURED).each, wanted, limits)
        return [
            at_most(wall, abs(measured - asked), WALL_MM + blur, detail),
            at_most(holes, len(faults), 0, short_list(faults)),
        ]

    return guarded([wall, holes], work)


def find_valleys(setup: OpticalSetup, number: int) -> Valleys:
    """Corners of mirrors' outlines, at other mirrors and joining faces; or the bottoms of grooves.

    Only a mirror's corner on both joining faces may be deeper than where mirrors meet.
    """
    mesh, label = setup.mesh, setup.recovery.segments.label
    mine = setup.part[label] == number
    mirror = np.where(mine, setup.owner()[label], -1)
    half = np.flatnonzero(np.repeat(mirror >= 0, 3) & (mesh.twin >= 0))
    one, two = mirror[half // 3], mirror[mesh.twin[half] // 3]
    if not np.any((two >= 0) & (one != two)):
        return _grooves(setup, mine, mirror >= 0)
    half = half[one != two]
    corner = np.unique(mesh.faces[half // 3, half % 3])
    joining = np.zeros(len(mesh.points), dtype=np.bool_)
    joining[mesh.faces[mine & (mirror < 0)]] = True
    return Valleys(np.ascontiguousarray(mesh.points[corner].T), ~joining[corner])


def _grooves(setup: OpticalSetup, mine: Bools, mirror: Bools) -> Valleys:
    """Corners of the bottoms of grooves: of facets beside mirrors, but in no joining face."""
    mesh = setup.mesh
    upper = np.zeros(len(mesh.points), dtype=np.bool_)
    upper[mesh.faces[mirror]] = True
    beside = np.flatnonzero(mine & ~mirror & upper[mesh.faces].any(axis=1))
    blur = ROUNDINGS * rounding(mesh)
    away = np.abs(mesh.points[:, [0, 2]] - np.array([0, setup.export.foot_z_mm]))
    planes: Bools = np.asarray(away <= blur)
    joining = np.any(planes[mesh.faces[beside]].all(axis=1), axis=1)
    corner = np.unique(mesh.faces[beside[~joining]])
    corner = corner[~upper[corner]]
    return Valleys(np.ascontiguousarray(mesh.points[corner].T), ~np.any(planes[corner], axis=1))


def _back(setup: OpticalSetup, valleys: Valleys, camera: Camera) -> Floats:
    """(3, B) corners of the facets through which rays from inner valleys leave, mm."""
    start = valleys.point[:, valleys.inner]
    direction = unit(unit(start) + unit(start - camera.pinhole[:, None]))
    facet = first_hits(setup.scene, start + LIFT_MM * direction, direction)
    square = dot(setup.scene.plane(facet)[:3], direction) > SQUARE_COS
    corners = np.unique(setup.mesh.faces[facet[(facet >= 0) & square]])
    return np.ascontiguousarray(setup.mesh.points[corners].T)
