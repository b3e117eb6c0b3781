"""The negative of a shell on its mesh: the shell's own facets turned about, and what closes them.

Facets are compared corner by corner, as float32: what is electroformed on the negative has then the
shell's surface, which is measured by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.holes import round_holes
from tbcad_verify.mesh.mesh import Mesh, examine_topology, mass_properties, mesh_from_facets
from tbcad_verify.mesh.rays import build_scene, first_hits
from tbcad_verify.mesh.segments import count_folds, measure_edges, rounding
from tbcad_verify.mesh.stl import Facets
from tbcad_verify.mesh.surfaces import Surfaces
from tbcad_verify.mesh.vectors import dot, unit
from tbcad_verify.record.export import Export, Mandrel
from tbcad_verify.record.flange_holes import HoleLimits, blind_hole_faults
from tbcad_verify.report.checks import (
    Check,
    at_most,
    attempt,
    check_names,
    guarded,
    guarded_each,
    informative,
    no_faults,
    require,
    worst_offenders,
)
from tbcad_verify.run.results import Results
from tbcad_verify.shell.cutter import mandrel_reach_check, shell_mirrors
from tbcad_verify.shell.integrity import FOLDS, TOPOLOGY, fold_check, mesh_checks, mesh_ends_checks
from tbcad_verify.shell.match import mirror_corners, surface_errors
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
    stl = mandrel.stl
    mesh, no_mesh = attempt(lambda: mesh_from_facets(facets))
    known = partial(require, mesh, no_mesh)
    mass, no_mass = attempt(lambda: mass_properties(known()))
    checks = guarded(
        check_names(TOPOLOGY, stl), lambda: mesh_checks(stl, examine_topology(known(), facets))
    )
    checks += guarded(
        check_names(FOLDS, stl), lambda: [fold_check(stl, count_folds(measure_edges(known())))]
    )
    checks += mesh_ends_checks(export, mandrel, mass, no_mass)
    checks += guarded(
        check_names(CHECKS, stl),
        lambda: mandrel_checks(export, mandrel, known(), setup(), cutter_mm),
    )
    return Results(checks=checks, masses={mandrel.name: mass} if mass else {})


def mandrel_checks(
    export: Export, mandrel: Mandrel, mesh: Mesh, setup: OpticalSetup, cutter_mm: float | None
) -> list[Check]:
    """Everything that is measured on one negative's mesh but its topology."""
    own, lost = _shared(mesh, setup.mesh, shell_mirrors(setup, mandrel.camera), len(export.mirrors))
    modelled = export.mirrors.surfaces().coated(-export.coating_mm)
    mirrors, surface, body, draft, recorded, pull, reach = check_names(CHECKS, mandrel.stl)
    ids = export.mirrors.ids
    absent = np.where(export.mirrors.camera == mandrel.camera, np.inf, np.nan)
    absent[np.unique(own[own >= 0])] = 0.0
    errors = surface_errors(mesh, own, modelled, absent)
    far = worst_offenders(ids, errors, "mm", errors > SURFACE_MM)
    unlike = worst_offenders(ids, lost, "facets", lost > 0, ".0f")
    least = _least_draft(mesh, own, modelled, mandrel.pull)
    caught = int(_caught(mesh, np.flatnonzero(own > -2), mandrel.pull).sum())
    along = ", ".join(f"{one:.3f}" for one in mandrel.pull.tolist())
    if least < 0:  # other shells must be free of what is in the way
        way = "the shell catches: dissolve the mandrel, or melt it out"
        pulled = informative(pull, caught)
    else:
        way = f"draw the shell along ({along})"
        pulled = at_most(pull, caught, 0, "the shell catches there when it is drawn")
    off = f"{least:.2f} degrees along the recorded pull, the record has {mandrel.draft_deg:.2f}"
    return [
        at_most(mirrors, int(lost.sum()), 0, f"not the shell's, turned: {unlike}"),
        at_most(surface, float(np.nanmax(errors, initial=0.0)), SURFACE_MM, far),
        no_faults(body, _body_faults(export, mandrel, mesh, own)),
        informative(draft, least, way),
        at_most(recorded, abs(least - mandrel.draft_deg), DRAFT_DEG, off),
        pulled,
        *guarded_each([reach], [mandrel_reach_check], mesh, own, setup, cutter_mm),
    ]


def _shared(
    mesh: Mesh, shell: Mesh, mirror: NDArray[np.intp], count: int
) -> tuple[NDArray[np.intp], Floats]:
    """Find each facet of a shell, its corners in the opposite order, among the negative's.

    Returns:
        (F,) mirror of each of the negative's facets, -1 for another facet of the shell's, -2 for
        none; and (M,) number of facets of each mirror that the negative has not.
    """
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
    return own, np.bincount(lost, minlength=count).astype(np.float64)


def _keys(faces: Ints, points: int) -> Ints:
    """(F,) one number for each facet (F, 3), the same whichever corner comes first."""
    first = faces.argmin(axis=1)[:, None]
    a, b, c = np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1).T
    side = np.unique(a * points + b, return_inverse=True)[1].astype(np.int64)
    return np.asarray(side * points + c)


def _least_draft(mesh: Mesh, own: NDArray[np.intp], modelled: Surfaces, pull: Floats) -> float:
    """Least angle between pull and surface: of spheres at all corners, of walls by facets; deg."""
    sines = []
    for mine, x in mirror_corners(mesh, own):
        sines.append(-dot(modelled.take(mine).gradient(x), pull[:, None]))
    sines.append(dot(unit(mesh.area[:, own == -1]), pull[:, None]))
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
    holes, blur = round_holes(mesh, measure_edges(mesh)), ROUNDINGS * rounding(mesh)
    on_plane = np.abs(mesh.points[:, [0, 2]] - np.array([0, export.foot_z_mm])) <= blur
    of_wall = np.zeros(len(mesh.points), dtype=np.bool_)
    of_wall[mesh.faces[holes.wall]] = True  # a bottom's corners are all the wall's
    known = np.any(on_plane[mesh.faces].all(axis=1), axis=1) | of_wall[mesh.faces].all(axis=1)
    stray = int((~known & (own == -2)).sum())
    faults = [f"{stray} facets outside the planes x = 0 and z = foot and their holes"] * (stray > 0)
    limits = HoleLimits(SIZE_MM + blur, PLACE_MM + blur)
    return faults + blind_hole_faults(holes.each, export, mandrel.camera, limits)
