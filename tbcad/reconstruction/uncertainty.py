"""How much the rays of a calibrated machine count: less where they are not known to a pixel.

A ray that is off by a distance d at the object shows a colour that is off by g d, with the
picture's slope g across that distance. Its mean square is g^2 s^2 / 2 for errors of root mean
square s in the plane across the ray; what a pixel of width w mixes has that of a square,
g^2 w^2 / 12. Squared errors count by the inverse of their variance (Gauss and Markov), so by

    weight = (w^2 / 12) / (w^2 / 12 + s^2 / 2) = w^2 / (w^2 + 6 s^2)

which is 1 for rays that are known, 0.96 at s = w / 12 and 0.4 at s = w / 2.
"""

from dataclasses import replace

import numpy as np

from tbcad.errors import InputError
from tbcad.reconstruction.marching import Singles
from tbcad.reconstruction.rays import CapturedRays
from tbcad.simulate.capture.light_field import RAY_SIGMAS, LightField
from tbcad.types import Floats


def with_weights(rays: CapturedRays, source: LightField) -> CapturedRays:
    """The rays with the weights that follow from what a calibration knows of their mirrors.

    Args:
        rays: with footprints.
        source: their light field; without that fact all rays keep their weights. Mirrors of which
            it says nothing count as the worst of the others.

    Raises:
        InputError: its fact does not fit its mirrors.
    """
    sigmas = _sigmas(source)
    if np.isnan(sigmas).all() or not rays.footprint.any():
        return rays
    sigma = np.where(np.isnan(sigmas), np.nanmax(sigmas), sigmas)[rays.mirror]
    area = pixel_areas(rays)
    area[area == 0] = np.median(area[area > 0])  # of pixels without neighbours in their mirror
    return replace(rays, weight=(area / (area + 6 * sigma**2)).astype(np.float32))


def pixel_areas(rays: CapturedRays) -> Singles:
    """What each pixel sees square to its ray, in the middle of its way, mm^2, (n,)."""
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
