"""A lens as its calibration gives it, without the camera's pose."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tbcad.core.optics.camera import LensCamera, distorted
from tbcad.core.spec.errors import short_text
from tbcad.errors import InputError
from tbcad.types import Floats

COEFFICIENTS = 5  # k1, k2, p1, p2, k3; what follows must be zero
FOCAL_SHARES = (0.05, 50.0)  # of the width, that a focal length may have
MAX_PX = 65_536
USABLE = (
    "use a pinhole with OpenCV's k1, k2, p1, p2, k3 (plumb_bob, radtan): calibrate with that "
    "model, as tbcad intrinsics does"
)
INSTALL = "pip install 'tbcad[machine]'"


@dataclass(frozen=True)
class CalibratedLens:
    """Focal lengths, principal point and distortion by OpenCV's model."""

    focal: Floats  # along rows and columns, pixels, (2,)
    principal: Floats  # column and row of the optical axis; whole numbers are pixel centres, (2,)
    distortion: Floats  # k1, k2, p1, p2, k3, (5,)
    width_px: int
    height_px: int

    def on(self, camera: LensCamera) -> LensCamera:
        """A camera with this lens; InputError: the lens is of another size of picture."""
        size = camera.width_px, camera.height_px
        if (self.width_px, self.height_px) != size:
            raise InputError(
                f"--intrinsics is of pictures of {self.width_px} x {self.height_px} pixels, the "
                f"run's have {size[0]} x {size[1]}: calibrate the lens at that size"
            )
        return replace(
            camera, focal=self.focal, principal=self.principal, distortion=self.distortion
        )

    def checked(self, name: str) -> "CalibratedLens":
        """This lens, or an InputError with the name of its file if no camera can have it."""
        if (self.focal <= 0).any():
            raise InputError(f"{name}: focal lengths must be above 0: export it again")
        share = self.focal / self.width_px
        if (share < FOCAL_SHARES[0]).any() or (share > FOCAL_SHARES[1]).any():
            raise InputError(
                f"{name}: focal lengths of {self.focal[0]:g} and {self.focal[1]:g} pixels do not "
                f"fit a picture of {self.width_px} columns: give the file of this camera"
            )
        size = np.array([self.width_px, self.height_px])
        if ((self.principal < 0) | (self.principal > size)).any():
            raise InputError(
                f"{name}: the principal point {self.principal[0]:g}, {self.principal[1]:g} is "
                f"outside of a picture of {size[0]} x {size[1]} pixels: give the camera's own file"
            )
        self._check_folding(name)
        return self

    def _check_folding(self, name: str) -> None:
        """Distortion may not show the inner part of the picture farther out than its corner."""
        size = np.array([self.width_px, self.height_px])
        corner = np.maximum(self.principal, size - 1 - self.principal) / self.focal
        place = np.linspace(0, 1, 200)[:, None] * corner
        with np.errstate(all="ignore"):  # coefficients of any size
            shown = np.linalg.norm(distorted(place, self.distortion), axis=1)
            folded = not (np.diff(shown) > 0).all()
        if folded:
            raise InputError(
                f"{name}: the distortion folds the picture over itself within its corners: "
                "calibrate the lens with boards up to the corners"
            )


def lens_of(
    intrinsics: Iterable[object], coefficients: Iterable[object], size: Iterable[object], name: str
) -> CalibratedLens:
    """A lens from 4 intrinsics, OpenCV's coefficients, columns and rows; InputError: it is none."""
    values, given = numbers_of(intrinsics, name), numbers_of(coefficients, name)
    if len(values) != 4:
        raise InputError(f"{name} has {len(values)} numbers, 4 or more are needed: export it again")
    if given[COEFFICIENTS:].any():
        raise InputError(
            f"{name} has more than five coefficients of distortion ({_model(len(given))}): {USABLE}"
        )
    distortion = np.zeros(COEFFICIENTS)
    distortion[: len(given)] = given[:COEFFICIENTS]
    width, height = numbers_of(size, name)
    if not all(value == round(value) and 0 < value <= MAX_PX for value in (width, height)):
        raise InputError(
            f"{name} is of pictures of {width:g} x {height:g} pixels: allowed are whole numbers to "
            f"{MAX_PX}"
        )
    return CalibratedLens(values[:2], values[2:], distortion, int(width), int(height))


def _model(coefficients: int) -> str:
    """OpenCV's name for the models that have more coefficients than are used here."""
    return {8: "rational model", 12: "thin prism model"}.get(coefficients, "tilted model")


def numbers_of(values: Iterable[object], name: str) -> Floats:
    """Finite numbers from texts and numbers of a file, (n,), or an InputError."""
    found = np.array([_number(value) for value in values], dtype=np.float64)
    if not np.isfinite(found).all():
        wrong = next(value for value in values if not np.isfinite(_number(value)))
        raise InputError(f"{name}: {short_text(wrong)} is no finite number: correct it")
    return found


def _number(value: object) -> float:
    try:
        return float(value) if isinstance(value, str | int | float) else np.nan
    except (ValueError, OverflowError):
        return np.nan


def cv() -> Any:
    """OpenCV, or an InputError where it is not installed."""
    try:
        import cv2
    except ImportError:
        raise InputError(f"OpenCV is needed for this: {INSTALL}") from None
    return cv2


def opencv_text(lens: CalibratedLens, facts: dict[str, float | int]) -> str:
    """A lens as OpenCV's YAML, which cv2.FileStorage and `read_lens` read, with further keys."""
    (fx, fy), (cx, cy) = lens.focal.tolist(), lens.principal.tolist()
    matrices = (
        ("camera_matrix", 3, 3, [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]),
        ("distortion_coefficients", 5, 1, lens.distortion.tolist()),
    )
    lines = ["%YAML:1.0", "---", f"image_width: {lens.width_px}", f"image_height: {lens.height_px}"]
    for name, rows, columns, values in matrices:
        lines += [f"{name}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {columns}"]
        lines += ["   dt: d", f"   data: [ {', '.join(map(repr, values))} ]"]
    lines += [f"{key}: {value!r}" for key, value in facts.items()]
    return "\n".join(lines) + "\n"
