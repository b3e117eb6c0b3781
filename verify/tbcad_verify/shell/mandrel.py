"""The negative of a shell on its mesh: the shell's own facets turned about, and what closes them.

Facets are compared corner by corner, as float32: what is electroformed on the negative has then the
shell's surface, which is measured by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.holes import RoundHoles, round_holes
from tbcad_verify.mesh.mesh import Mesh, examine_topology, mass_properties, mesh_from_facets
from tbcad_verify.mesh.rays import build_scene, first_hits
from tbcad_verify.mesh.segments import Edges, count_folds, measure_edges, rounding
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import chunks, dot, unit
from tbcad_verify.record.export import Export, Mandrel
from tbcad_verify.record.flange_holes import HoleLimits, blind_hole_faults
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_most,
    attempt,
    check_names,
    guarded,
    guarded_each,
    informative,
    require,
    short_list,
    worst_offenders,
)
from tbcad_verify.run.results import Results
from tbcad_verify.shell.cutter import mandrel_reach_check, shell_mirrors
from tbcad_verify.shell.integrity import (
    FOLDS,
    TOPOLOGY,
    fold_check,
    mesh_checks,
    mesh_ends_checks,
)
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.types import Bools, Floats, Ints

SURFACE_MM = 5e-3  # as of the shells
DRAFT_DEG = 0.1  # facets end at points of the outlines, between which draft may be less
SIZE_MM, PLACE_MM = 1e-3, 2e-3
ROUNDINGS = 8
LIFT_MM = 1e-3  # by which rays start above the surface
CHECKS = {
    "mandrel mirrors": "facets",
    "mandrel surface": "mm",
    "mandrel body": "faults",
    "mandrel draft": "deg",
    "mandrel draft, deviation from record": "deg",
    "mandrel pull": "facets",
    "mandrel reach": "mm",
}


@dataclass(frozen=True)
class _Shared:
    """Which of the negative's facets are the shell's, turned."""

    # (F,) mirror of each of the negative's facets; -1 for another facet of the shell's, -2 for none
    own: NDArray[np.intp]
    missing: Ints  # (M,) number of facets of each mirror that the negative has not


def mandrel_results(
    export: Export,
    mandrel: Mandrel,
    facets: Facets,
    setup: Callable[[], OpticalSetup],
    cutter_mm: float | None = None,
) -> Results:
    """All checks of one negative's mesh, and its mass.

    `setup`: gives what was found on the shells; may raise `Unknown`.
    `cutter_mm`: radius of a ball that must reach all mirrors; None: no ball is put on them.
    """
    mesh, no_mesh = attempt(lambda: mesh_from_facets(facets))
    topology = guarded(
        check_names(TOPOLOGY, mandrel.stl),
        lambda: mesh_checks(mandrel.stl, examine_topology(require(mesh, no_mesh), facets)),
    )
    folds = guarded(
        check_names(FOLDS, mandrel.stl),
        lambda: [fold_check(mandrel.stl, count_folds(measure_edges(require(mesh, no_mesh))))],
    )
    checks = guarded(
        check_names(CHECKS, mandrel.stl),
        lambda: mandrel_checks(export, mandrel, require(mesh, no_mesh), setup(), cutter_mm),
    )
    mass, no_mass = attempt(lambda: mass_properties(require(mesh, no_mesh)))
    ends = mesh_ends_checks(export, mandrel, mass, no_mass)
    return Results(
        checks=[*topology, *folds, *ends, *checks], masses={mandrel.name: mass} if mass else {}
    )


def mandrel_checks(
    export: Export,
    mandrel: Mandrel,
    mesh: Mesh,
    setup: OpticalSetup,
    cutter_mm: float | None,
) -> list[Check]:
    """Everything that is measured on one negative's mesh but its topology."""
    shared = _shared(mesh, setup.mesh, shell_mirrors(setup, mandrel.camera), len(export.mirrors))
    modelled = export.mirrors.surfaces().coated(-export.coating_mm)
    mirrors, surface, body, draft, recorded, pull, reach = check_names(CHECKS, mandrel.stl)
    ids = export.mirrors.ids
    lost = shared.missing.astype(np.float64)
    errors = _surface_errors(mesh, shared.own, modelled, export.mirrors.camera == mandrel.camera)
    worst = float(np.nanmax(errors, initial=0.0))
    faults = _body_faults(export, mandrel, mesh, shared.own)
    least = _least_draft(mesh, shared.own, modelled, mandrel.pull)
    caught = _caught(mesh, np.flatnonzero(shared.own > -2), mandrel.pull)
    return [
        at_most(
            mirrors,
            int(lost.sum()),
            0,
            f"not the shell's, turned: {worst_offenders(ids, lost, 'facets', lost > 0, '.0f')}",
        ),
        at_most(
            surface, worst, SURFACE_MM, worst_offenders(ids, errors, "mm", errors > SURFACE_MM)
        ),
        at_most(body, len(faults), 0, short_list(faults)),
        informative(draft, least, _how_it_comes_off(least, mandrel.pull)),
        at_most(
            recorded,
            abs(least - mandrel.draft_deg),
            DRAFT_DEG,
            f"{least:.2f} degrees along the recorded pull, the record has {mandrel.draft_deg:.2f}",
        ),
        _pull_check(pull, least, int(caught.sum())),
        *guarded_each([reach], [mandrel_reach_check], mesh, shared.own, setup, cutter_mm),
    ]


def _how_it_comes_off(least: float, pull: Floats) -> str:
    if least < 0:
        return "the shell catches: dissolve the mandrel, or melt it out"
    return "draw the shell along (" + ", ".join(f"{one:.3f}" for one in pull.tolist()) + ")"


