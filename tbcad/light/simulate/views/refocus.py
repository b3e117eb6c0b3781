"""A large lens made of many pinholes (section 4.3 of the paper), and ray-traced ground truth."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError, PlausibilityWarning
from tbcad.light.simulate.capture.photograph import subpixel_shifts
from tbcad.light.simulate.parallel import in_batches
from tbcad.light.simulate.scene.ray_casting import Scene, colours_along
from tbcad.light.simulate.scene.rays import unit_directions, view_directions
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.ray_bundle import two_plane_along
from tbcad.light.simulate.views.synthesis import (
    DepthFunction,
    Rays,
    SynthesisedView,
    nearby_rays,
    ray_colours,
    rays_to_capture_sphere,
    search_radius,
)
from tbcad.types import Bools, Colours, Floats, Ints, Progress

# 69 points of a square lattice, the paper's number of pinholes, are within this squared radius
# in steps of the lattice.
LATTICE_RADIUS2 = 20
# A lens as wide as it is far away is seen from the object under 53 degrees: wider than F/1.
WIDE_LENS = 1.0
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


@dataclass(frozen=True)
class ThinLens:
    """A lens."""

    aperture_mm: float  # its diameter
    # the plane that it makes sharp, across its axis, from the origin toward the lens
    plane_mm: float

    def check(self, view: Camera, capture_mm: float) -> None:
        """Refuse what cannot be, and warn of what is unlikely.

        InputError: no aperture, or the plane that is to be sharp is not near the object.
        """
        if not 0 < self.aperture_mm < np.inf:
            raise InputError(f"--aperture {self.aperture_mm:g} is no diameter: give mm above 0")
        distance = float(np.linalg.norm(view.pinhole))
        limit = min(capture_mm, distance - 1)
        if not -limit <= self.plane_mm <= limit:
            raise InputError(
                f"--focus {self.plane_mm:g} is far from the object: allowed is "
                f"{-limit:g} to {limit:g} mm from its middle, toward the camera"
            )
        if self.aperture_mm > WIDE_LENS * distance:
            text = (
                f"--aperture {self.aperture_mm:g} is more than --distance {distance:g}: a lens so "
                "wide blurs all but one plane and looks past the mirrors; both are in mm"
            )
            warnings.warn(PlausibilityWarning(text), stacklevel=2)


def lens_pinholes(radius2: int = LATTICE_RADIUS2) -> Floats:
    """Places (n, 2) on the unit disc: a square lattice of this squared radius in its steps."""
    reach = int(np.sqrt(radius2))
    x, y = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    inside = x**2 + y**2 <= radius2
    return np.asarray(np.stack([x[inside], y[inside]], axis=1) / np.sqrt(radius2))


def lens_rays(
    view: Camera, focus: ThinLens, place: Floats, shift: tuple[float, float] = (0.0, 0.0)
) -> Rays:
    """Rays from a point of the lens to where its middle sees each pixel on the sharp plane.

    `place` (2,): right and down from the middle, mm; `shift`: from the pixels' centres, pixels.
    Origins and unit directions, (h, w, 3) each.
    """
    offset = place @ view.axes[:2]
    depth = -float(view.pinhole @ view.forward) - focus.plane_mm
    direction = unit_directions(view, range(view.height_px), shift, depth, offset)
    return np.broadcast_to(view.pinhole + offset, direction.shape), direction


def refocus(
    tiles: MirrorTiles,
    view: Camera,
    focus: ThinLens,
    pinholes: Floats | None = None,
    proceed: Callable[[], None] = lambda: None,
) -> SynthesisedView:
    """The picture of a lens, as the mean of what 69 pinholes all over it see.

    Others have places (n, 2) on the unit disc. `proceed` is called before every few pinholes; it
    may raise to give up. Where some pinholes saw nothing, because they lie outside of the
    hemisphere that was captured, the mean is of the others.
    """
    places = (lens_pinholes() if pinholes is None else pinholes) * focus.aperture_mm / 2
    return _mean_of_pinholes(tiles, view, places, partial(lens_rays, view, focus), proceed)


def refocus_everywhere(
    tiles: MirrorTiles, view: Camera, aperture_mm: float, depth: DepthFunction
) -> SynthesisedView:
    """The picture of a lens that makes each pixel sharp at its own depth.

    Each pixel is the mean of what the 69 pinholes see of its point of the surface: as bright and
    as free of noise as the picture of a lens, and as sharp everywhere as that of a pinhole. Pixels
    whose rays pass the surface are made sharp on the plane through the origin.
    """
    points = _points_on_surface(view, depth)

    def rays(place: Floats) -> Rays:
        origin = np.broadcast_to(view.pinhole + place @ view.axes[:2], points.shape)
        return origin, unit(points - origin)

    return _mean_of_pinholes(tiles, view, lens_pinholes() * aperture_mm / 2, rays)


def _points_on_surface(view: Camera, depth: DepthFunction) -> Floats:
    """Points of the surface seen from the middle of the lens, (h, w, 3)."""
    direction = unit_directions(view, range(view.height_px))
    flat = direction.reshape(-1, 3)
    distance = depth(np.broadcast_to(view.pinhole, flat.shape), flat)
    plane = -float(view.pinhole @ view.forward) / (flat @ view.forward)
    distance = np.where(np.isfinite(distance), distance, plane)
    return np.asarray(view.pinhole + distance.reshape(*direction.shape[:2], 1) * direction)


def _mean_of_pinholes(
    tiles: MirrorTiles,
    view: Camera,
    places: Floats,
    rays_from: Callable[[Floats], Rays],
    proceed: Callable[[], None] = lambda: None,
) -> SynthesisedView:
    """The mean of what pinholes at places (n, 2) beside a view's see along rays of each."""
    two_plane = two_plane_along(view.forward, view.right, tiles.source.capture_mm)
    square = np.abs(places).max() * np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
    corners = [rays_to_capture_sphere(tiles, rays_from(corner))[1] for corner in square]
    origin, direction = (np.concatenate(part) for part in zip(*corners, strict=True))
    bundle = nearby_rays(tiles, two_plane, (origin, direction), search_radius(tiles))
    total = np.zeros((view.height_px * view.width_px, 3), dtype=np.float32)
    count = np.full(len(total), len(places), dtype=np.float32)

    def one(place: Floats) -> tuple[Ints, Colours, Bools]:
        pixels, rays = rays_to_capture_sphere(tiles, rays_from(place))
        return pixels, *ray_colours(bundle, rays)

    for pixels, colours, seen in in_batches(one, list(places), lambda _: proceed()):
        total[pixels] += colours
        count[pixels] -= ~seen
    mean = total / np.maximum(count, 1)[:, None]
    shape = view.height_px, view.width_px
    return SynthesisedView(mean.astype(np.float32).reshape(*shape, 3), count.reshape(shape) > 0)


