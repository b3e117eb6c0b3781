"""The depth of a view as files: a picture of 16 bits, and points with colours.

Depth is in mm behind the plane through the origin that faces the view, NaN where it is unknown.
"""

import numpy as np

from tbcad.formats.ply import points_ply
from tbcad.optics.camera import Camera
from tbcad.picture_bytes import png_bytes
from tbcad.simulate.scene.viewpoint import view_directions
from tbcad.types import Bytes, Floats

FRONT = 65535  # the number of the capture sphere's front; 0 is unknown


def depth_png(depth: Floats, capture_mm: float) -> bytes:
    """Depth (h, w) as a PNG of 16 bits: 1 at the capture sphere's back, 65535 at its front."""
    share = 0.5 - depth / capture_mm
    number = np.rint(1 + (FRONT - 1) * np.clip(share, 0, 1))
    return png_bytes(np.nan_to_num(number).astype(np.uint16))


def depth_points(view: Camera, depth: Floats) -> Floats:
    """Points (h, w, 3) of a view's depth (h, w), mm; NaN where it is unknown."""
    along = view_directions(view)
    along /= (along @ view.forward)[..., None]
    plane = -float(view.pinhole @ view.forward)
    return np.asarray(view.pinhole + (plane + depth)[..., None] * along)


def depth_ply(view: Camera, depth: Floats, image: Bytes) -> bytes:
    """The points that are known as PLY, with the colours of a picture (h, w, 3)."""
    points = depth_points(view, depth).reshape(-1, 3)
    known = np.isfinite(points).all(axis=1)
    return points_ply(points[known], image.reshape(-1, 3)[known])
