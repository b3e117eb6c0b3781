"""A thin lens before a range of depths: blur, diffraction and light."""

import math
from dataclasses import dataclass

AIRY_FACTOR = 2.44  # diameter of the Airy disc in wavelengths times F-number


@dataclass(frozen=True)
class Lens:
    """A thin lens without aberrations, its stop at the lens, and the pixels behind it."""

    pixel: float  # width of a pixel, mm
    image: float  # distance from lens to sensor, mm
    wide_open: float  # F-number with the stop fully open
    wavelength: float  # mm


@dataclass(frozen=True)
class DepthRange:
    """Depths along the lens's axis that are to be sharp together, mm."""

    near: float
    far: float

    @property
    def focus(self) -> float:
        """Depth to focus on: blur at both ends is the same there (their harmonic mean), mm."""
        return 2 / (1 / self.near + 1 / self.far)

    @property
    def spread(self) -> float:
        """Difference of the ends' vergences, 1/mm."""
        return 1 / self.near - 1 / self.far


def lens_for(
    hfov: float, width_px: int, pixel: float, wide_open: float, wavelength: float = 550e-6
) -> Lens:
    """The lens that gives an angle of view (radians) across a sensor of pixels (mm)."""
    return Lens(pixel, width_px * pixel / (2 * math.tan(hfov / 2)), wide_open, wavelength)


def focal_length(lens: Lens, over: DepthRange) -> float:
    """Focal length with which the lens is in focus on the range: 1/f = 1/image + 1/focus, mm."""
    return 1 / (1 / lens.image + 1 / over.focus)


def blur_limited(lens: Lens, over: DepthRange, blur_px: float) -> float:
    """Largest pupil whose blur circle is at most this many pixels, mm.

    A point at depth s before a lens in focus at D has a blur circle of pupil * image *
    |1/s - 1/D|, wherever it is in the picture; at both ends of the range that is half the spread.
    """
    return min(2 * blur_px * lens.pixel / (lens.image * over.spread), _open(lens, over))


def sharpest(lens: Lens, over: DepthRange) -> float:
    """Pupil with which blur circle and Airy disc together are smallest: there they are equal, mm.

    The blur is pupil * image * spread / 2, the disc 2.44 wavelength * image / pupil.
    """
    return min(math.sqrt(2 * AIRY_FACTOR * lens.wavelength / over.spread), _open(lens, over))


def _open(lens: Lens, over: DepthRange) -> float:
    return focal_length(lens, over) / lens.wide_open


def aperture_stop(lens: Lens, over: DepthRange, pupil: float) -> dict[str, float]:
    """What a pupil (mm) does to a range.

    Diameters of the blur circle at both ends of the range and of the Airy disc on the axis, and the
    root of the sum of their squares, in pixels; light relative to the lens wide open, and light
    lost in photographic stops (factors of two).
    """
    blur = pupil * lens.image * over.spread / 2 / lens.pixel
    airy = AIRY_FACTOR * lens.wavelength * lens.image / pupil / lens.pixel
    light = (pupil / _open(lens, over)) ** 2
    return {
        "pupil_mm": pupil,
        "f_number": focal_length(lens, over) / pupil,
        "blur_px": blur,
        "airy_px": airy,
        "total_px": math.hypot(blur, airy),
        "light": light,
        "stops_lost": math.log2(1 / light),
    }


def aperture_stops(lens: Lens, over: DepthRange, blur_px: float) -> dict[str, dict[str, float]]:
    """The three stops that matter, by name."""
    pupils = {
        "wide open": _open(lens, over),
        "blur limited": blur_limited(lens, over, blur_px),
        "sharpest": sharpest(lens, over),
    }
    return {name: aperture_stop(lens, over, pupil) for name, pupil in pupils.items()}
