"""How well a calibrated machine knows its rays at the object.

A pixel that shows the object's centre by a sphere stays where it is, and the machine's errors move
the ray behind it. Light can go both ways: the ray is where a light is shown at that pixel. A light
at x in the plane through the centre, square to the ray, is shown at h(x, state), so

    dh/dx dx + dh/dstate dstate = 0

gives how the ray moves in that plane. The same for a second plane gives how it turns. This needs no
single centre of projection, which this camera does not have.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from tbcad.core.geometry.vectors import perpendicular_axes, unit
from tbcad.core.optics.reflection import reflected_rays
from tbcad.light.simulate.prototype.run import HALF_TURN
from tbcad.rig.calibration.estimate.jacobian import light_images, reflections
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.estimate.slopes import covariances
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats, Ints

SPHERE_MM = 30.0
"""Radius within which rays are to be known: there a rotation counts as much as a shift."""
FIGURES, PLACES = 4, 2  # of a ray: two of its place, two of its direction
APART_MM = 10.0  # of both planes: lines are straight, so any distance gives the same


@dataclass(frozen=True)
class RayCovariance:
    """Of m rays, from the sphere to the object."""

    # of the place in the plane through the object's centre along two directions, mm, and of the
    # rotation toward these, radians, (m, 4, 4)
    covariance: Floats

    @property
    def place_mm(self) -> Floats:
        """Root mean square distance at the object's centre, mm, (m,)."""
        return _root(self.covariance[:, :2, :2])

    @property
    def turn_mrad(self) -> Floats:
        """Root mean square angle between the ray and the true one, mrad, (m,)."""
        return 1000 * _root(self.covariance[:, 2:, 2:])


@dataclass(frozen=True)
class RayUncertainty:
    """Of the rays that show the object's centre, over m of them."""

    frame: Ints  # in which each is photographed, (m,)
    sphere: Ints  # that shows it, (m,)
    direction: Floats  # unit vectors from the sphere toward the object, (m, 3)
    whole: RayCovariance  # in the frame of the design
    relative: RayCovariance  # besides what a motion of the whole machine would do
    # besides a motion of its own in each run: what the rays of one run know of each other, wherever
    # the axis of the object's half turn is
    in_run: RayCovariance
    pixel_mm: Floats  # width of a pixel of the photograph at the object's centre, mm, (m,)


def known_rays(
    prior: Prior, values: Floats, known: Floats, frame: Ints, sphere: Ints
) -> RayUncertainty:
    """Covariance of rays (m,) of a machine whose free parameters have a covariance, (q, q)."""
    slopes, direction = ray_slopes(prior, values, frame, sphere)
    of_all, of_each = shared_motions(prior, frame, direction)
    every = covariances(known, slopes, FIGURES)
    return RayUncertainty(
        frame=frame,
        sphere=sphere,
        direction=direction,
        whole=RayCovariance(every),
        relative=RayCovariance(besides_motions(known, slopes, of_all, every)),
        in_run=RayCovariance(besides_motions(known, slopes, of_each, every)),
        pixel_mm=pixel_widths(prior, values, frame, sphere),
    )


def besides_motions(
    known: Floats, slopes: csr_array, motions: Floats, covariance: Floats
) -> Floats:
    """Covariance (m, 4, 4) of rays less the motion that fits all of them best.

    A machine that is shifted and rotated as a whole, with its object, gives the same light field.
    With S the rays' derivatives (4 m, q), M the motions (4 m, c) and F what fits them to S, this is
    the covariance by S - M F, without a matrix as large as that.
    """
    fitted = motion_fit(motions) @ slopes
    spread = known @ fitted.T
    by_ray = motions.reshape(len(covariance), FIGURES, -1)
    across = by_ray.swapaxes(1, 2)
    shared = (slopes @ spread).reshape(by_ray.shape) @ across
    own = by_ray @ (fitted @ spread) @ across
    return np.asarray(covariance - shared - shared.swapaxes(1, 2) + own)


