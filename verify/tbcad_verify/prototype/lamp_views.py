"""Lamps and card past the light in use: what they take of it, and which pixels see a lamp.

A lamp below the horizon is seen past the object by the mirrors opposite. Lamps that light the
object alike before and after its half turn cannot be elsewhere: above the horizon is the light of
the mirrors or of their images. The share of pixels is therefore reported, not limited.
"""

from __future__ import annotations

import numpy as np

from tbcad_verify.mesh.surfaces import nearest_on_rays
from tbcad_verify.mesh.vectors import norm, unit
from tbcad_verify.prototype.ball_views import PixelRays
from tbcad_verify.prototype.bodies import Bodies
from tbcad_verify.prototype.measured_prototype import MeasuredPrototype
from tbcad_verify.prototype.ray_transfer import ray_transfer
from tbcad_verify.report.checks import Check, CheckName, at_most, informative, short_list
from tbcad_verify.types import Floats

SKIN_MM = 0.5  # of balls drawn by facets, and of the sphere's own edge
STAGE = "stage_"  # parts inside the capture sphere, whose light other checks follow
CHECKS = {"light past lamps and card": "blocked rays", "lamps seen": "% of the pixels"}


def checks(
    names: list[CheckName], measured: MeasuredPrototype, pixel: PixelRays, bodies: Bodies
) -> list[Check]:
    """Follow pixels' rays from pinhole to ball, to the capture sphere, and beyond.

    Args:
        names: of the checks.
        measured: the prototype.
        pixel: its rays.
        bodies: all but those that other checks follow rays past.
    """
    free, seen = names
    lamps = measured.context.prototype.lamps
    transfer = ray_transfer(measured)
    rays = transfer.reflected(pixel.mirror, pixel.direction)[1]
    turn = transfer.base[pixel.mirror]
    point, along = (turn.apply(x.T) for x in (rays.point, unit(rays.toward)))
    start = np.broadcast_to(measured.context.pinhole, point.shape)
    radius = measured.context.radius
    depth = np.sqrt(np.maximum(radius**2 - norm(nearest_on_rays(rays)) ** 2, 0))
    to_sphere = norm(nearest_on_rays(rays) - rays.point) - depth
    blocked = _names(bodies, start, unit((point - start).T).T, norm((point - start).T))
    for name, count in _names(bodies, point + SKIN_MM * along, along, to_sphere).items():
        blocked[name] = blocked.get(name, 0) + count
    own = {lamp.name for lamp in lamps.places} if lamps else set()
    body, _ = bodies.still.first(point + SKIN_MM * along, along)
    titles = np.array([*bodies.still.names, ""])
    of_lamps = pixel.weight[np.isin(titles[body], [*own])].sum()
    share = 100 * float(of_lamps / max(pixel.weight.sum(), 1.0))
    texts = [f"{count} by {name}" for name, count in sorted(blocked.items())]
    return [
        at_most(free, sum(blocked.values()), 0, f"stopped: {short_list(texts)}"),
        informative(seen, share, "of those that see the capture sphere, where no object is"),
    ]


def _names(bodies: Bodies, origin: Floats, along: Floats, length: Floats) -> dict[str, int]:
    """How many rays (N, 3) each body stops within a length (N,)."""
    body, distance = bodies.still.first(origin, along)
    stopped = body[(body >= 0) & (distance < length - SKIN_MM)]
    names = {k: bodies.still.names[k] for k in np.unique(stopped).tolist()}
    return {
        name: int((stopped == k).sum()) for k, name in names.items() if not name.startswith(STAGE)
    }
