"""How much of the object every virtual camera sees, and whether its mirror is visible.

The two halves of a mirror on the seam are different spheres: their cuts along x = 0 map to slightly
different curves at the object. Where the halves overlap, both see what lies between the curves;
elsewhere neither does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.fits import facet_centres
from tbcad_verify.mesh.rays import RAYS_A_CHUNK, first_hits, in_threads
from tbcad_verify.mesh.surfaces import ReflectedRays
from tbcad_verify.mesh.vectors import chunks, crossings
from tbcad_verify.record.export import Camera
from tbcad_verify.record.poses import VirtualCameras
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    check_names,
    informative,
    short_list,
    worst_offenders,
)
from tbcad_verify.run.results import MirrorChecks
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.shell.outline import (
    Outline,
    minimum_miss_distance,
    reflect_on_facets,
    reflect_on_fits,
    trace_outline,
    winding_numbers,
)
from tbcad_verify.types import Floats

MAX_TURNS_ERROR = 0.25  # of an outline's winding number about the origin, which is 1
CHECKS = {
    "coverage, facets": "mm",
    "coverage, spheres": "mm",
    "mirrors visible": "hidden points",
    "seam gap": "mm",
    "coverage, deviation from record": "mm",
}
STEPS = 121
# Coordinates of 32 bits displace images by less than this: a narrower gap is none.
ROUNDING_MM = 5e-3


@dataclass(frozen=True)
class Coverage:
    """Coverage of each virtual camera."""

    # (V,) diameter by facets, mm; 0 where the outline's image does not surround the object's
    # middle, NaN where a mirror is missing
    facet: Floats
    fitted: Floats  # (V,) the same by fitted surfaces
    # (V,) widest stretch that neither half of a mirror on the seam sees by fitted surfaces, mm; NaN
    # where a half is missing
    gap: Floats
    hidden: Floats  # (M,) points of each mirror that the pinhole does not see
    blockers: tuple[str, ...]  # what hides them


def measure(setup: OpticalSetup) -> Coverage:
    """Trace every mirror's outline from its camera."""
    cameras, virtual, u = setup.cameras, setup.virtual, setup.u
    owner, coat = setup.owner(), setup.export.coating_mm
    outlines = [
        trace_outline(setup.mesh, setup.recovery, owner, coat, setup.mine(c), virtual.halved)
        for c in cameras
    ]
    pairs = list(zip(cameras, outlines, strict=True))
    fitted = [reflect_on_fits(outline, setup.seen(camera)) for camera, outline in pairs]
    facet = [reflect_on_facets(o, camera.pinhole, setup.scene) for camera, o in pairs]
    turned = np.abs(
        sum(winding_numbers(o, at, virtual, u) for o, at in zip(outlines, fitted, strict=True))
    )
    hits = [_hidden(setup, *pair) for pair in pairs[: 1 if setup.symmetric else None]]
    if setup.symmetric:  # what hides camera b's mirrors is the image of what hides camera a's
        hits += [(setup.images(mirror), setup.image_facets(facet)) for mirror, facet in hits]
    hidden, blockers = (np.concatenate([pair[k] for pair in hits]) for k in range(2))
    by_facets, by_fits = (
        gaps(outlines, lines, virtual, u, setup.radius) for lines in (facet, fitted)
    )
    # Planar halves see up to x = 0 and no farther: there facets show their rounding alone.
    planar = virtual.index[setup.export.mirrors.flat]
    by_facets[planar] = by_fits[planar]
    return Coverage(
        counted(_diameters(setup, outlines, facet, turned), by_facets, setup.radius),
        counted(_diameters(setup, outlines, fitted, turned), by_fits, setup.radius),
        by_fits,
        np.bincount(hidden, minlength=len(setup.export.mirrors)).astype(np.float64),
        tuple(setup.names(blockers)),
    )


def checks(setup: OpticalSetup, coverage: Coverage, files: str) -> MirrorChecks:
    """Every virtual camera sees the target, on facets and on fitted surfaces, and is seen."""
    facets, spheres, seen, gap, off = check_names(CHECKS, files)
    ids, hidden = setup.export.mirrors.ids, coverage.hidden
    who = worst_offenders(ids, hidden, "points", hidden > 0, ".0f")
    virtual = setup.virtual.index
    columns = {
        "coverage_facet_mm": coverage.facet[virtual],
        "coverage_fitted_mm": coverage.fitted[virtual],
    }
    return [
        _covers(setup, facets, coverage.facet),
        _covers(setup, spheres, coverage.fitted),
        at_most(seen, int(hidden.sum()), 0, f"{who}; behind {short_list(coverage.blockers)}"),
        _no_gap(setup, gap, coverage.gap),
        informative(off, _off_the_record(setup, coverage)),
    ], columns


def _diameters(
    setup: OpticalSetup, outlines: list[Outline], lines: list[ReflectedRays], turned: Floats
) -> Floats:
    virtual = setup.virtual
    each = [minimum_miss_distance(o, at, virtual) for o, at in zip(outlines, lines, strict=True)]
    minimum = np.min(each, axis=0)
    minimum[np.abs(turned - 1) > MAX_TURNS_ERROR] = 0.0
    minimum[virtual.index[setup.match.segment < 0]] = np.nan
    return np.asarray(2 * minimum)


def _covers(setup: OpticalSetup, name: CheckName, diameter: Floats) -> Check:
    target, lost = setup.export.target_mm, np.isnan(diameter)
    known = np.where(lost, np.inf, diameter)
    ids = setup.virtual_ids
    short = worst_offenders(ids, diameter, "mm", known < target, badness=-known)
    parts = [f"sees too little: {short}"]
    unseen = [setup.virtual_ids[k] for k in np.flatnonzero(lost).tolist()]
    parts += [f"unknown, because a mirror is missing: {short_list(unseen)}"] if unseen else []
    measured = -np.inf if lost.all() else float(known.min())
    # A missing mirror counts as one that sees nothing.
    return at_least(name, 0.0 if unseen else measured, target, "; ".join(parts))


