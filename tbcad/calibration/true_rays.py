"""How far the rays of a calibrated machine are from those of the machine that it is.

Only of a simulated run is that machine known.
"""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.calibration.estimate.solve import Estimate
from tbcad.calibration.uncertainty import FIGURES, motion_fit, shared_motions
from tbcad.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.machine.machine import Machine
from tbcad.optics.reflection import reflected_rays
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class RayErrors:
    """Errors of m rays that show the object's centre: place in mm, direction in radians.

    Attributes:
        whole: in the frame of the design, (m, 4).
        relative: besides the motion of all rays that fits them best, (m, 4).
        in_run: besides such a motion in each run, (m, 4).
    """

    whole: Floats
    relative: Floats
    in_run: Floats


def place_mm(errors: Floats) -> Floats:
    """Distances at the object's centre of errors (m, 4), mm, (m,)."""
    return norm(errors[:, :2])


def turn_mrad(errors: Floats) -> Floats:
    """Angles of errors (m, 4), mrad, (m,)."""
    return 1000 * norm(errors[:, 2:])


def ray_errors(found: Estimate, truth: Machine, frame: Ints, sphere: Ints) -> RayErrors:
    """Errors of rays of spheres (m,) in frames (m,), through the pixels that show the centre."""
    machine = found.machine
    pixel = centre_pixels(machine, frame, sphere)
    _, direction = traced(machine, pixel, frame, sphere)
    start, true_direction = traced(truth, pixel, frame, sphere)
    across = perpendicular_axes(direction)
    away = at_plane(start, true_direction, direction), true_direction - direction
    errors = np.concatenate([(across @ one[..., None])[..., 0] for one in away], axis=1).ravel()
    besides = [
        errors - motions @ (motion_fit(motions) @ errors)
        for motions in shared_motions(found.prior, frame, direction)
    ]
    return RayErrors(*(one.reshape(-1, FIGURES) for one in (errors, *besides)))


def traced(machine: Machine, pixel: Floats, frame: Ints, sphere: Ints) -> tuple[Floats, Floats]:
    """Points (m, 3) on spheres, and unit directions (m, 3) after them, of rays through pixels."""
    camera = machine.camera
    ray = camera.directions(pixel)
    centre, radius = machine.centres(frame, sphere), machine.radius[sphere]
    offset = centre - camera.pinhole
    along = dot(ray, offset)
    inside = radius**2 - dot(offset, offset) + along**2
    point = camera.pinhole + (along - np.sqrt(inside))[:, None] * ray
    return point, reflected_rays(camera.pinhole, point, unit(point - centre))


def centre_pixels(machine: Machine, frame: Ints, sphere: Ints) -> Floats:
    """Pixels (m, 2) that show the object's centre."""
    lit = replace(machine, leds=np.zeros((1, 3)))
    return lit.highlights(frame, sphere, np.zeros_like(frame))


def at_plane(point: Floats, direction: Floats, normal: Floats) -> Floats:
    """Where lines meet planes through the origin, (m, 3)."""
    return np.asarray(point - (dot(point, normal) / dot(direction, normal))[:, None] * direction)
