"""How good views of a light field are, by the object itself."""

import numpy as np

from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.rays import camera_around_object
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.refocus import pinhole_picture
from tbcad.light.simulate.views.synthesis import synthesise
from tbcad.light.simulate.views.viewpoints import image_quality

THREE_SIDES_DEG = ((10.0, 25.0), (130.0, 40.0), (250.0, 55.0))
DISTANCE_MM, CAPTURE_MM = 640.0, 60.0
SIZE_PX = (160, 120)


def mean_ssim(tiles: MirrorTiles, scene: Scene) -> float:
    """Of views from three sides."""
    found = []
    for azimuth, elevation in np.radians(THREE_SIDES_DEG):
        at = camera_around_object(azimuth, elevation, DISTANCE_MM, CAPTURE_MM, SIZE_PX)
        truth = np.rint(pinhole_picture(scene, at)).astype(np.uint8)
        found.append(image_quality(truth, synthesise(tiles, at).image).ssim)
    return float(np.mean(found))
