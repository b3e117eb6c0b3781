"""The depth of a view as a surface: for views as a blend on it, as points, and as files.

Depth is in mm behind the plane through the origin that faces the view, NaN where it is unknown.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from PIL import Image

from tbcad.cad.formats.mesh_files import points_ply
from tbcad.common.compiled import compiled_loop
from tbcad.common.figure_files import image_bytes
from tbcad.core.optics.camera import Camera
from tbcad.light.datasets.pictures import PinholePictures, pinhole_pictures
from tbcad.light.depth.plane_sweep import FINE, Sweep, swept_depth
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.scene.rays import view_directions
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.synthesis import SynthesisedView, synthesise
from tbcad.light.simulate.views.viewpoints import ViewMethod
from tbcad.types import Bytes, Floats, Progress

FRONT = 65535  # the number of the capture sphere's front; 0 is unknown
# A plane that is less different than a middling one, by colour, is no surface but empty or even.
MIN_CONFIDENCE = 3.0
BLACK = 8  # of 255: no brighter is the background, which is matt black


def depth_png(depth: Floats, capture_mm: float) -> bytes:
    """Depth (h, w) as a PNG of 16 bits: 1 at the capture sphere's back, 65535 at its front."""
    share = 0.5 - depth / capture_mm
    number = np.rint(1 + (FRONT - 1) * np.clip(share, 0, 1))
    return image_bytes(np.nan_to_num(number).astype(np.uint16))


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


@dataclass(frozen=True)
class DepthMap:
    """Depth of a view."""

    view: Camera  # the camera of the depth's pixels
    # mm behind the plane through the origin that faces the view, (h, w); NaN where nothing shows it
    depth: Floats
    confidence: Floats  # by how much colours differ more on other planes, (h, w)
    capture_mm: float  # diameter of the capture sphere

    def along_rays(self, origin: Floats, direction: Floats) -> Floats:
        """Distance (n,) along rays (n, 3) of the view's pinhole to the surface, mm."""
        plane = -float(self.view.pinhole @ self.view.forward)
        away = plane + np.nan_to_num(self.depth)
        return _along(away, self.view.axes, self.view.pixel_pitch, np.ascontiguousarray(direction))

    def known(self) -> Floats:
        """Depth (h, w), NaN where no plane stands out as well."""
        return np.where(self.confidence > MIN_CONFIDENCE, self.depth, np.nan)

    def png(self) -> bytes:
        """The depth as a PNG of 16 bits: 1 at the capture sphere's back, 65535 at its front."""
        return depth_png(self.known(), self.capture_mm)

    def ply(self, image: Bytes) -> bytes:
        """The points that are known as PLY, with the colours of a picture of the view (h, w, 3).

        What is black there is left out: the background, whose depth nothing shows.
        """
        size = self.view.width_px, self.view.height_px
        smaller = np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))
        bright = smaller.max(axis=2) > BLACK
        return depth_ply(self.view, np.where(bright, self.known(), np.nan), smaller)


@compiled_loop
def _along(away: Floats, axes: Floats, pitch: float, direction: Floats) -> Floats:
    """Distance (n,) along rays (n, 3) to a surface `away` (h, w), mm, linear between its points."""
    height, width = away.shape
    result = np.empty(len(direction))
    for k in range(len(direction)):
        x = y = ahead = 0.0
        for j in range(3):
            x += axes[0, j] * direction[k, j]
            y += axes[1, j] * direction[k, j]
            ahead += axes[2, j] * direction[k, j]
        column = min(max(x / ahead / pitch + (width - 1) / 2, 0.0), width - 1.0)
        row = min(max(y / ahead / pitch + (height - 1) / 2, 0.0), height - 1.0)
        left, top = min(int(column), max(width - 2, 0)), min(int(row), max(height - 2, 0))
        right, bottom = min(left + 1, width - 1), min(top + 1, height - 1)
        u, v = column - left, row - top
        above = (1 - u) * away[top, left] + u * away[top, right]
        below = (1 - u) * away[bottom, left] + u * away[bottom, right]
        result[k] = ((1 - v) * above + v * below) / ahead
    return result


def depth_map(pictures: PinholePictures, view: Camera, sweep: Sweep = FINE) -> DepthMap:
    """The depth of a view, whose camera looks at the origin."""
    size = -(-view.width_px // sweep.step_px), -(-view.height_px // sweep.step_px)
    smaller = replace(view, width_px=max(size[0], 1), height_px=max(size[1], 1))
    depth, confidence = swept_depth(pictures, smaller, sweep)
    return DepthMap(smaller, depth, confidence, pictures.capture_mm)


@dataclass(frozen=True)
class DepthViews:
    """Source of views of a light field, one after the other."""

    tiles: MirrorTiles  # the light field
    pictures: PinholePictures  # of its virtual cameras
    sweep: Sweep = FINE  # how fine the depth is looked for

    def of(
        self, view: Camera, shown: MirrorTiles | None = None
    ) -> tuple[SynthesisedView, DepthMap]:
        """The picture that a pinhole camera which looks at the origin would see, and its depth.

        `shown` is another light field of the same rays, whose colours the picture has.
        """
        found = depth_map(self.pictures, view, self.sweep)
        return synthesise(shown or self.tiles, view, found.along_rays), found


def depth_views(
    tiles: MirrorTiles, sweep: Sweep = FINE, progress: Progress = lambda _: None
) -> DepthViews:
    """Make the pictures of all virtual cameras, from which views are then made quickly."""
    return DepthViews(tiles, pinhole_pictures(tiles.source, progress), sweep)


def _by_depth(source: LightField) -> Callable[[Camera], Bytes]:
    views = depth_views(MirrorTiles(source))
    return lambda view: views.of(view)[0].image


BY_DEPTH = ViewMethod("depth", _by_depth)
