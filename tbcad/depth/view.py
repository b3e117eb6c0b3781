"""Views as a blend of virtual cameras on the surface that they show themselves."""

from dataclasses import dataclass

from tbcad.datasets.pinhole_pictures import PinholePictures, pinhole_pictures
from tbcad.depth.depth_map import DepthMap, depth_map
from tbcad.depth.plane_sweep import FINE, Sweep
from tbcad.optics.camera import Camera
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import SynthesisedView, synthesise
from tbcad.types import Progress


@dataclass(frozen=True)
class DepthViews:
    """What views of a light field are made from, one after the other.

    Attributes:
        tiles: the light field.
        pictures: of its virtual cameras.
        sweep: how fine the depth is looked for.
    """

    tiles: MirrorTiles
    pictures: PinholePictures
    sweep: Sweep = FINE

    def of(
        self, view: Camera, shown: MirrorTiles | None = None
    ) -> tuple[SynthesisedView, DepthMap]:
        """The picture that a pinhole camera would see, and its depth.

        Args:
            view: the camera, which looks at the origin.
            shown: another light field of the same rays, whose colours the picture has.

        Raises:
            InputError: the camera looks elsewhere.
        """
        found = depth_map(self.pictures, view, self.sweep)
        return synthesise(shown or self.tiles, view, "blend", found.along_rays), found


def depth_views(
    tiles: MirrorTiles, sweep: Sweep = FINE, progress: Progress = lambda _: None
) -> DepthViews:
    """Make the pictures of all virtual cameras, from which views are then made quickly.

    Args:
        tiles: the light field.
        sweep: how fine the depth is looked for.
        progress: called with each virtual camera whose picture is made.
    """
    return DepthViews(tiles, pinhole_pictures(tiles.source, progress), sweep)