def _pull_check(name: CheckName, least: float, caught: int) -> Check:
    """Nothing may be in the way of a shell whose draft is nowhere negative; others only inform."""
    if least < 0:
        return informative(name, caught)
    return at_most(name, caught, 0, "the shell catches there when it is drawn")


def _shared(mesh: Mesh, shell: Mesh, mirror: NDArray[np.intp], count: int) -> _Shared:
    """Find each facet of a shell, its corners in the opposite order, among the negative's."""
    shell = Mesh(shell.points, shell.faces[mirror > -2], shell.twin, shell.area)
    mirror = mirror[mirror > -2]
    both = np.concatenate([mesh.points, shell.points]) + 0.0  # no negative zeros
    rows = np.ascontiguousarray(both).view(np.dtype((np.void, both.itemsize * 3))).ravel()
    place = np.unique(rows, return_inverse=True)[1].ravel().astype(np.int64)
    mine = place[: len(mesh.points)][mesh.faces]
    theirs = place[len(mesh.points) :][shell.faces][:, ::-1]
    key = _keys(np.concatenate([mine, theirs]), int(place.max()) + 1)
    own_key, shell_key = key[: len(mine)], key[len(mine) :]
    order = np.argsort(shell_key)
    at = np.minimum(np.searchsorted(shell_key[order], own_key), len(order) - 1)
    found = order[at]
    own = np.where(shell_key[found] == own_key, mirror[found], -2)
    lost = mirror[(mirror >= 0) & ~np.isin(shell_key, own_key)]
    return _Shared(own, np.bincount(lost, minlength=count))


def _keys(faces: Ints, points: int) -> Ints:
    """(F,) one number for each facet (F, 3), the same whichever corner comes first."""
    first = faces.argmin(axis=1)[:, None]
    a, b, c = np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1).T
    side = np.unique(a * points + b, return_inverse=True)[1].astype(np.int64)
    return np.asarray(side * points + c)


def _surface_errors(mesh: Mesh, own: NDArray[np.intp], modelled: Surfaces, wanted: Bools) -> Floats:
    """(M,) distance of each mirror's corners from its recorded surface, mm; infinite for none."""
    worst = np.where(wanted, np.inf, np.nan)
    worst[np.unique(own[own >= 0])] = 0.0
    for facets, x in _corners(mesh, own):
        mine = own[facets]
        np.maximum.at(worst, mine, np.abs(modelled.take(mine).height(x)))
    return worst


def _corners(mesh: Mesh, own: NDArray[np.intp]) -> list[tuple[Ints, Floats]]:
    """Mirrors' facets (N,) and one of their corners (3, N), a part of them at a time."""
    facets = np.flatnonzero(own >= 0)
    return [
        (facets[part], np.take(mesh.points, mesh.faces[facets[part], k], axis=0).T)
        for part in chunks(facets.size)
        for k in range(3)
    ]


def _least_draft(mesh: Mesh, own: NDArray[np.intp], modelled: Surfaces, pull: Floats) -> float:
    """Least angle between pull and surface: of spheres at all corners, of walls by facets; deg."""
    sines = [
        -dot(modelled.take(own[facets]).gradient(x), pull[:, None])
        for facets, x in _corners(mesh, own)
    ]
    walls = own == -1
    sines.append(dot(unit(mesh.area[:, walls]), pull[:, None]))
    least = min(float(one.min(initial=1.0)) for one in sines)
    return float(np.degrees(np.arcsin(np.clip(least, -1, 1))))


def _caught(mesh: Mesh, facets: Ints, pull: Floats) -> Bools:
    """Facets above which a shell that is drawn along the pull meets the negative again."""
    middle = mesh.points[mesh.faces[facets]].mean(axis=1).T
    start = middle + LIFT_MM * unit(mesh.area[:, facets])
    along = np.ascontiguousarray(np.broadcast_to(pull[:, None], start.shape))
    return np.asarray(first_hits(build_scene(mesh), start, along) >= 0)


def _body_faults(export: Export, mandrel: Mandrel, mesh: Mesh, own: NDArray[np.intp]) -> list[str]:
    """Facets that are neither the shell's nor in the planes or the holes; and wrong holes."""
    edges: Edges = measure_edges(mesh)
    holes, blur = round_holes(mesh, edges), ROUNDINGS * rounding(mesh)
    stray = int((~_in_planes(export, mesh, blur) & ~_in_holes(mesh, holes) & (own == -2)).sum())
    faults = [f"{stray} facets outside the planes x = 0 and z = foot and their holes"] * (stray > 0)
    limits = HoleLimits(SIZE_MM + blur, PLACE_MM + blur)
    return faults + blind_hole_faults(holes.each, export, mandrel.camera, limits)


def _in_planes(export: Export, mesh: Mesh, blur: float) -> Bools:
    """(F,) facets in the planes of the seam and the foot."""
    away = np.abs(mesh.points[:, [0, 2]] - np.array([0, export.foot_z_mm])) <= blur
    return np.asarray(np.any(away[mesh.faces].all(axis=1), axis=1))


def _in_holes(mesh: Mesh, holes: RoundHoles) -> Bools:
    """(F,) facets of holes' walls, and of their bottoms, whose corners are all the walls'."""
    of_wall = np.zeros(len(mesh.points), dtype=np.bool_)
    of_wall[mesh.faces[holes.wall]] = True
    return np.asarray(of_wall[mesh.faces].all(axis=1))
