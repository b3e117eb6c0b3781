"""Views of one light field or field, one after the other, as quickly as they are asked for."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from itertools import count
from threading import Lock
from typing import Literal

import numpy as np
from PIL import Image

from tbcad.core.optics.camera import Camera
from tbcad.errors import InputError
from tbcad.light.datasets.pictures import pinhole_pictures
from tbcad.light.depth.depth_map import DepthViews
from tbcad.light.reconstruction.field import Field
from tbcad.light.reconstruction.picture import field_picture
from tbcad.light.simulate.capture.light_field import LightField
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import ThinLens, lens_pinholes, refocus
from tbcad.light.simulate.views.synthesis import (
    Method,
    horizon_search_radius,
    search_radius,
    synthesise,
)
from tbcad.light.viewer.moving import moving_view
from tbcad.light.viewer.page import Query
from tbcad.types import Bytes, Progress

MethodAtRest = Method | Literal["depth"]
JPEG_QUALITY = 88
# While the view moves, a lens has 9 pinholes instead of 69, at half the width and height.
MOVING_RADIUS2 = 2
MOVING_STEP = 2
MOVING_STRIDE = 1.0  # distances of a field's nodes between samples, while the view moves


class Superseded(Exception):
    """Another view has been asked for meanwhile."""


class ViewRenderer(ABC):
    """Pictures of a light field or a field; one is made at a time, by all cores.

    Attributes:
        method: of views that do not move.
        lens: the light field that the pictures of a lens are added up from; None: there are none.
        capture_mm: diameter of the capture sphere.
    """

    def __init__(self, method: str, lens: MirrorTiles | None, capture_mm: float) -> None:
        """Prepare for requests; arguments as the attributes."""
        self.method, self.lens, self.capture_mm = method, lens, capture_mm
        self._lock = Lock()
        self._numbers = count(1)
        self._latest = 0

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

        Raises:
            InputError: a lens is asked for of a field without its light field.
        """
        view = query.camera(self.capture_mm)
        if query.aperture == 0:
            return self._at_rest(view) if query.still else self._moving(view)
        if self.lens is None:
            raise InputError(f"aperture {query.aperture:g}: a field alone has none, give 0")
        lens = ThinLens(query.aperture, query.focus)
        if query.still:
            return refocus(self.lens, view, lens, proceed=proceed).image
        smaller = _smaller(query).camera(self.capture_mm)
        return refocus(self.lens, smaller, lens, lens_pinholes(MOVING_RADIUS2)).image

    @abstractmethod
    def _at_rest(self, view: Camera) -> Bytes:
        """The best picture that a pinhole would see, (h, w, 3)."""

    @abstractmethod
    def _moving(self, view: Camera) -> Bytes:
        """The quickest, (h, w, 3)."""


class Renderer(ViewRenderer):
    """Pictures of a light field.

    Attributes:
        tiles: the light field.
        pictures: of its virtual cameras, for views that move.
    """

    method: MethodAtRest

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
        super().__init__(method, self.tiles, source.capture_mm)

    def _at_rest(self, view: Camera) -> Bytes:
        if self.method == "depth":
            return DepthViews(self.tiles, self.pictures).of(view)[0].image
        return synthesise(self.tiles, view, self.method).image

    def _moving(self, view: Camera) -> Bytes:
        return moving_view(self.pictures, view, self._limits)


class FieldRenderer(ViewRenderer):
    """Pictures of a field; those of a lens from the light field that it was fitted to."""

    def __init__(self, made: Field, lens: MirrorTiles | None = None) -> None:
        """Take a field, and its light field, whose file stays open, where it is at hand."""
        super().__init__("field", lens, capture_mm(made))
        self._made = made

    def _at_rest(self, view: Camera) -> Bytes:
        return field_picture(self._made, view).image

    def _moving(self, view: Camera) -> Bytes:
        return field_picture(self._made, view, MOVING_STRIDE).image


def capture_mm(pictured: MirrorTiles | Field) -> float:
    """Diameter of the capture sphere of a light field or a field."""
    if isinstance(pictured, Field):
        return pictured.grid.width_mm
    return pictured.source.capture_mm


def _smaller(query: Query) -> Query:
    width, height = query.width // MOVING_STEP, query.height // MOVING_STEP
    return replace(query, width=max(width, 1), height=max(height, 1))


def jpeg_bytes(image: Bytes) -> bytes:
    """An image (h, w, 3) as a JPEG file."""
    with BytesIO() as buffer:
        Image.fromarray(np.ascontiguousarray(image)).save(buffer, "JPEG", quality=JPEG_QUALITY)
        return buffer.getvalue()
