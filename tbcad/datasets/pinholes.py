"""Pinhole cameras as the files of radiance fields have them (transforms.json)."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tbcad.optics.camera import Camera
from tbcad.types import Floats


@dataclass(frozen=True)
class Pinhole:
    """A pinhole camera with its own focal length along rows and columns.

    Attributes:
        centre: mm, (3,).
        axes: rows: unit vectors along the rows, down the columns, and forward, (3, 3).
        focal_px: along the rows and down the columns, (2,).
        principal_px: column and row of the axis, (2,); the first pixel's centre is (0.5, 0.5).
        size_px: columns and rows.
    """

    centre: Floats
    axes: Floats
    focal_px: Floats
    principal_px: Floats
    size_px: tuple[int, int]

    @property
    def camera_to_world(self) -> list[list[float]]:
        """Matrix of a camera that looks along -z with +y up and +x to the right, 4 x 4."""
        right, down, forward = self.axes
        matrix = np.eye(4)
        matrix[:3] = np.column_stack([right, -down, -forward, self.centre])
        return [[float(value) for value in row] for row in matrix]

    def intrinsics(self) -> dict[str, Any]:
        """Focal lengths, principal point and size by their names in transforms.json."""
        fl_x, fl_y = self.focal_px.tolist()
        cx, cy = self.principal_px.tolist()
        width, height = self.size_px
        return {"fl_x": fl_x, "fl_y": fl_y, "cx": cx, "cy": cy, "w": width, "h": height}


def pinhole_of(camera: Camera) -> Pinhole:
    """A camera with square pixels whose axis meets the middle of the picture."""
    size = np.array([camera.width_px, camera.height_px])
    focal = np.full(2, 1 / camera.pixel_pitch)
    return Pinhole(
        camera.pinhole, camera.axes, focal, size / 2, (camera.width_px, camera.height_px)
    )
