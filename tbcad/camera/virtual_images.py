"""The virtual images of the object in the mirrors, at oblique incidence."""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import dot, norm, unit
from tbcad.mirrors.array import MirrorArray
from tbcad.types import Floats

PLACES = ("nearest", "centre", "farthest")
FANS = ("tangential", "sagittal")


@dataclass(frozen=True)
class VirtualImages:
    """Images of the object on the mirrors' principal rays, over m mirrors.

    A principal ray runs from the camera over the apex to the centre of the capture sphere.

    Attributes:
        array: the camera and its mirrors.
        to_mirror: from camera to apex, mm, (m,).
        incidence: at the apex, radians, (m,).
        distance: from camera to the image of the sphere's nearest point, centre and farthest
            point, by the tangential and by the sagittal fan, mm, (m, 3, 2).
        depth: the same along the camera's optical axis, mm, (m, 3, 2).
    """

    array: MirrorArray
    to_mirror: Floats
    incidence: Floats
    distance: Floats
    depth: Floats


def image_distances(
    curvature: Floats, incidence: Floats, distance: Floats
) -> tuple[Floats, Floats]:
    """Distances of the tangential and the sagittal image behind convex mirrors, mm, each (...).

    Coddington's equations for a mirror of curvature k = 1 / r, with distances counted from the
    mirror, the object's before it and the image's behind it:

        1/t = 1/s + 2 k / cos i        1/s' = 1/s + 2 k cos i

    Args:
        curvature: 1/mm, 0 for planes, (...).
        incidence: radians, (...).
        distance: of the object s, mm, (...).
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
