"""Checks on the full sensor: free light paths of the useful pixels, and the image in the frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tbcad_verify.mesh.surfaces import distance_before_mirror
from tbcad_verify.mesh.vectors import take
from tbcad_verify.record.export import Camera
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    check_names,
    informative,
    short_list,
    unknown,
    worst_offenders,
)
from tbcad_verify.run.results import MirrorChecks
from tbcad_verify.shell import image_rim, light
from tbcad_verify.shell.coverage import Coverage
from tbcad_verify.shell.optics import OpticalSetup
from tbcad_verify.types import Floats

CHECKS = {
    "light paths": "blocked pixels",
    "object clearance": "mm",
    "pixels, minimum": "px",
    "pixels, median": "px",
    "pixels, maximum": "px",
    "frame margin": "px",
    "double reflections": "% of pixels",
    "facet error, median": "mm",
    "facet error, 95 %": "mm",
}


def checks(setup: OpticalSetup, seen: Coverage | None, files: str) -> MirrorChecks:
    """What the sensor and the rim show, and the useful pixels of each recorded mirror (M,).

    Args:
        setup: what to look at.
        seen: what the mirrors cover; no rim is looked for where they do not reach. None takes
            them to reach the whole object.
        files: where, for the report.
    """
    path, clear, minimum, median, maximum, framed, double, half, nearly_all = check_names(
        CHECKS, files
    )
    tally = light.total(_tallies(setup))
    rings = [(camera, _ring(setup, camera, seen)) for camera in setup.cameras]
    each = np.bincount(setup.virtual.index, tally.pixels, setup.virtual.count)
    none = [setup.virtual_ids[k] for k in np.flatnonzero(each < 1).tolist()]
    spread = np.percentile(tally.spread, [50, 95]) if tally.spread.size else [np.nan, np.nan]
    figures = [
        _path(setup, path, tally),
        _clear(setup, clear, tally, rings),
        at_least(minimum, float(each.min()), 1, f"no pixel sees the object in {short_list(none)}"),
        informative(median, float(np.median(each))),
        informative(maximum, float(each.max())),
        _framed(setup, framed, rings),
        informative(double, 100 * tally.twice / max(tally.on_mirrors, 1)),
        informative(half, float(spread[0])),
        informative(nearly_all, float(spread[1])),
    ]
    return figures, {"pixels": tally.pixels.astype(np.float64)}


def _tallies(setup: OpticalSetup) -> list[light.PixelTally]:
    """What each camera's pixels see; mirror images are not traced again."""
    first, *others = setup.cameras
    tally = light.full_sensor(setup.sensor_scene(first))
    if setup.symmetric:
        return [tally, _image(setup, tally)]
    return [tally, *(light.full_sensor(setup.sensor_scene(camera)) for camera in others)]


def _image(setup: OpticalSetup, tally: light.PixelTally) -> light.PixelTally:
    """Camera b's tally from camera a's, of which everything is the mirror image."""
    source = setup.images(np.arange(len(setup.export.mirrors)))
    return replace(
        tally,
        pixels=tally.pixels[source],
        blocked=tally.blocked[source],
        nearest=tally.nearest[source],
        blockers=np.unique(setup.image_facets(tally.blockers)),
    )


def _ring(setup: OpticalSetup, camera: Camera, seen: Coverage | None) -> image_rim.RimRays:
    mine = np.flatnonzero(setup.mine(camera))
    start = setup.recovery.fits.middle[:, setup.match.segment[mine]]
    rim = image_rim.rim_rays(
        setup.seen(camera), mine, start, setup.u[:, mine], _reach(setup, seen)[mine]
    )
    # A halved mirror shows the camera only what its own half reflects.
    side = np.repeat(np.sign(start[0]), image_rim.AZIMUTHS)
    in_own_half = ~setup.virtual.halved[rim.mirror] | (side * rim.lines.point[0] >= 0)
    return take(rim, in_own_half)


def _reach(setup: OpticalSetup, seen: Coverage | None) -> Floats:
    """(M,) radius about the origin that each mirror sees, the capture sphere's at most, mm."""
    if seen is None:
        return np.full(len(setup.export.mirrors), setup.radius)
    each = np.nan_to_num(seen.fitted / 2, nan=np.inf)[setup.virtual.index]
    return np.asarray(np.minimum(each, setup.radius))


def _path(setup: OpticalSetup, name: CheckName, tally: light.PixelTally) -> Check:
    blocked = tally.blocked.astype(np.float64)
    who = worst_offenders(setup.export.mirrors.ids, blocked, "px", blocked > 0, ".0f")
    by = short_list(setup.names(tally.blockers))
    return at_most(name, int(blocked.sum()), 0, f"{who}; blocked by {by}")


def _clear(
    setup: OpticalSetup,
    name: CheckName,
    tally: light.PixelTally,
    rings: list[tuple[Camera, image_rim.RimRays]],
) -> Check:
    ways = [
        distance_before_mirror(setup.seen(camera), ring.direction, ring.lines.reach)
        for camera, ring in rings
    ]
    nearest = np.nanmin(np.concatenate([tally.nearest, *ways]))
    reason = "the object stands between a camera and its mirrors"
    return at_least(name, float(nearest) - setup.radius, 0, reason)


def _framed(
    setup: OpticalSetup, name: CheckName, rings: list[tuple[Camera, image_rim.RimRays]]
) -> Check:
    mirror = np.concatenate([ring.mirror for _, ring in rings])
    error = np.concatenate([ring.error for _, ring in rings])
    margin = np.concatenate([image_rim.margins(camera, ring.direction) for camera, ring in rings])
    ids = setup.export.mirrors.ids
    lost = [ids[k] for k in np.unique(mirror[~(error < image_rim.CLOSE_MM)]).tolist()]
    if lost or not margin.size:
        return unknown(name, f"no ray grazes the object after {short_list(lost) or 'any mirror'}")
    outside = [ids[k] for k in np.unique(mirror[margin < 0]).tolist()]
    return at_least(name, float(margin.min()), 0, f"partly out of the frame: {short_list(outside)}")
