"""A view as a blend of virtual cameras on the surface that they show themselves."""

from tbcad.datasets.pinhole_pictures import pinhole_pictures
from tbcad.depth.depth_map import DepthMap, depth_map
from tbcad.optics.camera import Camera
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import SynthesisedView, synthesise
from tbcad.types import Progress


def depth_view(
    tiles: MirrorTiles,
    view: Camera,
    progress: Progress = lambda _: None,
    shown: MirrorTiles | None = None,
) -> tuple[SynthesisedView, DepthMap]:
    """The picture that a pinhole camera would see, and its depth.

    Args:
        tiles: the light field.
        view: the camera, which looks at the origin.
        progress: called with each virtual camera whose picture is made.
        shown: another light field of the same rays, whose colours the picture has.

    Raises:
        InputError: the camera looks elsewhere.
    """
    found = depth_map(pinhole_pictures(tiles.source, progress), view)
    return synthesise(shown or tiles, view, "blend", found.along_rays), found
