"""The pictures of all virtual cameras in memory, for views that take colours from them."""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.datasets.crops import chosen_mirrors
from tbcad.datasets.pictures import default_size, taken_pictures
from tbcad.datasets.virtual_cameras import VirtualCameras, virtual_cameras
from tbcad.optics.camera import Camera
from tbcad.simulate.capture.light_field import LightField
from tbcad.types import Bools, Bytes, Floats, Ints, Progress

MOST_BYTES, BYTES_PER_PIXEL = 1 << 30, 4  # of all pictures with their masks


@dataclass(frozen=True)
class PinholePictures:
    """Pictures of m virtual cameras that look at the origin.

    Attributes:
        centre: of the pinholes, mm, (m, 3).
        axes: rows: along the rows, down the columns, forward, (m, 3, 3).
        focal_px: (m,).
        picture: (m, s, s, 3).
        mask: where it is known, (m, s, s).
        capture_mm: diameter of the capture sphere.
    """

    centre: Floats
    axes: Floats
    focal_px: Floats
    picture: Bytes
    mask: Bools
    capture_mm: float


def pinhole_pictures(source: LightField, progress: Progress = lambda _: None) -> PinholePictures:
    """The pictures of all virtual cameras of a light field."""
    virtual = virtual_cameras(source, chosen_mirrors(source, None, 1), progress)
    taken = taken_pictures(source, virtual, _size(virtual, source.capture_mm), None, progress)
    axes = np.array([one.axes for one in taken.cameras]).reshape(-1, 3, 3)
    focal = np.array([1 / one.pixel_pitch for one in taken.cameras])
    return PinholePictures(
        virtual.centre, axes, focal, taken.picture, taken.mask, source.capture_mm
    )


def _size(virtual: VirtualCameras, capture_mm: float) -> int:
    """Width and height of the pictures, smaller where they would take too much memory."""
    if not len(virtual):
        return 1
    most = math.isqrt(MOST_BYTES // (BYTES_PER_PIXEL * len(virtual)))
    return min(default_size(virtual, capture_mm), most)


def facing(pictures: PinholePictures, view: Camera) -> tuple[Ints, Floats]:
    """Virtual cameras on the side of a view (k,), and their places along its axes, (k, 3).

    The places are weighted: a target ray to image point (x, y), at unit distance, is at least
    |(px - pz x, py - pz y)| from all rays of a camera with place p, mm, as root mean square over
    the depth of the capture sphere (`two_plane`).
    """
    scale, plane = pictures.capture_mm / 2 / np.sqrt(3), -float(view.pinhole @ view.forward)
    place = (pictures.centre - view.pinhole) @ view.axes.T
    depth = place[:, 2] - plane
    near = np.flatnonzero(depth < 0)  # the others see the back of the object
    return near, place[near] / np.sqrt(1 + (depth[near, None] / scale) ** 2)


def projections(pictures: PinholePictures, view: Camera, some: Ints) -> Floats:
    """Matrices (k, 3, 4) from points (right, down, forward, 1) of a view into some pictures.

    The result is homogeneous: column and row, of which whole numbers are pixel centres.
    """
    lens = np.zeros((len(some), 3, 3))
    lens[:, 0, 0] = lens[:, 1, 1] = pictures.focal_px[some]
    lens[:, :2, 2], lens[:, 2, 2] = (pictures.mask.shape[1] - 1) / 2, 1.0
    into = lens @ pictures.axes[some]
    offset = into @ (view.pinhole - pictures.centre[some])[..., None]
    return np.concatenate([into @ view.axes.T, offset], axis=2)
