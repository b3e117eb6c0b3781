"""Views from anywhere out of a light field: target rays, the mirrors near them, colours."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tbcad.common.compiled import compiled
from tbcad.common.figure_files import image_bytes
from tbcad.core.optics.camera import Camera
from tbcad.light.simulate.scene.rays import meets_sphere
from tbcad.light.simulate.views.blend import blend_cameras
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.ray_bundle import (
    RayBundle,
    TwoPlane,
    boxes_around,
    mirrors_near_boxes,
    nearest_rays,
    ray_bundle,
    two_plane_along,
)
from tbcad.types import Bools, Colours, Floats, Ints

# The pixels of a block are a run of target rays.
BLOCK_PX = 8
# So many target rays, in a row, are looked at together to find the mirrors near a view.
RAYS_PER_BOX = 1024

Rays = tuple[Floats, Floats]  # origins and unit directions, (n, 3) each
DepthFunction = Callable[[Floats, Floats], Floats]
"""Distance (n,) along rays with origins and unit directions (n, 3) to a surface, mm."""


@dataclass(frozen=True)
class SynthesisedView:
    """A picture made from a light field."""

    colour: Colours  # (h, w, 3), 0 to 255, float32; zero where nothing was captured
    seen: Bools  # whether a captured ray was near, or the ray misses the capture sphere, (h, w)

    @property
    def image(self) -> NDArray[np.uint8]:
        """The picture in whole numbers, (h, w, 3)."""
        return np.rint(self.colour).astype(np.uint8)

    def __repr__(self) -> str:
        rows, columns = self.seen.shape
        return f"<SynthesisedView: {columns} x {rows}, {self.seen.mean():.1%} seen>"

    def _repr_png_(self) -> bytes:
        """Picture, as notebooks show it."""
        return image_bytes(self.image)


def synthesise(
    tiles: MirrorTiles, view: Camera, depth: DepthFunction | None = None
) -> SynthesisedView:
    """The picture that a pinhole camera would see.

    By a blend of several virtual cameras on the surface `depth`; without one by the nearest
    captured ray (section 4.2).
    """
    pixels, rays = _rays_of_view(tiles, view)
    two_plane = two_plane_along(view.forward, view.right, tiles.source.capture_mm)
    bundle = nearby_rays(tiles, two_plane, rays, search_radius(tiles))
    colours, seen = ray_colours(bundle, rays, depth)
    if not seen.all():
        rest = (rays[0][~seen], rays[1][~seen])
        bundle = nearby_rays(tiles, two_plane, rest, horizon_search_radius(tiles))
        colours[~seen], seen[~seen] = ray_colours(bundle, rest, depth)
    shape = view.height_px, view.width_px
    picture, complete = np.zeros((*shape, 3), dtype=np.float32), np.ones(shape, dtype=bool)
    picture.reshape(-1, 3)[pixels], complete.reshape(-1)[pixels] = colours, seen
    return SynthesisedView(picture, complete)


def _rays_of_view(tiles: MirrorTiles, view: Camera) -> tuple[Ints, Rays]:
    """As `rays_to_capture_sphere`, of a pinhole."""
    order = pixels_in_blocks(view.height_px, view.width_px)
    lens = np.array([view.pixel_pitch, (view.width_px - 1) / 2, (view.height_px - 1) / 2])
    pinhole, radius = np.asarray(view.pinhole, dtype=np.float64), tiles.source.capture_mm / 2
    pixels, directions = _through_sphere(order, view.width_px, lens, view.axes, pinhole, radius)
    return pixels, (np.broadcast_to(pinhole, directions.shape), directions)


@compiled
def _through_sphere(
    order: Ints, width: int, lens: Floats, axes: Floats, pinhole: Floats, radius: float
) -> tuple[Ints, Floats]:
    """Those numbers of pixels whose rays meet the sphere round the origin, and unit directions.

    `lens`: width of a pixel at unit distance; column and row of the middle.
    """
    pixels, directions = np.empty(len(order), dtype=np.int64), np.empty((len(order), 3))
    squared = (pinhole**2).sum() - radius**2  # the power of the pinhole
    count = 0
    for pixel in order:
        y, x = (pixel // width - lens[2]) * lens[0], (pixel % width - lens[1]) * lens[0]
        length, along = np.sqrt(x * x + y * y + 1), 0.0
        for j in range(3):
            directions[count, j] = (x * axes[0, j] + y * axes[1, j] + axes[2, j]) / length
            along += directions[count, j] * pinhole[j]
        if squared <= 0 or (along < 0 and squared <= along * along):
            pixels[count] = pixel
            count += 1
    return pixels[:count], directions[:count]


def rays_to_capture_sphere(tiles: MirrorTiles, rays: Rays) -> tuple[Ints, Rays]:
    """Which rays (h, w, 3) meet the capture sphere, and those rays, (n, 3).

    Which: numbers of pixels, row by row, (n,). They come block by block, so that rays that follow
    each other are neighbours.
    """
    flat = [part.reshape(-1, 3) for part in rays]
    meets = meets_sphere(flat[0], flat[1], tiles.source.capture_mm / 2)
    order = pixels_in_blocks(*rays[0].shape[:2])
    pixels = order[meets[order]]
    return pixels, (flat[0][pixels], flat[1][pixels])


@lru_cache(maxsize=4)
def pixels_in_blocks(height: int, width: int) -> Ints:
    """Numbers of all pixels (n,), as counted row by row, in the order of blocks of BLOCK_PX."""
    row, column = np.divmod(np.arange(height * width), width)
    in_block = row % BLOCK_PX * BLOCK_PX + column % BLOCK_PX
    return np.lexsort((in_block, column // BLOCK_PX, row // BLOCK_PX))


def nearby_rays(
    tiles: MirrorTiles, two_plane: TwoPlane, rays: Rays, limit: float
) -> RayBundle | None:
    """The captured rays that may be within a limit (mm) of target rays; None if none is."""
    targets = two_plane.coordinates(*rays)
    near = tiles.of(_near_mirrors(tiles, two_plane, targets, limit))
    return ray_bundle(two_plane, near, limit) if near else None


def ray_colours(
    bundle: RayBundle | None, rays: Rays, depth: DepthFunction | None = None
) -> tuple[Colours, Bools]:
    """Colours (n, 3) of target rays as of `synthesise`, and which of them were seen, (n,)."""
    count = len(rays[0])
    if bundle is None:
        return np.zeros((count, 3), dtype=np.float32), np.zeros(count, dtype=bool)
    targets = bundle.two_plane.coordinates(*rays)
    if depth is None:
        pixels = nearest_rays(bundle, targets)
        seen = pixels >= 0
        return np.where(seen[:, None], bundle.colour[pixels], np.float32(0)), seen
    along = bundle.two_plane.axes[2] / bundle.two_plane.scale
    colour, seen = blend_cameras(bundle, targets, _places(along, *rays, depth(*rays)))
    return colour.astype(np.float32), seen


def search_radius(tiles: MirrorTiles) -> float:
    """Largest distance of a captured ray from a target ray, in two-plane coordinates, mm.

    As far as neighbouring virtual cameras are apart, evenly spread over the hemisphere, and
    neighbouring pixels, their mirror's share of the sensor evenly spread over the capture sphere.
    """
    capture = tiles.source.capture_mm
    return float(tiles.camera_spacing * capture / 2 / np.sqrt(3) + tiles.pixel_pitch)


def horizon_search_radius(tiles: MirrorTiles) -> float:
    """The same for rays from the horizon, which may pass a capture radius below all mirrors, mm.

    A ray that passes the meeting point of a mirror's rays at distance e, at depth L, is
    e / sqrt(1 + (L / s)^2) from the nearest of them; no mirror is nearer than the nearest apex.
    """
    radius = tiles.source.capture_mm / 2
    depth = float(np.linalg.norm(tiles.apex, axis=1).min())
    return radius / float(np.sqrt(1 + 3 * (depth / radius) ** 2))


def _near_mirrors(tiles: MirrorTiles, two_plane: TwoPlane, targets: Floats, limit: float) -> Ints:
    """Mirrors (k,) whose rays may be within the limit of targets (n, 4), by their apices."""
    place = two_plane.place(tiles.apex)
    behind = np.flatnonzero(place[:, 2] < 0)
    pinholes = np.column_stack([place[behind], tiles.width[behind]])
    return behind[mirrors_near_boxes(pinholes, boxes_around(targets, RAYS_PER_BOX), limit)]


@compiled
def _places(along: Floats, origin: Floats, direction: Floats, distance: Floats) -> Floats:
    """Where points at distances (n,) on rays (n, 3) are along a vector (3,); 0 if at infinity."""
    result = np.zeros(len(distance))
    for i in range(len(distance)):
        if np.isfinite(distance[i]):
            for j in range(3):
                result[i] += along[j] * (origin[i, j] + distance[i] * direction[i, j])
    return result
