"""A lens as its calibration gives it, without the camera's pose."""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.errors import InputError
from tbcad.optics.lens_camera import LensCamera, distorted
from tbcad.types import Floats

FOCAL_SHARES = (0.05, 50.0)  # of the width, that a focal length may have


@dataclass(frozen=True)
class Lens:
    """Focal lengths, principal point and distortion by OpenCV's model.

    Attributes:
        focal: along rows and columns, pixels, (2,).
        principal: column and row of the optical axis; whole numbers are pixel centres, (2,).
        distortion: k1, k2, p1, p2, k3, (5,).
        width_px: columns; None where the file does not say.
        height_px: rows; likewise.
    """

    focal: Floats
    principal: Floats
    distortion: Floats
    width_px: int | None = None
    height_px: int | None = None

    def on(self, camera: LensCamera) -> LensCamera:
        """A camera with this lens.

        Raises:
            InputError: the lens was calibrated at another size of the picture.
        """
        size = camera.width_px, camera.height_px
        if self.width_px is not None and (self.width_px, self.height_px) != size:
            raise InputError(
                f"--intrinsics is of pictures of {self.width_px} x {self.height_px} pixels, the "
                f"run's have {size[0]} x {size[1]}: calibrate the lens at that size"
            )
        return replace(
            camera, focal=self.focal, principal=self.principal, distortion=self.distortion
        )

    def checked(self, name: str) -> "Lens":
        """This lens, if a camera can have it.

        Args:
            name: of its file, for the error.

        Raises:
            InputError: it cannot.
        """
        values = np.concatenate([self.focal, self.principal, self.distortion])
        if not np.isfinite(values).all() or (self.focal <= 0).any():
            raise InputError(f"{name}: focal lengths must be above 0, and all numbers finite")
        width = self.width_px or 2 * self.principal[0]
        share = self.focal / width
        if (share < FOCAL_SHARES[0]).any() or (share > FOCAL_SHARES[1]).any():
            raise InputError(
                f"{name}: focal lengths of {self.focal[0]:g} and {self.focal[1]:g} pixels do not "
                f"fit a picture of {width:g} columns: give the file of this camera"
            )
        self._check_folding(name)
        return self

    def _check_folding(self, name: str) -> None:
        """Distortion may not show the inner part of the picture farther out than its corner."""
        corner = np.abs(self.principal / self.focal)
        place = np.linspace(0, 1, 200)[:, None] * corner
        shown = np.linalg.norm(distorted(place, self.distortion), axis=1)
        if (np.diff(shown) <= 0).any():
            raise InputError(
                f"{name}: the distortion folds the picture over itself within its corners: "
                "calibrate the lens with boards up to the corners"
            )
