"""The lit dome of an LED, and where a sphere shows it.

The dome is the upper half of a ball about the LED's place, as bright in every direction: a diffuse
LED that stands upright in a dark pocket. Seen from an elevation e it is half a disc above half an
ellipse whose short half axis is sin e of the radius. So its centroid is not its centre: it lies
higher by 4 / (3 pi) (1 - sin e) of the radius.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.reflection import reflection_points
from tbcad.types import Floats

Waves = NDArray[np.complex128]
UP = np.array([0.0, 0.0, 1.0])
CENTROID = 4 / (3 * np.pi)  # of a half disc, from its straight side, as a share of its radius
STEP = 0.5  # of the differences that give a dome's image, as a share of its radius
RINGS, SPOKES = 5, 16  # of samples of a dome
FINER = 12, 32  # of those whose waves are summed


@dataclass(frozen=True)
class DomeImages:
    """The images of domes in spheres, over n of them."""

    place: Floats  # column and row of the dome's centre, (n, 2)
    direction: Floats  # unit vectors from the pinhole in which it appears, (n, 3)
    centroid: Floats  # of the lit part's image, from there, pixels, (n, 2)
    spread: Floats  # mean square of that image about its centroid, square pixels, (n, 2, 2)
    area: Floats  # of the lit part's image, square pixels, (n,)
    # mean of exp(2 pi i x) over the lit part, by columns and rows x from its centroid, (n, 2)
    wave: Waves


@dataclass(frozen=True)
class DiscImages:
    """Images in spheres of discs that fill domes square to the line of sight, over n of them."""

    point: Floats  # of reflection of the disc's centre, mm, (n, 3)
    axes: Floats  # level, upward and forward unit vectors of the eyes, (n, 3, 3)
    place: Floats  # column and row of the disc's centre, (n, 2)
    slope: Floats  # pixels for a radius along level and upward, (n, 2, 2)
    bend: Floats  # second derivatives by both, pixels, (n, 2, 2, 2)

    @property
    def area(self) -> Floats:
        """Square pixels of the disc, (n,)."""
        return np.asarray(np.pi * np.abs(np.linalg.det(self.slope)))

    @property
    def growth(self) -> Floats:
        """Share by which area grows for a radius along level and upward, (n, 2)."""
        return np.asarray(np.einsum("nca,niac->ni", np.linalg.inv(self.slope), self.bend))


def disc_images(
    camera: LensCamera, centre: Floats, radius: Floats, led: Floats, dome: float
) -> DiscImages:
    """Images of whole discs, to second order in their size; arguments as of `dome_images`."""
    point = reflection_points(centre, radius, led, camera.pinhole)
    axes = sight_axes(unit(point - led))
    step = STEP * dome * axes

    def image(level: int, up: int) -> Floats:
        place = led + level * step[:, 0] + up * step[:, 1]
        return camera.project(reflection_points(centre, radius, place, camera.pinhole))

    middle = camera.project(point)
    # Along level, upward, and both: there and back.
    ends = [(image(*way), image(-way[0], -way[1])) for way in ((1, 0), (0, 1), (1, 1))]
    slope = np.stack([(there - back) / (2 * STEP) for there, back in ends[:2]], axis=1)
    level, up, both = ((there + back - 2 * middle) / STEP**2 for there, back in ends)
    mixed = (both - level - up) / 2
    bend = np.stack([np.stack([level, mixed], axis=1), np.stack([mixed, up], axis=1)], axis=1)
    return DiscImages(point, axes, middle, slope, bend)


def dome_images(
    camera: LensCamera, centre: Floats, radius: Floats, led: Floats, dome: float
) -> DomeImages:
    """Images of whole domes of a radius about centres (n, 3) in spheres (n,), mm, to second order.

    The part of the disc that is lit is as bright everywhere in its image too. Where the image is
    larger, there is more light: with derivatives J and H of the image, a growth g of its area, the
    mean m and the mean square Q of the part, its centroid is J m + H : Q / 2 + J (Q - m m^T) g.
    """
    disc = disc_images(camera, centre, radius, led, dome)
    rise = disc.axes[:, 2] @ UP
    up = CENTROID * (1 - rise)
    # Of half a disc above half an ellipse.
    square = np.stack([np.ones_like(rise), 1 - rise + rise**2], axis=1) / 4
    spread = square - np.stack([np.zeros_like(rise), up**2], axis=1)
    bent = np.einsum("niia,ni->na", disc.bend, square) / 2
    more = np.einsum("nia,ni,ni->na", disc.slope, spread, disc.growth)
    return DomeImages(
        place=disc.place,
        direction=unit(disc.point - camera.pinhole),
        centroid=up[:, None] * disc.slope[:, 1] + bent + more,
        spread=np.einsum("nia,ni,nib->nab", disc.slope, spread, disc.slope),
        area=disc.area * (1 + rise) / 2 * (1 + up * disc.growth[:, 1]),
        wave=_wave(disc),
    )


def _wave(disc: DiscImages) -> Waves:
    """Of `DomeImages`, to first order in a disc's size."""
    samples, share = dome_samples(disc.axes, *FINER)
    weight = (share / share.sum(axis=1, keepdims=True))[..., None]
    place = samples @ disc.axes[:, :2].swapaxes(1, 2) @ disc.slope
    middle = (weight * place).sum(axis=1, keepdims=True)
    return np.asarray((weight * np.exp(2j * np.pi * (place - middle))).sum(axis=1))


def sight_axes(toward: Floats) -> Floats:
    """Level, upward and forward unit vectors (n, 3, 3) of eyes in directions (n, 3) of a dome."""
    level = np.cross(UP, toward)
    overhead = norm(level) == 0
    level[overhead] = np.array([1.0, 0.0, 0.0])
    level = unit(level)
    return np.stack([level, np.cross(toward, level), toward], axis=1)


def dome_samples(axes: Floats, rings: int = RINGS, spokes: int = SPOKES) -> tuple[Floats, Floats]:
    """Points (n, s, 3) of the lit halves of unit domes, and shares (n, s) of a disc they stand for.

    Points are the centroids of pieces of a disc that have the same area. Those of the lower half
    are brought nearer to its middle, up to the edge of the lit half, which an eye in elevation e
    sees as half an ellipse. Axes are those of the eyes, from `sight_axes`.
    """
    ring, spoke = (index.ravel() for index in np.indices((rings, spokes)))
    width = 2 * np.pi / spokes
    turn, (inner, outer) = width * (spoke + 0.5), np.sqrt([ring / rings, (ring + 1) / rings])
    # Centroid of the piece of a ring that a point stands for.
    along = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2)
    radius = along * np.sin(width / 2) / (width / 2)
    level, above = radius * np.cos(turn), radius * np.sin(turn)
    rise = axes[:, 2, 2:]
    edge = -rise * np.sqrt(1 - level**2)
    # From below the edge is above the middle, and the half below is not seen.
    from_below = edge + above * (1 + rise)
    height = np.where(rise >= 0, np.where(above >= 0, above, above * rise), from_below)
    share = np.where(above >= 0, 1 + np.minimum(rise, 0), np.maximum(rise, 0))
    forward = np.sqrt(np.maximum(1 - level**2 - height**2, 0))
    disc = np.stack([np.broadcast_to(level, height.shape), height, forward], axis=2)
    return np.einsum("nsa,nax->nsx", disc, axes), share / len(ring)
