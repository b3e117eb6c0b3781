"""How like the truth the views of a design are: the aim `ssim`, without any file or CAD kernel.

Viewpoints, object and method are those of `tbcad study ssim` as it is called without options, so
that both give the same figure; by a field, of the study with `--method field`.
"""

from dataclasses import dataclass
from functools import cache
from threading import Lock
from typing import Literal, TypeAlias

import numpy as np

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.optics.camera import Camera
from tbcad.light.reconstruction.picture import BY_FIELD
from tbcad.light.simulate.capture.light_field import traced_light_field
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import Scene, prepared_scene
from tbcad.light.simulate.views.mirror_tiles import MirrorTiles
from tbcad.light.simulate.views.viewpoints import (
    ELEVATIONS_DEG,
    ground_truths,
    image_quality,
    viewpoints_around,
    views_by,
)
from tbcad.types import Bytes

AZIMUTHS, DISTANCE_MM = 4, 640.0

ViewsBy: TypeAlias = Literal["nearest", "field"]

_one_at_a_time = Lock()  # candidates that begin together share the truth


@dataclass(frozen=True)
class Truth:
    """What real cameras would see of the built-in object."""

    scene: Scene
    cameras: list[Camera]
    pictures: list[Bytes]  # from each, (h, w, 3)


def mean_ssim(design: MirrorDesign, method: ViewsBy = "nearest") -> float:
    """Mean SSIM of views over the frame, from the stated viewpoints."""
    with _one_at_a_time:
        truth = _truth(design.spec.optics.capture_diameter_mm)
    tiles = MirrorTiles(traced_light_field(design, truth.scene))
    picture_of = views_by(BY_FIELD if method == "field" else method, tiles, truth.scene)
    views = zip(truth.cameras, truth.pictures, strict=True)
    return float(np.mean([image_quality(real, picture_of(at)).ssim for at, real in views]))


@cache
def _truth(capture_mm: float) -> Truth:
    scene = prepared_scene(built_in_object(capture_mm))
    cameras = viewpoints_around(ELEVATIONS_DEG, AZIMUTHS, DISTANCE_MM).cameras(capture_mm)
    return Truth(scene, cameras, ground_truths(scene, cameras, lambda _: None))
