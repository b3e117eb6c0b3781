"""Views of a light field or a field."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tbcad.errors import InputError
from tbcad.options.call import silent
from tbcad.options.python_help import in_lines

if TYPE_CHECKING:
    from tbcad.core.optics.camera import Camera
    from tbcad.light.depth.depth_map import DepthViews
    from tbcad.light.reconstruction.field import Field
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.light.simulate.views.refocus import ThinLens
    from tbcad.light.simulate.views.synthesis import SynthesisedView
    from tbcad.types import Progress


class Views:
    """Many views of one light field or field: what they share is made once, when first needed.

    >>> views = tbcad.Views(light_field)
    >>> pictures = [views.view(azimuth, 30).image for azimuth in range(0, 360, 4)]
    """

    def __init__(self, source: LightField | Field | Path | str, *, quick: bool = False) -> None:
        """Read nothing yet.

        Args:
            source: a light field, in memory or in a file that stays open; a field; or the folder
                of a capture, which is shown by the field in it, if there is one.
            quick: look for the depth of a light field on fewer planes and at fewer points: a sixth
                of the time.
        """
        self._source = Path(source) if isinstance(source, str) else source
        self._quick = quick

    @cached_property
    def light_field(self) -> LightField:
        """The light field; a file stays open."""
        from tbcad.light.simulate.capture.light_field import LightField

        if isinstance(self._source, LightField):
            return self._source
        if not isinstance(self._source, Path):
            raise InputError(
                f"source is {self._source!r:.60}, allowed is a light field, the folder of a "
                "capture, or for views a field: change it"
            )
        return LightField.open(self._source)

    @cached_property
    def _field(self) -> Field | None:
        """The field that is shown by default, if there is one."""
        from tbcad.light.reconstruction.field import Field, wanted_field

        if isinstance(self._source, Field):
            return self._source
        if not isinstance(self._source, Path):
            return None
        return wanted_field(None, self._source, self.light_field)

    @cached_property
    def tiles(self) -> MirrorTiles:
        """Its mirrors, as views need them."""
        from tbcad.light.simulate.views.mirror_tiles import MirrorTiles

        return MirrorTiles(self.light_field)

    @cached_property
    def _depths(self) -> DepthViews:
        from tbcad.light.depth.depth_map import depth_views
        from tbcad.light.depth.plane_sweep import FINE, QUICK

        return depth_views(self.tiles, QUICK if self._quick else FINE)

    def view(
        self,
        azimuth_deg: float = 0.0,
        elevation_deg: float = 30.0,
        *,
        distance_mm: float = 640.0,
        size: tuple[int, int] = (640, 480),
        method: Literal["nearest", "depth"] | None = None,
    ) -> SynthesisedView:
        """One of them, as `tbcad.view`.

        Raises:
            InputError: the viewpoint lies below the hemisphere of virtual cameras, or in the
                object; a method is named for a field.
        """
        from tbcad.light.reconstruction.field import Field
        from tbcad.light.viewer.page import Query

        made = self._field if method is None or isinstance(self._source, Field) else None
        capture_mm = self.light_field.capture_mm if made is None else made.grid.width_mm
        view = Query(azimuth_deg, elevation_deg, distance_mm, width=size[0], height=size[1])
        camera = view.camera(capture_mm)
        if made is None:
            from tbcad.light.simulate.views.synthesis import synthesise

            if method == "nearest":
                return synthesise(self.tiles, camera)
            return self._depths.of(camera)[0]
        if method is not None:
            raise InputError(f"method {method!r} is for a light field: leave it out for a field")
        return _of_field(made, camera)


def _of_field(made: Field, camera: Camera) -> SynthesisedView:
    import numpy as np

    from tbcad.light.reconstruction.picture import field_picture
    from tbcad.light.simulate.views.synthesis import SynthesisedView

    image = field_picture(made, camera).image
    return SynthesisedView(image.astype(np.float32), np.ones(image.shape[:2], dtype=np.bool_))


@in_lines
def view(
    source: LightField | Field | Path | str,
    azimuth_deg: float = 0.0,
    elevation_deg: float = 30.0,
    *,
    distance_mm: float = 640.0,
    size: tuple[int, int] = (640, 480),
    method: Literal["nearest", "depth"] | None = None,
) -> SynthesisedView:
    """Synthesise the picture of a pinhole camera anywhere around the object, as `tbcad view` does.

    Args:
        source: a light field, in memory or in an open file; the field of `tbcad.reconstruct`, the
            best where there is one; or the folder of a capture, with or without such a field.
        azimuth_deg: of the camera about z, from x.
        elevation_deg: of the camera above the plane z = 0, 0 to 90.
        distance_mm: of the camera from the centre of the object.
        size: columns and rows of the picture.
        method: of a light field: "nearest" rays, the quickest; or a blend at the "depth" that
            the light field itself shows, the best and the default, for which the
            pictures of all virtual cameras are made first. `Views` keeps them for further views.

    Raises:
        InputError: the viewpoint lies below the hemisphere of virtual cameras, or in the object; a
            method is named for a field.
    """
    return Views(source).view(
        azimuth_deg, elevation_deg, distance_mm=distance_mm, size=size, method=method
    )


def refocused(
    tiles: MirrorTiles, at: Camera, lens: ThinLens, all_in_focus: bool, progress: Progress = silent
) -> SynthesisedView:
    """The picture of a lens, sharp at its focus or everywhere."""
    from tbcad.light.datasets.pictures import pinhole_pictures
    from tbcad.light.depth.depth_map import depth_map
    from tbcad.light.simulate.views.refocus import refocus, refocus_everywhere

    if not all_in_focus:
        return refocus(tiles, at, lens)
    depth = depth_map(pinhole_pictures(tiles.source, progress), at)
    return refocus_everywhere(tiles, at, lens.aperture_mm, depth.along_rays)


@in_lines
def refocus(
    source: LightField | Path | str,
    azimuth_deg: float = 0.0,
    elevation_deg: float = 30.0,
    *,
    aperture_mm: float = 300.0,
    focus_mm: float = 0.0,
    all_in_focus: bool = False,
    distance_mm: float = 640.0,
    size: tuple[int, int] = (640, 480),
) -> SynthesisedView:
    """Refocus a light field as `tbcad refocus`: the picture of a large lens, of 69 pinhole views.

    Args:
        source: a light field, in memory or in an open file, or the folder of a capture.
        azimuth_deg: of the lens about z, from x.
        elevation_deg: of the lens above the plane z = 0, 0 to 90.
        aperture_mm: diameter of the lens.
        focus_mm: position of the focal plane, from the centre of the object toward the lens.
        all_in_focus: each pixel is sharp at its own depth, which is found in the light field.
        distance_mm: of the lens from the centre of the object.
        size: columns and rows of the picture.

    Raises:
        InputError: the viewpoint lies below the hemisphere of virtual cameras, or in the object;
            there is no such lens, or its focus is far from the object.
    """
    from tbcad.light.simulate.views.refocus import ThinLens
    from tbcad.light.viewer.page import Query

    views = Views(source)
    capture_mm = views.light_field.capture_mm
    view = Query(azimuth_deg, elevation_deg, distance_mm, width=size[0], height=size[1])
    at = view.camera(capture_mm)
    lens = ThinLens(aperture_mm, focus_mm)
    lens.check(at, capture_mm)
    return refocused(views.tiles, at, lens, all_in_focus)
