"""What LEDs tell of each sphere alone, all else known: the bound of Cramer and Rao.

A sphere's centre and radius are four unknowns, and each LED that it shows gives two figures: two
LEDs fix them, and the prior of the process helps. This is the bound for a shell whose camera is
known, and for the balls of a prototype at one stop.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.calibration.estimate.reflection import projection, reflections
from tbcad.geometry.vectors import perpendicular_axes, unit
from tbcad.optics.lens_camera import LensCamera
from tbcad.optics.reflection import reflected_rays
from tbcad.types import Bools, Floats

APART_MM = 10.0  # of the planes in which a ray is followed; lines are straight


@dataclass(frozen=True)
class SphereInformation:
    """Of m spheres, centre x, y, z and radius.

    Attributes:
        by_led: of one highlight of each of l LEDs with noise of one pixel, 1/mm^2, (l, m, 4, 4);
            zero where the LED is not seen.
        rays: derivatives of the rays to the object's centre: place along two directions, mm, and
            rotation, radians, (m, 4, 4).
    """

    by_led: Floats
    rays: Floats


def sphere_information(
    camera: LensCamera, centre: Floats, radius: Floats, leds: Floats, seen: Bools
) -> SphereInformation:
    """What highlights of LEDs (l, 3) tell of spheres (m,), where seen, (m, l); in mm."""
    slopes = [
        _slopes(camera, centre, radius, np.broadcast_to(led, centre.shape))[0] for led in leds
    ]
    weight = seen.T[:, :, None, None]
    by_led = np.stack([one.swapaxes(1, 2) @ one for one in slopes]) * weight
    return SphereInformation(by_led, _ray_slopes(camera, centre, radius))


def ray_errors(
    information: SphereInformation,
    chosen: list[int],
    noise_px: float,
    sigma: tuple[float, float],
    photographs: int = 1,
) -> tuple[Floats, Floats]:
    """Root mean square errors of rays at the object's centre, mm, and of directions, mrad, (m,).

    Args:
        information: of spheres.
        chosen: numbers of the LEDs.
        noise_px: standard deviation of each figure of a highlight.
        sigma: prior standard deviations of centre and radius, mm; infinite for none, 0 for known.
        photographs: in which each LED is measured.
    """
    data = information.by_led[chosen].sum(axis=0) * photographs / noise_px**2
    known = np.array([sigma[0]] * 3 + [sigma[1]])
    free = known > 0
    prior = np.diag(1 / known[free] ** 2)
    inverse = np.linalg.pinv(data[:, free][:, :, free] + prior, hermitian=True)
    slopes = information.rays[:, :, free]
    spread = np.diagonal(slopes @ inverse @ slopes.swapaxes(1, 2), axis1=1, axis2=2)
    return np.sqrt(spread[:, :2].sum(axis=1)), 1000 * np.sqrt(spread[:, 2:].sum(axis=1))


def _slopes(
    camera: LensCamera, centre: Floats, radius: Floats, light: Floats
) -> tuple[Floats, Floats]:
    """Of columns and rows by centre and radius (m, 2, 4), and by the light's place (m, 2, 3)."""
    image = reflections(centre, radius, light, camera.pinhole)
    _, by_image, _ = projection(camera, (image.point - camera.pinhole) @ camera.axes.T)
    by_point = by_image @ camera.axes
    of_sphere = np.concatenate([image.by_centre, image.by_radius[..., None]], axis=2)
    return by_point @ of_sphere, by_point @ image.by_light


def _ray_slopes(camera: LensCamera, centre: Floats, radius: Floats) -> Floats:
    """See tbcad.calibration.uncertainty: the ray is where lights appear at the same pixel."""
    origin = np.zeros_like(centre)
    point = reflections(centre, radius, origin, camera.pinhole).point
    direction = reflected_rays(camera.pinhole, point, unit(point - centre))
    across = perpendicular_axes(direction).swapaxes(1, 2)
    places = []
    for distance in (0.0, APART_MM):
        by_sphere, by_light = _slopes(camera, centre, radius, distance * direction)
        places.append(-np.linalg.solve(by_light @ across, by_sphere))
    near, far = places
    return np.concatenate([near, (far - near) / APART_MM], axis=1)
