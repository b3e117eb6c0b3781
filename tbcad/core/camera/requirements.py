"""What a design asks of its cameras and lenses, in figures to buy by.

A thin lens before a range of depths has blur, diffraction and light.
"""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.mirrors.array import MirrorArray
from tbcad.types import Floats

AIRY_FACTOR = 2.44  # diameter of the Airy disc in wavelengths times F-number
PLACES = ("nearest", "centre", "farthest")
FANS = ("tangential", "sagittal")
ROUNDING_PX = 1e-6
WIDE_OPEN = 0.5  # F-number below any lens: no lens limits the requirement
# Light on the object: ISO 2720's constant of incident and reflected metering, a mid-grey object,
# and the light that a polished steel ball reflects (0.55 to 0.60 over the visible).
METER_CONSTANT, OBJECT_REFLECTANCE, MIRROR_REFLECTANCE = 12.5, 0.18, 0.55


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


@dataclass(frozen=True)
class VirtualImages:
    """Images of the object on the mirrors' principal rays, over m mirrors.

    A principal ray runs from the camera over the apex to the centre of the capture sphere.
    """

    array: MirrorArray  # the camera and its mirrors
    to_mirror: Floats  # from camera to apex, mm, (m,)
    incidence: Floats  # at the apex, radians, (m,)
    distance: Floats  # to images of nearest, centre, farthest by both fans, mm, (m, 3, 2)
    depth: Floats  # the same along the camera's optical axis, mm, (m, 3, 2)


def image_distances(
    curvature: Floats, incidence: Floats, distance: Floats
) -> tuple[Floats, Floats]:
    """Distances of the tangential and the sagittal image behind convex mirrors, mm, each (...).

    Coddington's equations for a mirror of curvature k = 1 / r (0 for planes), with distances s
    counted from the mirror, the object's before it and the image's behind it, and an incidence i
    (radians):

        1/t = 1/s + 2 k / cos i        1/s' = 1/s + 2 k cos i
    """
    cosine = np.cos(incidence)
    tangential: Floats = 1 / (1 / distance + 2 * curvature / cosine)
    sagittal: Floats = 1 / (1 / distance + 2 * curvature * cosine)
    return tangential, sagittal


def virtual_images(array: MirrorArray, radius: float) -> VirtualImages:
    """Images of a capture sphere of this radius (mm) in all mirrors of a camera."""
    mirrors, pinhole = array.mirrors, array.camera.pinhole
    toward = mirrors.apex - pinhole
    to_mirror, ray = norm(toward), unit(toward)
    incidence = np.arccos(np.clip(-dot(ray, mirrors.normal), -1, 1))
    objects = norm(mirrors.apex)[:, None] + radius * np.array([-1.0, 0.0, 1.0])
    image = image_distances(mirrors.curvature[:, None], incidence[:, None], objects)
    distance = to_mirror[:, None, None] + np.stack(image, axis=2)
    along = ray @ array.camera.forward
    return VirtualImages(array, to_mirror, incidence, distance, distance * along[:, None, None])


@dataclass(frozen=True)
class CameraRequirements:
    """What the camera and lens of either pinhole must do; a rectilinear lens is assumed."""

    hfov_deg: float  # angle of view across that just holds all mirrors
    vfov_deg: float  # angle of view down
    width_px: int  # pixels across it, at least
    height_px: int  # pixels down it, at least
    near_mm: float  # from the pupil along the axis to the nearest virtual image
    far_mm: float  # depth of the farthest
    focus_mm: float  # depth to focus on, where the blur at both ends is the same
    pupil_mm: float  # diameter of the entrance pupil with the least blur at both ends
    blur_px: float  # circle of confusion there at both ends, in pixels of this design
    airy_px: float  # diameter of the Airy disc there, 550 nm
    total_px: float  # root of the sum of both squares

    @property
    def depths(self) -> DepthRange:
        """Depths that are to be sharp together."""
        return DepthRange(self.near_mm, self.far_mm)

    @property
    def half_sizes(self) -> tuple[float, float]:
        """Half width and half height of the picture at unit distance."""
        return (
            math.tan(math.radians(self.hfov_deg) / 2),
            math.tan(math.radians(self.vfov_deg) / 2),
        )


def camera_requirements(array: MirrorArray, radius: float) -> CameraRequirements:
    """Requirements of camera a's array, or b's, for a capture sphere of this radius, mm."""
    view, depth = array.camera, virtual_images(array, radius).depth
    across, down = _half_sizes(array)
    over = DepthRange(float(depth.min()), float(depth.max()))
    lens = lens_for(view.hfov, view.width_px, 1.0, WIDE_OPEN)
    pupil = sharpest(lens, over)
    blur = aperture_stop(lens, over, pupil)
    return CameraRequirements(
        2 * math.degrees(math.atan(across)),
        2 * math.degrees(math.atan(down)),
        math.ceil(2 * across / view.pixel_pitch - ROUNDING_PX),
        math.ceil(2 * down / view.pixel_pitch - ROUNDING_PX),
        over.near,
        over.far,
        over.focus,
        pupil,
        blur["blur_px"],
        blur["airy_px"],
        blur["total_px"],
    )


def _half_sizes(array: MirrorArray) -> tuple[float, float]:
    """Half width and half height that the mirrors fill of a picture at unit distance.

    A frame that the spec sets smaller cuts off corners of mirrors that show none of the object.
    """
    view = array.camera
    image = (array.cells.corners - view.pinhole) @ view.axes.T
    filled = np.abs(image[:, :2] / image[:, 2:]).max(axis=0)
    across, down = np.minimum(filled, view.half_sizes)
    return float(across), float(down)


def exposure_seconds(f_number: float, magnification: float, lux: float, iso: float) -> float:
    """Time of exposure for a mid-grey object seen by reflection in the mirrors, s.

    t = pi K N'^2 / (E S rho R), with N' = N (1 + magnification) for the F-number N as engraved; E
    in lux on the object. The magnification is image distance over focal length, less 1.
    """
    working = f_number * (1 + magnification)
    light = lux * iso * OBJECT_REFLECTANCE * MIRROR_REFLECTANCE
    return math.pi * METER_CONSTANT * working**2 / light
