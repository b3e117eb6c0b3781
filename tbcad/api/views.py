"""Views of a light field."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Literal

from tbcad.api.arguments import silent

if TYPE_CHECKING:
    from tbcad.depth.view import DepthViews
    from tbcad.simulate.capture.light_field import LightField
    from tbcad.simulate.views.mirror_tiles import MirrorTiles
    from tbcad.simulate.views.synthesis import Method, SynthesisedView
    from tbcad.types import Progress


class Views:
    """Many views of one light field: what they share is made once, when it is first needed.

    >>> views = tbcad.Views(light_field)
    >>> pictures = [views.view(azimuth, 30).image for azimuth in range(0, 360, 4)]
    """

    def __init__(
        self, light_field: LightField, *, quick: bool = False, progress: Progress = silent
    ) -> None:
        """Read nothing yet.

        Args:
            light_field: in memory, or in a file that stays open.
            quick: look for the depth on fewer planes and at fewer points: a sixth of the time.
            progress: called with the state of what is made once.
        """
        self._light_field, self._quick, self._progress = light_field, quick, progress

    @cached_property
    def _tiles(self) -> MirrorTiles:
        from tbcad.simulate.views.mirror_tiles import MirrorTiles

        return MirrorTiles(self._light_field)

    @cached_property
    def _depths(self) -> DepthViews:
        from tbcad.depth.plane_sweep import FINE, QUICK
        from tbcad.depth.view import depth_views

        return depth_views(self._tiles, QUICK if self._quick else FINE, self._progress)

    def view(
        self,
        azimuth_deg: float = 0.0,
        elevation_deg: float = 30.0,
        *,
        distance_mm: float = 640.0,
        size: tuple[int, int] = (640, 480),
        method: Method | Literal["depth"] = "depth",
    ) -> SynthesisedView:
        """One of them, as `tbcad.view`.

        Raises:
            InputError: the viewpoint lies below the hemisphere of virtual cameras, or in the
                object.
        """
        from math import radians

        from tbcad.simulate.scene.viewpoint import camera_around_object
        from tbcad.simulate.views.synthesis import synthesise

        angles = radians(azimuth_deg), radians(elevation_deg)
        capture_mm = self._light_field.capture_mm
        camera = camera_around_object(*angles, distance_mm, capture_mm, size)
        if method == "depth":
            return self._depths.of(camera)[0]
        return synthesise(self._tiles, camera, method)


def view(
    light_field: LightField,
    azimuth_deg: float = 0.0,
    elevation_deg: float = 30.0,
    *,
    distance_mm: float = 640.0,
    size: tuple[int, int] = (640, 480),
    method: Method | Literal["depth"] = "depth",
) -> SynthesisedView:
    """Synthesise the picture of a pinhole camera anywhere around the object, as `tbcad view` does.

    Args:
        light_field: in memory, or in an open file.
        azimuth_deg: of the camera about z, from x.
        elevation_deg: of the camera above the plane z = 0, 0 to 90.
        distance_mm: of the camera from the centre of the object.
        size: columns and rows of the picture.
        method: "nearest" rays, the quickest; "blend" on a plane; or a blend at the "depth" that
            the light field itself shows, the best, for which the pictures of all virtual cameras
            are made first. `Views` keeps them for further views.

    Raises:
        InputError: the viewpoint lies below the hemisphere of virtual cameras, or in the object.
    """
    return Views(light_field).view(
        azimuth_deg, elevation_deg, distance_mm=distance_mm, size=size, method=method
    )
