"""The hemisphere of virtual cameras seen from above, as SVG: what a notebook shows of a design."""

import numpy as np

from tbcad.common.colours import shades
from tbcad.core.mirrors.array import MirrorArray
from tbcad.types import Floats

SIZE_PX = 320
EDGE_PX = 8
DOT_SHARE = 0.8  # of the distance of neighbours that lie evenly


def hemisphere_map(arrays: tuple[MirrorArray, MirrorArray]) -> str:
    """SVG with a dot for each mirror at its direction, coloured by the logarithm of its radius.

    Lambert's azimuthal projection: equal areas, the zenith in the middle, x to the right. Planar
    mirrors, which have no radius, have all one colour.
    """
    u = np.concatenate([array.u for array in arrays])
    radius = np.concatenate([array.mirrors.radius for array in arrays])
    logarithm = np.log(radius) if np.isfinite(radius).all() else np.zeros(len(u))
    half = SIZE_PX / 2 - EDGE_PX
    x, y = SIZE_PX / 2 + half * equal_area(u).T * [[1], [-1]]
    dot = DOT_SHARE * half / np.sqrt(len(u))
    dots = "".join(
        f'<circle cx="{cx:.1f}" cy="{cy:.1f}" r="{dot:.2f}" fill="{colour}"/>'
        for cx, cy, colour in zip(x, y, shades(logarithm), strict=True)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{SIZE_PX}" height="{SIZE_PX}" '
        f'viewBox="0 0 {SIZE_PX} {SIZE_PX}" role="img" aria-label="directions of all mirrors">'
        f"{dots}</svg>"
    )


def equal_area(u: Floats) -> Floats:
    """Lambert's projection of unit vectors (m, 3), z >= 0, to the unit disc, (m, 2)."""
    return np.asarray(u[:, :2] / np.sqrt(1 + u[:, 2:]))
