"""How much of the object every virtual camera sees, and whether its mirror itself is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.fits import facet_centres
from tbcad_verify.mesh.rays import RAYS_A_CHUNK, first_hits, in_threads
from tbcad_verify.mesh.surfaces import ReflectedRays
from tbcad_verify.mesh.vectors import chunks
from tbcad_verify.record.export import Camera
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    informative,
    short_list,
    worst_offenders,
)
from tbcad_verify.shell import seam
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

ROUND = 0.25  # by which an outline's turns about the origin may differ from one
CHECKS = {
    "coverage, facets": "mm",
    "coverage, spheres": "mm",
    "mirrors seen": "hidden points",
    "seam gap": "mm",
    "coverage, off the record": "mm",
}


@dataclass(frozen=True)
class Coverage:
    """What each virtual camera sees.

    Attributes:
        facet: (V,) diameter by facets, mm; 0 where the outline's image does not surround the
            object's middle, NaN where a mirror is missing.
        fitted: (V,) the same by fitted surfaces.
        gap: (V,) widest stretch that neither half of a mirror on the seam sees, mm.
        hidden: (M,) points of each mirror that the pinhole does not see.
        blockers: what hides them.
    """

    facet: Floats
    fitted: Floats
    gap: Floats
    hidden: Floats
    blockers: tuple[str, ...]


def measure(bench: OpticalSetup) -> Coverage:
    """Trace every mirror's outline from its camera."""
    cameras, virtual, u = bench.cameras, bench.virtual, bench.u
    patches = bench.patches()
    outlines = [trace_outline(bench.mesh, patches, bench.mine(c), virtual.halved) for c in cameras]
    pairs = list(zip(cameras, outlines, strict=True))
    fitted = [reflect_on_fits(outline, bench.seen(camera)) for camera, outline in pairs]
    facet = [reflect_on_facets(o, camera.pinhole, bench.scene.planes) for camera, o in pairs]
    turned = np.abs(
        sum(winding_numbers(o, at, virtual, u) for o, at in zip(outlines, fitted, strict=True))
    )
    hits = [_hidden(bench, camera, outline) for camera, outline in pairs]
    hidden, blockers = (np.concatenate([pair[k] for pair in hits]) for k in range(2))
    return Coverage(
        _diameters(bench, outlines, facet, turned),
        _diameters(bench, outlines, fitted, turned),
        seam.gaps(outlines, fitted, virtual, u, bench.radius),
        np.bincount(hidden, minlength=len(bench.export.mirrors)).astype(np.float64),
        tuple(bench.names(blockers)),
    )


def checks(bench: OpticalSetup, found: Coverage, files: str) -> list[Check]:
    """Every virtual camera sees the target, on facets and on fitted surfaces, and is seen."""
    facets, spheres, seen, gap, off = ((name, files, unit) for name, unit in CHECKS.items())
    worst = np.argsort(-found.hidden, kind="stable")[: np.count_nonzero(found.hidden)]
    who = worst_offenders(bench.export.mirrors.ids, found.hidden, "points", worst, ".0f")
    widest = bench.virtual_ids[int(np.argmax(found.gap))]
    return [
        _covers(bench, facets, found.facet),
        _covers(bench, spheres, found.fitted),
        at_most(seen, int(found.hidden.sum()), 0, f"{who}; behind {short_list(found.blockers)}"),
        informative(gap, float(found.gap.max()), f"widest at {widest}"),
        informative(off, _off_the_record(bench, found)),
    ]


def columns(setup: OpticalSetup, covered: Coverage) -> dict[str, Floats]:
    """What verify.json says of each recorded mirror."""
    virtual = setup.virtual.index
    return {
        "coverage_facet_mm": covered.facet[virtual],
        "coverage_fitted_mm": covered.fitted[virtual],
    }


def _diameters(
    bench: OpticalSetup, outlines: list[Outline], lines: list[ReflectedRays], turned: Floats
) -> Floats:
    virtual = bench.virtual
    each = [minimum_miss_distance(o, at, virtual) for o, at in zip(outlines, lines, strict=True)]
    least = np.min(each, axis=0)
    least[np.abs(turned - 1) > ROUND] = 0.0
    least[virtual.index[bench.match.segment < 0]] = np.nan
    return np.asarray(2 * least)


def _covers(bench: OpticalSetup, name: CheckName, diameter: Floats) -> Check:
    target, lost = bench.export.target_mm, np.isnan(diameter)
    known = np.where(lost, np.inf, diameter)
    worst = np.argsort(known, kind="stable")
    worst = worst[known[worst] < target]
    said = ["sees too little: " + worst_offenders(bench.virtual_ids, diameter, "mm", worst)]
    unseen = [bench.virtual_ids[k] for k in np.flatnonzero(lost).tolist()]
    said += [f"unknown, for want of a mirror: {short_list(unseen)}"] if unseen else []
    measured = -np.inf if lost.all() else float(known.min())
    # One missing mirror is as bad as one that sees nothing.
    return at_least(name, 0.0 if unseen else measured, target, "; ".join(said))


def _off_the_record(bench: OpticalSetup, found: Coverage) -> float:
    """Largest difference between coverage on fitted surfaces and as the designer computed it."""
    recorded = bench.export.mirrors.coverage_mm
    off = np.abs(found.fitted[bench.virtual.index] - recorded)
    return float(np.nan_to_num(off, nan=-1).max())


def _hidden(
    bench: OpticalSetup, camera: Camera, outline: Outline
) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Mirrors of points that the pinhole does not see first, and the facets it sees instead.

    The points are the outline's, a little inside, and the middle of every facet of the mirrors.
    """
    owner = np.append(bench.owner()[bench.recovery.segments.label], -1).astype(np.int32)
    facets = np.flatnonzero((owner[:-1] >= 0) & bench.mine(camera)[owner[:-1]])
    origin = camera.pinhole[:, None]

    def edges(part: slice) -> NDArray[np.int32]:
        return first_hits(bench.scene, origin, outline.inside[:, part] - origin)

    def insides(part: slice) -> NDArray[np.int32]:
        return first_hits(bench.scene, origin, facet_centres(bench.mesh, facets[part]) - origin)

    jobs = [(edges, part) for part in chunks(outline.mirror.size, RAYS_A_CHUNK)]
    jobs += [(insides, part) for part in chunks(facets.size, RAYS_A_CHUNK)]
    hits = in_threads(lambda job: job[0](job[1]), jobs)
    facet = np.concatenate([np.zeros(0, dtype=np.int32), *hits])
    mirror = np.concatenate([outline.mirror, owner[facets]])
    wrong = np.flatnonzero(owner[facet] != mirror)
    return mirror[wrong], facet[wrong]
