"""Views of one light field, one after the other, as quickly as they are asked for."""

from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from itertools import count
from threading import Lock
from typing import Literal

import numpy as np
from PIL import Image

from tbcad.datasets.pinhole_pictures import pinhole_pictures
from tbcad.depth.view import DepthViews
from tbcad.optics.camera import Camera
from tbcad.simulate.capture.light_field import LightField
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.refocus import ThinLens, lens_pinholes, refocus
from tbcad.simulate.views.synthesis import (
    Method,
    horizon_search_radius,
    search_radius,
    synthesise,
)
from tbcad.types import Bytes, Progress
from tbcad.viewer.moving import moving_view
from tbcad.viewer.query import Query

MethodAtRest = Method | Literal["depth"]
JPEG_QUALITY = 88
# While the view moves, a lens has 9 pinholes instead of 69, at half the width and height.
MOVING_RADIUS2 = 2
MOVING_STEP = 2


class Superseded(Exception):
    """Another view has been asked for meanwhile."""


class Renderer:
    """Pictures of a light field; one is made at a time, by all cores.

    Attributes:
        tiles: the light field.
        pictures: of its virtual cameras, for views that move.
        method: of views that do not move: at the depth that is found, a blend on the plane, or
            nearest rays.
    """

    def __init__(
        self,
        source: LightField,
        method: MethodAtRest = "depth",
        progress: Progress = lambda _: None,
    ) -> None:
        """Make the pictures of all virtual cameras.

        Args:
            source: a light field, whose file stays open.
            method: of views that do not move.
            progress: called with each step.
        """
        self.tiles = MirrorTiles(source)
        self.pictures = pinhole_pictures(source, progress)
        self._limits = search_radius(self.tiles), horizon_search_radius(self.tiles)
        self.method: MethodAtRest = method
        self._lock = Lock()
        self._numbers = count(1)
        self._latest = 0

    @property
    def capture_mm(self) -> float:
        """Diameter of the capture sphere."""
        return self.tiles.source.capture_mm

    def jpeg(self, query: Query) -> bytes:
        """The picture of a query, as a JPEG file.

        Raises:
            Superseded: another one was asked for while the lens's pinholes were being added up.
        """
        number = self._latest = next(self._numbers)

        def proceed() -> None:
            if number != self._latest:
                raise Superseded

        with self._lock:
            image = self.picture(query, proceed)
        return jpeg_bytes(image)

    def picture(self, query: Query, proceed: Callable[[], None] = lambda: None) -> Bytes:
        """The picture (h, w, 3) of a query; a lens that moves gives a smaller one.

        Args:
            query: the view.
            proceed: called now and then while a lens's pinholes are added up; may raise.
        """
        view = query.camera(self.capture_mm)
        if query.aperture == 0 and query.still:
            return self._at_rest(view)
        if query.aperture == 0:
            return moving_view(self.pictures, view, self._limits)
        lens = ThinLens(query.aperture, query.focus)
        if query.still:
            return refocus(self.tiles, view, lens, proceed=proceed).image
        smaller = _smaller(query).camera(self.capture_mm)
        return refocus(self.tiles, smaller, lens, lens_pinholes(MOVING_RADIUS2)).image

    def _at_rest(self, view: Camera) -> Bytes:
        if self.method == "depth":
            return DepthViews(self.tiles, self.pictures).of(view)[0].image
        return synthesise(self.tiles, view, self.method).image


def _smaller(query: Query) -> Query:
    width, height = query.width // MOVING_STEP, query.height // MOVING_STEP
    return replace(query, width=max(width, 1), height=max(height, 1))


def jpeg_bytes(image: Bytes) -> bytes:
    """An image (h, w, 3) as a JPEG file."""
    with BytesIO() as buffer:
        Image.fromarray(np.ascontiguousarray(image)).save(buffer, "JPEG", quality=JPEG_QUALITY)
        return buffer.getvalue()
