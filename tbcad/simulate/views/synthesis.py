"""Pictures from anywhere out of a light field: wanted rays, the mirrors near them, colours."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tbcad.optics.camera import Camera
from tbcad.simulate.parallel import compiled
from tbcad.simulate.scene.viewpoint import view_directions
from tbcad.simulate.views.blend import blend_cameras
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.nearest import nearest_rays
from tbcad.simulate.views.ray_bundle import RayBundle, candidate_mirrors, ray_bundle
from tbcad.simulate.views.two_plane import TwoPlane, two_plane_along
from tbcad.types import Bools, Floats

Colours = NDArray[np.float32]
Method = Literal["nearest", "blend"]
Rays = tuple[Floats, Floats]
"""Origins and unit directions, (n, 3) each."""
DepthFunction = Callable[[Floats, Floats], Floats]
"""Distance (n,) along rays with origins and unit directions (n, 3) to a surface, mm."""

# One wanted ray of so many tells which mirrors are near.
VIEW_RAY_STEP = 601


@dataclass(frozen=True)
class SynthesisedView:
    """A picture made from a light field.

    Attributes:
        colour: (h, w, 3), 0 to 255, float32; zero where nothing was captured.
        seen: whether a captured ray stands in, or the ray passes the capture sphere by, (h, w).
    """

    colour: Colours
    seen: Bools

    @property
    def image(self) -> NDArray[np.uint8]:
        """The picture in whole numbers, (h, w, 3)."""
        return np.rint(self.colour).astype(np.uint8)


def synthesise(
    tiles: MirrorTiles, view: Camera, method: Method = "nearest", depth: DepthFunction | None = None
) -> SynthesisedView:
    """The picture that a pinhole camera would see.

    Args:
        tiles: the light field.
        view: the pinhole camera.
        method: the nearest captured ray (section 4.2), or a blend of several virtual cameras.
        depth: the surface that a blend takes the object for; without, the plane through the
            origin that faces the camera.
    """
    way = view_directions(view)
    meets = _meets(view.pinhole, way, tiles.source.capture_mm / 2)
    origin = np.broadcast_to(view.pinhole, (int(meets.sum()), 3))
    slab = two_plane_along(view.forward, view.right, tiles.source.capture_mm)
    rays = (origin, way[meets])
    found, seen = ray_colours(
        nearby_rays(tiles, slab, rays, search_radius(tiles)), rays, method, depth
    )
    if not seen.all():
        rest = (origin[~seen], rays[1][~seen])
        wide = nearby_rays(tiles, slab, rest, horizon_search_radius(tiles))
        found[~seen], seen[~seen] = ray_colours(wide, rest, method, depth)
    colour = np.zeros(way.shape, dtype=np.float32)
    colour[meets] = found
    every = ~meets
    every[meets] = seen
    return SynthesisedView(colour, every)


@compiled
def _meets(pinhole: Floats, way: Floats, radius: float) -> Bools:
    """Which unit directions (h, w, 3) from a pinhole meet the sphere about the origin, (h, w)."""
    meets = np.empty(way.shape[:2], dtype=np.bool_)
    a, b, c = pinhole
    for y in range(way.shape[0]):
        for x in range(way.shape[1]):
            p, q, r = way[y, x]
            i, j, k = b * r - c * q, c * p - a * r, a * q - b * p
            meets[y, x] = np.sqrt(i * i + j * j + k * k) <= radius
    return meets


@dataclass(frozen=True)
class NearbyRays:
    """The captured rays that may be near some wanted ones.

    Attributes:
        slab: what the views look along.
        sheaf: captured rays; None where there are none.
        limit: how far from a wanted ray a captured one may be, mm.
    """

    slab: TwoPlane
    sheaf: RayBundle | None
    limit: float


def nearby_rays(tiles: MirrorTiles, slab: TwoPlane, rays: Rays, limit: float) -> NearbyRays:
    """The captured rays that may be within a limit (mm) of wanted ones."""
    packed = tiles.packed(_near(tiles, slab, slab.points(*rays), limit))
    return NearbyRays(slab, None if packed is None else ray_bundle(slab, packed), limit)


def ray_colours(
    near: NearbyRays, rays: Rays, method: Method = "nearest", depth: DepthFunction | None = None
) -> tuple[Colours, Bools]:
    """Colours (n, 3) of wanted rays, and which of them were seen, (n,)."""
    wanted = near.slab.points(*rays)
    if near.sheaf is None:
        return np.zeros((len(wanted), 3), dtype=np.float32), np.zeros(len(wanted), dtype=bool)
    if method == "nearest":
        found = nearest_rays(near.sheaf, wanted, near.limit)
        seen = found >= 0
        return np.where(seen[:, None], near.sheaf.colour[found], np.float32(0)), seen
    at = _depths(near.slab, rays, depth) / near.slab.scale
    mixed, seen = blend_cameras(near.sheaf, wanted, at, near.limit)
    return mixed.astype(np.float32), seen


def search_radius(tiles: MirrorTiles) -> float:
    """How far from a wanted ray a captured one is at most, in the slab, mm.

    As far as neighbouring virtual cameras are apart, evenly spread over the hemisphere, and
    neighbouring pixels, their mirror's share of the sensor evenly spread over the capture sphere.
    """
    capture = tiles.source.capture_mm
    angle = np.sqrt(2 * np.pi / len(tiles.u) * 2 / np.sqrt(3))
    size = sum(frame.view.width_px * frame.view.height_px for frame in tiles.source.frames.values())
    pixel = capture / np.sqrt(size / len(tiles.u))
    return float(angle * capture / 2 / np.sqrt(3) + pixel)


def horizon_search_radius(tiles: MirrorTiles) -> float:
    """The same for rays from the horizon, which may pass a capture radius below all mirrors, mm.

    A ray that passes the meeting point of a mirror's rays at distance e, at depth L, is
    e / sqrt(1 + (L / s)^2) from the nearest of them; no mirror is nearer than the nearest apex.
    """
    radius = tiles.source.capture_mm / 2
    depth = float(np.linalg.norm(tiles.apex, axis=1).min())
    return radius / float(np.sqrt(1 + 3 * (depth / radius) ** 2))


def _near(tiles: MirrorTiles, slab: TwoPlane, wanted: Floats, limit: float) -> NDArray[np.int64]:
    """Mirrors (k,) whose rays may be within the limit of wanted ones (n, 4), by their apices."""
    place = slab.place(tiles.apex) / [1, 1, slab.scale]
    behind = np.flatnonzero(place[:, 2] < 0)
    kept = wanted[~np.isnan(wanted[:, 0])]
    if len(kept) == 0:
        return behind[:0]
    meeting = np.column_stack([place[behind], tiles.width[behind]])
    return behind[candidate_mirrors(meeting, kept, limit, VIEW_RAY_STEP)]


def _depths(slab: TwoPlane, rays: Rays, depth: DepthFunction | None) -> Floats:
    """Where rays meet the surface, along the slab's direction, mm; on the plane where they miss."""
    origin, direction = rays
    if depth is None:
        return np.zeros(len(direction))
    reached = depth(origin, direction)
    along = np.where(np.isfinite(reached), reached, 0)
    place = (origin + along[:, None] * direction) @ slab.axes[2]
    return np.where(np.isfinite(reached), place, 0.0)
