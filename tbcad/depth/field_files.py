"""Depth, normals and opacity of a view of a field, as files."""

from io import BytesIO

import numpy as np
from PIL import Image

from tbcad.depth.depth_map import DepthMap
from tbcad.optics.camera import Camera
from tbcad.picture_bytes import png_bytes
from tbcad.reconstruct.picture import FieldPicture
from tbcad.simulate.scene.viewpoint import view_directions
from tbcad.types import Floats


def field_depth(picture: FieldPicture, view: Camera, capture_mm: float) -> DepthMap:
    """Where a field becomes half opaque, as the depth of a view; it is certain wherever it is."""
    along = view_directions(view) @ view.forward
    plane = -float(view.pinhole @ view.forward)
    depth = picture.distance * along - plane
    known = np.where(np.isfinite(depth), np.inf, 0.0)
    return DepthMap(view, depth, known, capture_mm)


def opacity_png(picture: FieldPicture) -> bytes:
    """The opacity as a grey PNG of 8 bits: 0 lets all light through."""
    grey = np.rint(255 * picture.opacity.astype(np.float64)).clip(0, 255)
    with BytesIO() as buffer:
        Image.fromarray(grey.astype(np.uint8)).save(buffer, "PNG")
        return buffer.getvalue()


def normals_png(picture: FieldPicture, view: Camera) -> bytes:
    """Normals of the surface as colours: 255 (n + 1) / 2 for x, y, z; black: there is none."""
    normal = normals(picture, view)
    colour = np.nan_to_num(np.rint(127.5 * (normal + 1)))
    return png_bytes(colour.astype(np.uint8))


def normals(picture: FieldPicture, view: Camera) -> Floats:
    """Unit normals (h, w, 3) of the surface through neighbouring pixels; NaN where none is."""
    points = view.pinhole + picture.distance[..., None] * view_directions(view)
    down, right = np.gradient(points, axis=(0, 1))
    normal = np.cross(down, right)
    size = np.linalg.norm(normal, axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        return np.asarray(normal / size)
