"""Viewpoints around the object, and the quality of a light field's views from there."""

from dataclasses import dataclass

import numpy as np

from tbcad.errors import InputError
from tbcad.optics.camera import Camera
from tbcad.simulate.capture.photograph import to_bytes
from tbcad.simulate.image_quality import image_quality
from tbcad.simulate.scene.ground_truth import pinhole_picture
from tbcad.simulate.scene.ray_casting import Scene, depth_along_rays
from tbcad.simulate.scene.viewpoint import camera_around_object
from tbcad.simulate.views.mirror_tiles import MirrorTiles
from tbcad.simulate.views.synthesis import Method, synthesise
from tbcad.types import Bytes, Floats, Progress

ELEVATIONS_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
MAX_AZIMUTHS = 360


@dataclass(frozen=True)
class Viewpoints:
    """Viewpoints at some elevations, evenly around the object at each.

    Attributes:
        elevation_deg: of each viewpoint, (v,).
        azimuth_deg: of each viewpoint, (v,).
        distance_mm: of all of them from the origin.
    """

    elevation_deg: Floats
    azimuth_deg: Floats
    distance_mm: float

    def cameras(self, capture_mm: float) -> list[Camera]:
        """The cameras, 640 x 480, each filled by the capture sphere."""
        azimuth, elevation = np.radians([self.azimuth_deg, self.elevation_deg]).tolist()
        return [
            camera_around_object(a, e, self.distance_mm, capture_mm)
            for a, e in zip(azimuth, elevation, strict=True)
        ]


def viewpoints_around(
    elevations_deg: tuple[float, ...], azimuths: int, distance_mm: float
) -> Viewpoints:
    """Viewpoints at some elevations, and at each a number of azimuths evenly around the object.

    Raises:
        InputError: there are none or too many.
    """
    if not 1 <= azimuths <= MAX_AZIMUTHS:
        raise InputError(
            f"--azimuths {azimuths}: allowed is 1 to {MAX_AZIMUTHS} viewpoints around the object"
        )
    around = np.arange(azimuths) * 360.0 / azimuths
    elevation, azimuth = (x.ravel() for x in np.meshgrid(elevations_deg, around, indexing="ij"))
    return Viewpoints(elevation, azimuth, distance_mm)


def ground_truths(scene: Scene, views: list[Camera], progress: Progress) -> list[Bytes]:
    """What a real camera would see from each viewpoint, (h, w, 3)."""
    truths = []
    for k, view in enumerate(views):
        progress(f"truth {k + 1} of {len(views)}")
        truths.append(to_bytes(pinhole_picture(scene, view)))
    return truths


def view_quality(
    tiles: MirrorTiles,
    scene: Scene,
    views: list[Camera],
    truths: list[Bytes],
    method: Method,
    progress: Progress,
) -> Floats:
    """PSNR (dB) and SSIM of the light field's views against the truth, (v, 2).

    Args:
        tiles: the light field.
        scene: the object, whose depth a blend takes.
        views: the viewpoints, v of them.
        truths: the ground truth at each.
        method: how the views are made.
        progress: called with each step.
    """
    depth = depth_along_rays(scene) if method == "blend" else None
    qualities = []
    for k, (view, truth) in enumerate(zip(views, truths, strict=True)):
        progress(f"view {k + 1} of {len(views)}")
        quality = image_quality(truth, synthesise(tiles, view, method, depth).image)
        qualities.append((quality.psnr_db, quality.ssim))
    return np.array(qualities)
