"""The full sensor: free light paths of useful pixels, and the rim of the object in the frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.surfaces import (
    PreparedSurfaces,
    ReflectedRays,
    distance_before_mirror,
    nearest_to_origin,
    reflect,
)
from tbcad_verify.mesh.vectors import dot, norm, take, tangent_basis, unit
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
from tbcad_verify.shell import light
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
AZIMUTHS = 24
NEWTON = 12
CLOSE_MM = 1e-4


def checks(setup: OpticalSetup, seen: Coverage | None, files: str) -> MirrorChecks:
    """Mirrors on the sensor and along the rim, and the useful pixels of each recorded mirror (M,).

    `seen`: what the mirrors cover; no rim is looked for where they do not reach. None takes
    them to reach the whole object.
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
    """Mirrors seen by each camera's pixels; mirror images are not traced again."""
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


def _ring(setup: OpticalSetup, camera: Camera, seen: Coverage | None) -> RimRays:
    mine = np.flatnonzero(setup.mine(camera))
    start = setup.recovery.fits.middle[:, setup.match.segment[mine]]
    rim = rim_rays(setup.seen(camera), mine, start, setup.u[:, mine], _reach(setup, seen)[mine])
    # A halved mirror shows the camera only what its own half reflects.
    side = np.repeat(np.sign(start[0]), AZIMUTHS)
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
    rings: list[tuple[Camera, RimRays]],
) -> Check:
    ways = [
        distance_before_mirror(setup.seen(camera), ring.direction, ring.lines.reach)
        for camera, ring in rings
    ]
    nearest = np.nanmin(np.concatenate([tally.nearest, *ways]))
    reason = "the object stands between a camera and its mirrors"
    return at_least(name, float(nearest) - setup.radius, 0, reason)


def _framed(setup: OpticalSetup, name: CheckName, rings: list[tuple[Camera, RimRays]]) -> Check:
    mirror = np.concatenate([ring.mirror for _, ring in rings])
    error = np.concatenate([ring.error for _, ring in rings])
    margin = np.concatenate([margins(camera, ring.direction) for camera, ring in rings])
    ids = setup.export.mirrors.ids
    lost = [ids[k] for k in np.unique(mirror[~(error < CLOSE_MM)]).tolist()]
    if lost or not margin.size:
        return unknown(name, f"no ray grazes the object after {short_list(lost) or 'any mirror'}")
    outside = [ids[k] for k in np.unique(mirror[margin < 0]).tolist()]
    return at_least(name, float(margin.min()), 0, f"partly out of the frame: {short_list(outside)}")


@dataclass(frozen=True)
class RimRays:
    """Camera rays that, off their mirror, graze the capture sphere: AZIMUTHS for each mirror."""

    mirror: NDArray[np.intp]  # (N,) recorded mirror
    direction: Floats  # (3, N) from the pinhole
    lines: ReflectedRays  # reflected
    error: Floats  # (N,) mm by which they fail to graze; NaN where no ray off the mirror would


def rim_rays(
    seen: PreparedSurfaces, mirrors: NDArray[np.intp], start: Floats, u: Floats, radius: Floats
) -> RimRays:
    """Aim at the rim of the capture sphere off each mirror, by Newton's method.

    `mirrors`: (K,) which of them.
    `start`: (3, K) mm, a point on each mirror to begin with.
    `u`: (3, K) their virtual cameras' directions.
    `radius`: (K,) of the sphere about the origin to graze, mm.
    """
    chief = _aim(seen, mirrors, start - seen.origin[:, None], u, np.zeros((2, mirrors.size)))
    angle = np.tile(np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS), mirrors.size)
    index, u = np.repeat(mirrors, AZIMUTHS), np.repeat(u, AZIMUTHS, axis=1)
    target = np.repeat(radius, AZIMUTHS) * np.stack([np.cos(angle), np.sin(angle)])
    d = _aim(seen, index, np.repeat(chief, AZIMUTHS, axis=1), u, target)
    lines = reflect(seen, index, d)
    return RimRays(index, d, lines, np.asarray(np.hypot(*(_miss(lines, u) - target))))


def margins(camera: Camera, d: Floats) -> Floats:
    """(N,) pixels from where rays d (3, N) fall to the frame's nearest edge; < 0 outside."""
    depth = dot(camera.forward[:, None], d)
    with np.errstate(divide="ignore", invalid="ignore"):
        column = np.abs(dot(camera.right[:, None], d) / depth) / camera.pitch
        row = np.abs(dot(camera.down[:, None], d) / depth) / camera.pitch
    inside = np.minimum(camera.width / 2 - column, camera.height / 2 - row)
    return np.where(depth > 0, inside, -np.inf)


def _miss(lines: ReflectedRays, u: Floats) -> Floats:
    """(2, N) how a line misses the origin, across u; as long as the distance in space."""
    miss = nearest_to_origin(lines)
    flat = np.stack([dot(axis, miss) for axis in tangent_basis(u)])
    size = np.sqrt(np.maximum(np.einsum("in,in->n", flat, flat), 1e-300))
    return np.asarray(flat * (norm(miss) / size))


def _aim(
    seen: PreparedSurfaces, index: NDArray[np.intp], d: Floats, u: Floats, target: Floats
) -> Floats:
    """(3, N) rays whose reflected lines miss the origin by target (2, N)."""
    step = 1e-6
    for _ in range(NEWTON):
        axes = [norm(d) * axis for axis in tangent_basis(unit(d))]
        missed_by = _miss(reflect(seen, index, d), u)
        slopes = [
            (_miss(reflect(seen, index, d + step * axis), u) - missed_by) / step for axis in axes
        ]
        a, b = _solve(slopes, target - missed_by)
        d = d + a * axes[0] + b * axes[1]
    return d


def _solve(slopes: list[Floats], rest: Floats) -> tuple[Floats, Floats]:
    (p, q), (r, s) = slopes
    with np.errstate(divide="ignore", invalid="ignore"):
        det = p * s - q * r
        a, b = (s * rest[0] - r * rest[1]) / det, (p * rest[1] - q * rest[0]) / det
        # No step beyond a tenth of a radian: the far side of a small sphere is near.
        size = np.maximum(np.hypot(a, b) / 0.1, 1)
    return a / size, b / size