def refocus_sweep(
    tiles: MirrorTiles,
    view: Camera,
    aperture_mm: float,
    count: int,
    progress: Progress = lambda _: None,
) -> list[NDArray[np.uint8]]:
    """Pictures (h, w, 3) focused on planes from the back of the capture sphere to its front."""
    half = tiles.source.capture_mm / 2
    pictures = []
    for k, plane in enumerate(np.linspace(-half, half, count).tolist()):
        progress(f"picture {k + 1} of {count}")
        pictures.append(refocus(tiles, view, ThinLens(aperture_mm, plane)).image)
    return pictures


def pinhole_picture(scene: Scene, view: Camera, samples: int = 4) -> Colours:
    """The picture (h, w, 3), 0 to 255, of a pinhole camera, samples x samples rays a pixel."""
    total = np.zeros((view.height_px, view.width_px, 3), dtype=np.float32)
    for shift in subpixel_shifts(samples):
        direction = view_directions(view, shift)
        flat = direction.reshape(-1, 3)
        origin = np.broadcast_to(view.pinhole, flat.shape)
        total += colours_along(scene, origin, flat).reshape(total.shape)
    return total / np.float32(samples**2)


def lens_picture(
    scene: Scene,
    view: Camera,
    focus: ThinLens,
    samples: int = 256,
    progress: Progress = lambda _: None,
) -> Colours:
    """The picture (h, w, 3), 0 to 255, of a camera with a thin lens, of which `view` is the middle.

    Each of a pixel's rays is through another point of the lens and of the pixel.
    """
    total = np.zeros((view.height_px, view.width_px, 3), dtype=np.float32)
    points = zip(disc_points(samples), pixel_points(samples), strict=True)
    for k, (point, shift) in enumerate(points):
        progress(f"ray {k + 1} of {samples}")
        rays = lens_rays(view, focus, point * focus.aperture_mm / 2, shift)
        colours = colours_along(scene, *(part.reshape(-1, 3) for part in rays))
        total += colours.reshape(total.shape)
    return total / np.float32(samples)


def disc_points(count: int) -> Floats:
    """Points (n, 2) spread evenly over the unit disc, on Vogel's spiral."""
    k = np.arange(count)
    radius, angle = np.sqrt((k + 0.5) / count), GOLDEN_ANGLE * k
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def pixel_points(count: int) -> list[tuple[float, float]]:
    """Points spread evenly over a pixel, from its centre (the R2 sequence of M. Roberts, 2018)."""
    plastic = 1.324717957244746
    steps = np.arange(count)[:, None] / np.array([plastic, plastic**2])
    places = (0.5 + steps) % 1 - 0.5
    return [(float(x), float(y)) for x, y in places]