def motion_fit(motions: Floats) -> Floats:
    """Matrix that gives the motion (c,) that fits n errors of rays (4 m,) best, (c, 4 m).

    A rotation counts by what it does at the edge of the object's room.
    """
    weight = np.tile([1.0, 1.0, SPHERE_MM**2, SPHERE_MM**2], len(motions) // FIGURES)
    weighted = (weight[:, None] * motions).T
    return np.asarray(np.linalg.pinv(weighted @ motions) @ weighted)


def shared_motions(prior: Prior, frame: Ints, direction: Floats) -> tuple[Floats, Floats]:
    """Motions of the object to rays in frames (m,) of directions (m, 3): (4 m, 6) and (4 m, 12).

    First of both runs together, the object turned between them; then of each run by itself.
    """
    turned = prior.series[frame] > 0
    motions = rigid_motions(direction, np.where(turned[:, None], HALF_TURN, np.ones(3)))
    of_run = np.repeat(np.stack([~turned, turned], axis=1), FIGURES, axis=0)
    return motions, np.concatenate([motions * of_run[:, [run]] for run in (0, 1)], axis=1)


def rigid_motions(direction: Floats, flip: Floats) -> Floats:
    """Rays through the origin under shifts (mm) and rotations (rad) of the object, (4 m, 6).

    Directions (m, 3) are in the machine's frame; factors (m, 3) turn vectors from there into the
    frame of the object, which is turned by half a turn in the second series when the machine is
    not.
    """
    across = perpendicular_axes(direction)
    result = np.zeros((len(direction), 4, 6))
    result[:, :2, :3] = across * flip[:, None]
    result[:, 2:, 3:] = np.cross(direction[:, None], across) * flip[:, None]
    return result.reshape(-1, 6)


def pixel_widths(prior: Prior, values: Floats, frame: Ints, sphere: Ints) -> Floats:
    """Root of the area that a pixel sees at the object's centre, square to its ray, mm, (m,)."""
    machine = prior.machine(values)
    across = perpendicular_axes(ray_directions(machine, frame, sphere))
    light = np.zeros((len(frame), 3))
    image = light_images(prior, values, machine, frame, sphere, light)
    area = np.abs(np.linalg.det(image.by_light @ across.swapaxes(1, 2)))
    return np.asarray(area**-0.5)


def ray_slopes(prior: Prior, values: Floats, frame: Ints, sphere: Ints) -> tuple[csr_array, Floats]:
    """Derivatives of rays by a machine's parameters, (4 m, q), and their directions, (m, 3).

    Rows by ray: place along two directions, mm, rotation toward them, radians. Directions
    are unit vectors toward the object.
    """
    machine = prior.machine(values)
    direction = ray_directions(machine, frame, sphere)
    across = perpendicular_axes(direction)
    images = [
        light_images(prior, values, machine, frame, sphere, distance * direction)
        for distance in (0.0, APART_MM)
    ]
    near, far = (
        {
            block: -np.linalg.solve(one.by_light @ across.swapaxes(1, 2), value)
            for block, value in one.slopes.by.items()
        }
        for one in images
    )
    rows = {
        block: np.concatenate([place, (far[block] - place) / APART_MM], axis=1)
        for block, place in near.items()
    }
    return replace(images[0].slopes, by=rows).matrix(prior), direction


def ray_directions(machine: Machine, frame: Ints, sphere: Ints) -> Floats:
    """Unit vectors (m, 3) of the rays from spheres in frames to the object's centre."""
    light, radius, pinhole = (
        np.zeros((len(frame), 3)),
        machine.radius[sphere],
        machine.camera.pinhole,
    )
    centre = machine.reflecting_centres(frame, sphere, light)
    point = reflections(centre, radius, light, pinhole).point
    return reflected_rays(pinhole, point, unit(point - centre))


def _root(covariance_of_two: Floats) -> Floats:
    # What a motion fits wholly, as of the rays of one stop, is zero but for rounding.
    return np.asarray(np.sqrt(np.maximum(np.trace(covariance_of_two, axis1=1, axis2=2), 0)))