def _no_gap(setup: OpticalSetup, name: CheckName, gap: Floats) -> Check:
    lost, wide = np.isnan(gap), np.nan_to_num(gap)
    missing = [setup.virtual_ids[k] for k in np.flatnonzero(lost).tolist()]
    parts = [f"neither half sees: {worst_offenders(setup.virtual_ids, wide, 'mm', wide > 0)}"]
    parts += [f"unknown, because a half is missing: {short_list(missing)}"] if missing else []
    return at_most(name, np.nan if missing else float(wide.max()), 0.0, "; ".join(parts))


def _off_the_record(setup: OpticalSetup, coverage: Coverage) -> float:
    """Largest difference between coverage on fitted surfaces and as the designer computed it."""
    recorded = setup.export.mirrors.coverage_mm
    off = np.abs(coverage.fitted[setup.virtual.index] - recorded)
    return float(np.nan_to_num(off, nan=-1).max())


def _hidden(
    setup: OpticalSetup, camera: Camera, outline: Outline
) -> tuple[NDArray[np.intp], NDArray[np.integer]]:
    """Mirrors of points that the pinhole does not see first, and the facets it sees instead.

    The points are the outline's, a little inside, and the middle of every facet of the mirrors.
    """
    owner = np.append(setup.owner()[setup.recovery.segments.label], -1).astype(np.int32)
    facets = np.flatnonzero((owner[:-1] >= 0) & setup.mine(camera)[owner[:-1]])
    origin = camera.pinhole[:, None]

    def hits(count: int, points: Callable[[slice], Floats]) -> list[NDArray[np.int32]]:
        return in_threads(
            lambda part: first_hits(setup.scene, origin, points(part) - origin),
            chunks(count, RAYS_A_CHUNK),
        )

    edges = hits(outline.mirror.size, lambda part: outline.inside[:, part])
    insides = hits(facets.size, lambda part: facet_centres(setup.mesh, facets[part]))
    facet = np.concatenate([np.zeros(0, dtype=np.int32), *edges, *insides])
    mirror = np.concatenate([outline.mirror, owner[facets]])
    wrong = np.flatnonzero(owner[facet] != mirror)
    return mirror[wrong], facet[wrong]


def gaps(
    outlines: list[Outline],
    lines: list[ReflectedRays],
    virtual: VirtualCameras,
    u: Floats,
    radius_mm: float,
) -> Floats:
    """(V,) widest gap between the two halves' views over the disc that faces the camera, mm.

    0 where the halves overlap, and for virtual cameras of whole mirrors; NaN where one half is
    missing.

    `u`: (3, M) directions of the virtual cameras.
    """
    halves = np.unique(virtual.index[virtual.halved])
    widest = np.zeros(virtual.count)
    if len(outlines) != 2 or not halves.size:
        return widest
    cuts = [
        _cut(o, at, virtual, u, halves, radius_mm) for o, at in zip(outlines, lines, strict=True)
    ]
    height = np.linspace(-radius_mm, radius_mm, STEPS)
    chord = np.sqrt(np.maximum(radius_mm**2 - height**2, 0))
    (one, side), (two, _) = cuts
    one, two = np.clip(one, -chord, chord), np.clip(two, -chord, chord)
    gap = (side[:, None] * (one - two)).max(axis=1)
    widest[halves] = np.where(gap < ROUNDING_MM, 0.0, gap)
    return widest


def counted(diameter: Floats, gap: Floats, radius_mm: float) -> Floats:
    """(V,) coverage diameters that fall short of the object by what the halves leave unseen, mm.

    A boundary short of the disc's edge by e takes 2 e from a diameter. Halves that each end e
    before the other's begin at x = 0 leave a gap of 2 e, which is counted alike.
    """
    return np.asarray(np.where(gap > 0, np.minimum(diameter, 2 * radius_mm - gap), diameter))


def _cut(
    outline: Outline,
    lines: ReflectedRays,
    virtual: VirtualCameras,
    u: Floats,
    halves: NDArray[np.intp],
    radius_mm: float,
) -> tuple[Floats, Floats]:
    """One camera's halves (H): x of the cut's image at STEPS heights, and the side it sees."""
    camera = virtual.index[outline.mirror]
    rows = np.flatnonzero(virtual.halved[outline.mirror])
    half = np.searchsorted(halves, camera[rows])
    x, y = _image(lines, u, outline.mirror, rows)
    seam = outline.seam[rows]
    side = np.sign(np.bincount(half[~seam], x[~seam], halves.size))
    # One call of interp for all halves: each has a stretch of the number line of its own.
    stretch = 16 * radius_mm
    place = half[seam] * stretch + np.clip(y[seam], -4 * radius_mm, 4 * radius_mm)
    order = np.argsort(place, kind="stable")
    heights = np.arange(halves.size)[:, None] * stretch + np.linspace(-radius_mm, radius_mm, STEPS)
    curve = np.interp(heights, place[order], x[seam][order])
    return np.where(
        np.bincount(half[seam], minlength=halves.size)[:, None] > 0, curve, np.nan
    ), side


def _image(
    lines: ReflectedRays, u: Floats, mirror: NDArray[np.intp], rows: NDArray[np.intp]
) -> tuple[Floats, Floats]:
    """Where lines pierce the plane through the origin across u: along x, and across it."""
    u = u[:, mirror[rows]]
    p, r = lines.point[:, rows], lines.toward[:, rows]
    at = crossings(p, r, u)
    return at[0], u[1] * at[2] - u[2] * at[1]
