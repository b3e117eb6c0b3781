"""Frames that are traced when they are read, against whole photographs."""

import numpy as np

from tbcad.core.mirrors.array import MirrorDesign
from tbcad.light.simulate.capture.light_field import PIXEL_ARRAYS, LightField, traced_light_field
from tbcad.light.simulate.scene.ray_casting import Scene


def test_every_part_is_that_of_the_photograph(
    low_resolution_design: MirrorDesign, knot: Scene, light_field: LightField
) -> None:
    traced = traced_light_field(low_resolution_design, knot)
    assert traced.capture_mm == light_field.capture_mm
    for name, frame in light_field.frames.items():
        rows, columns = frame.planes["mirror"].shape
        parts = [np.s_[:rows, :columns], np.s_[rows // 3 : rows // 2, 7 : columns // 2]]
        for part in parts + [np.s_[box[2] : box[3], box[0] : box[1]] for box in frame.boxes[::40]]:
            expected, got = frame.read(*part), traced.frames[name].read(*part)
            for plane in PIXEL_ARRAYS:
                assert np.array_equal(got[plane], expected[plane]), plane
                assert got[plane].dtype == expected[plane].dtype
