"""The rays of a light field that meet the capture sphere, as the fit takes them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tbcad.errors import InputError
from tbcad.light.reconstruction.marching import Singles
from tbcad.light.simulate.capture.light_field import RAY_SIGMAS, CameraFrame, LightField
from tbcad.light.simulate.views.refocus import GOLDEN_ANGLE
from tbcad.types import Bools, Floats, Ints

LEAST_CHORD_MM = 0.03
LEAST_PAST = 100  # rays past the capture sphere that tell of noise
NO_FOOTPRINT: Singles = np.zeros((1, 4, 3), dtype=np.float32)
DARKEST = 0.02  # of white: less is called dark whatever the noise
NOISE = 6.0  # times the distance of the median from the mean below it: all but a few
PATTERNS = 8  # turned against each other
SQUARE_VARIANCE = 1 / 12  # of a pixel's square, along each side


@dataclass(frozen=True)
class CapturedRays:
    """n rays and what was photographed along them."""

    entry: Singles  # where they enter the capture sphere, mm, (n, 3)
    direction: Singles  # unit vectors, (n, 3)
    length: Singles  # of their way through the sphere, mm, (n,)
    colour: Singles  # red, green, blue, 0 to 1, (n, 3)
    mirror: NDArray[np.int32]  # number of their mirror among those of all cameras, (n,)
    weight: Singles  # of their squared errors in a fit, (n,)
    # change of entry and of direction for a pixel's step right and down, (n, 4, 3); or (1, 4, 3) of
    # zeros where a pixel is a single ray
    footprint: Singles
    capture_mm: float  # diameter of the capture sphere
    noise_level: float = 0.0  # brightness, 0 to 1, that the background has by noise

    def __len__(self) -> int:
        return len(self.length)

    def spread_mm(self, places: Singles) -> float:
        """How far from a pixel's central ray its rays at some places (p, k, 2) are, nearly always.

        Twice the root mean square, of the pixels' median width where rays leave the sphere.
        """
        along = self.footprint[:, :2] + self.length[:, None, None] * self.footprint[:, 2:]
        width = np.median(np.linalg.norm(along, axis=2).max(axis=1))
        return float(2 * width * np.sqrt(2 * np.mean(np.square(places))))

    def dark_level(self) -> float:
        """Brightness, 0 to 1, below which a ray sees the background."""
        return max(self.noise_level, DARKEST)


def captured_rays(source: LightField, footprint: bool = False) -> CapturedRays:
    """The rays of a light field; what is as dark as the background's noise is black.

    Noise is cut off at black in a photograph, so its mean is not zero there and a fit would show it
    as haze. With a footprint a pixel is more than its central ray. InputError: no ray meets the
    capture sphere.
    """
    before, parts, past = 0, [], []
    for frame in source.frames.values():
        columns, background = _of_frame(frame, before, source.capture_mm / 2, footprint)
        parts.append(columns)
        past.append(background)
        before += len(frame.u)
    entry, direction, length, colour, mirror, *prints = (
        np.concatenate(columns) for columns in zip(*parts, strict=True)
    )
    if not len(length):
        raise InputError("no ray of the light field meets its capture sphere: capture again")
    level = noise_level(np.concatenate(past))
    colour[colour.max(axis=1) < level] = 0
    wide = prints[0] if prints else NO_FOOTPRINT
    weight = np.ones(len(length), dtype=np.float32)
    return CapturedRays(
        entry, direction, length, colour, mirror, weight, wide, source.capture_mm, level
    )


def noise_level(background: Singles) -> float:
    """Brightness that noise alone reaches, from that of rays past the capture sphere (n,).

    Most of them see nothing: their median, and six times its distance from the mean of what is
    darker, which is 0.6 standard deviations for the brightest of three colours. 0 where too few
    rays are known.
    """
    if len(background) < LEAST_PAST:
        return 0.0
    middle = np.median(background)
    darker = background[background <= middle].mean(dtype=np.float64)
    return float(middle + NOISE * (middle - darker))


def entries(
    origin: NDArray[np.floating], direction: NDArray[np.floating], radius: float
) -> tuple[Singles, Singles]:
    """Where rays (..., 3) enter a sphere about the origin, and how long they stay; 0: they miss."""
    o, d = origin.astype(np.float64), direction.astype(np.float64)
    middle = -np.einsum("...x,...x->...", o, d)
    half = np.sqrt(np.maximum(middle**2 - np.einsum("...x,...x->...", o, o) + radius**2, 0))
    start = np.maximum(middle - half, 0)  # what lies behind the origin is not seen
    entry = o + start[..., None] * d
    return entry.astype(np.float32), np.maximum(middle + half - start, 0).astype(np.float32)


def _of_frame(
    frame: CameraFrame, before: int, radius: float, footprint: bool
) -> tuple[list[NDArray[Any]], Singles]:
    """Columns of the rays that meet the capture sphere, and the brightness of those that do not."""
    planes = frame.read(slice(None))
    mirror, direction = planes["mirror"], planes["direction"]
    entry, length = entries(planes["origin"], direction, radius)
    seen = (mirror > 0) & (length > LEAST_CHORD_MM)
    past = planes["colour"][(mirror > 0) & (length == 0)].max(axis=1, initial=0) / np.float32(255)
    columns = [
        entry[seen],
        direction[seen],
        length[seen],
        planes["colour"][seen] / np.float32(255),
        mirror[seen].astype(np.int32) - 1 + before,
    ]
    if footprint:
        columns.append(_footprints(entry, direction, np.where(seen, mirror, 0))[seen])
    return columns, past


def _footprints(entry: Singles, direction: Singles, mirror: NDArray[np.uint16]) -> Singles:
    """Change of both by a step right and down inside a mirror, across the ray, (h, w, 4, 3)."""
    steps = np.stack(
        [_steps(values, mirror, axis) for values in (entry, direction) for axis in (1, 0)], axis=2
    )
    along = np.einsum("hwkx,hwx->hwk", steps, direction)
    return np.asarray(steps - along[..., None] * direction[:, :, None], dtype=np.float32)


def _steps(values: Singles, mirror: NDArray[np.uint16], axis: int) -> Singles:
    """Mean difference to the neighbours of the same mirror along an axis; 0 without any."""
    ahead = np.diff(values, axis=axis)
    same: Bools = np.equal(*_neighbours(mirror, axis))
    total = np.zeros_like(values)
    number: Ints = np.zeros(mirror.shape, dtype=np.int64)
    for sums, counts in zip(_neighbours(total, axis), _neighbours(number, axis), strict=True):
        np.add(sums, np.where(same[..., None], ahead, 0), out=sums)
        np.add(counts, same, out=counts)
    return np.asarray(total / np.maximum(number, 1)[..., None], dtype=np.float32)


def _neighbours(values: NDArray[Any], axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """All but the last, and all but the first, along an axis."""
    front, back = [slice(None)] * values.ndim, [slice(None)] * values.ndim
    front[axis], back[axis] = slice(None, -1), slice(1, None)
    return values[tuple(front)], values[tuple(back)]


def pixel_places(count: int, blur_px: float = 0.0, *, area: bool = True) -> Singles:
    """Places of a pixel's rays from its centre in each of p patterns, pixels, (p, count, 2).

    On Vogel's spiral, with the density of a Gaussian of the variance that the pixel's square (area;
    else it is a single ray) and the lens' spread (blur_px, one standard deviation) have together;
    their mean is zero and their variance exact in each pattern's sum of both ways. Few rays are
    worse than one: a step of light inside of a pixel is then a stair (docs/reconstruct.md).
    """
    k = np.arange(count)
    radius = np.sqrt(-2 * np.log(1 - (k + 0.5) / count))
    angle = k * GOLDEN_ANGLE + 2 * np.pi * np.arange(PATTERNS)[:, None] / PATTERNS
    places = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    places -= places.mean(axis=1, keepdims=True)
    sigma = np.sqrt(blur_px**2 + area * SQUARE_VARIANCE)
    return np.asarray(places * sigma / np.sqrt(np.mean(places**2)), dtype=np.float32)


def with_weights(rays: CapturedRays, source: LightField) -> CapturedRays:
    """The rays, with footprints, and weights by what a calibration knows of their mirrors.

    Without that fact of the light field all rays keep their weights. Mirrors of which it says
    nothing count as the worst of the others. InputError: it does not fit the mirrors.
    """
    sigmas = _sigmas(source)
    if np.isnan(sigmas).all() or not rays.footprint.any():
        return rays
    sigma = np.where(np.isnan(sigmas), np.nanmax(sigmas), sigmas)[rays.mirror]
    area = pixel_areas(rays)
    area[area == 0] = np.median(area[area > 0])  # of pixels without neighbours in their mirror
    return replace(rays, weight=(area / (area + 6 * sigma**2)).astype(np.float32))


def pixel_areas(rays: CapturedRays) -> Singles:
    """Area that each pixel sees square to its ray, in the middle of its way, mm^2, (n,)."""
    middle = (rays.length / 2)[:, None, None]
    steps = rays.footprint[:, :2] + middle * rays.footprint[:, 2:]
    across = np.cross(steps[:, 0], steps[:, 1])
    return np.asarray(np.abs(np.einsum("nx,nx->n", across, rays.direction)))


def _sigmas(source: LightField) -> Floats:
    """Root mean square error of the rays of all mirrors at the object, mm, (m,); NaN: unknown."""
    told = source.facts.get(RAY_SIGMAS, {})
    try:
        columns = [
            np.array(told.get(name, [None] * len(frame.u)), dtype=np.float64)
            for name, frame in source.frames.items()
        ]
        if [len(one) for one in columns] != [len(frame.u) for frame in source.frames.values()]:
            raise ValueError("another number of mirrors")
        sigma = np.concatenate(columns)
        if (sigma < 0).any() or np.isinf(sigma).any():
            raise ValueError("numbers that cannot be")
    except (AttributeError, TypeError, ValueError) as fault:
        raise InputError(
            f"the light field's {RAY_SIGMAS} does not fit its mirrors ({fault}): merge again"
        ) from None
    return sigma
