"""Highlights of a machine and their sparse derivatives by its free parameters.

The point of reflection on a sphere is P = c + r n, where the unit normal n bisects the unit vectors
a and b toward light and pinhole: the part of a + b square to n is zero. Differentiated implicitly,
with A = (1 - a a^T) / |L - P|, B = (1 - b b^T) / |O - P|, T = 1 - n n^T and g = n . (a + b),

    (r T (A + B) T + g) dn = T (A dL + B dO - (A + B) (dc + n dr)).
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import dot, norm, unit
from tbcad.core.optics.camera import LensCamera, distorted
from tbcad.core.optics.reflection import reflection_points
from tbcad.rig.calibration.estimate.parameters import Block, Prior
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats, Ints

ITERATIONS = 60
CONVERGED = 1e-14  # radians, of the normal
MAX_STEP = 0.5  # radians
# From the bisector at the centre Newton's steps go astray on one large sphere in 2,000.
START_ITERATIONS = 4
LENS = 9  # focal lengths 2, principal point 2, distortion 5
SMALL = 1e-6  # radians: below, series replace quotients


@dataclass(frozen=True)
class Reflections:
    """Points of reflection of n highlights, with their derivatives, rows by columns."""

    point: Floats  # mm, (n, 3)
    by_centre: Floats  # (n, 3, 3)
    by_radius: Floats  # (n, 3)
    by_light: Floats  # (n, 3, 3)
    by_pinhole: Floats  # (n, 3, 3)


def reflections(centre: Floats, radius: Floats, light: Floats, pinhole: Floats) -> Reflections:
    """Where spheres (n,) show lights (n, 3) to a pinhole (3,), all in mm."""
    start = reflection_points(centre, radius, light, pinhole, START_ITERATIONS)
    normal = unit(start - centre)
    for _ in range(ITERATIONS):
        _, turned, residual = _law(centre, radius, light, pinhole, normal)
        step: Floats = np.linalg.solve(turned, residual[..., None])[..., 0].astype(np.float64)
        length = norm(step)
        normal = unit(
            normal + step * np.minimum(1, MAX_STEP / np.maximum(length, MAX_STEP))[:, None]
        )
        if length.max(initial=0) < CONVERGED:
            break
    return _differentiated(centre, radius, light, pinhole, normal)


def _law(
    centre: Floats, radius: Floats, light: Floats, pinhole: Floats, normal: Floats
) -> tuple[tuple[Floats, Floats], Floats, Floats]:
    """A and B, the matrix before dn, and by how much the law is missed, (n, 3)."""
    point = centre + radius[:, None] * normal
    bends, total = [], np.zeros_like(point)
    for end in (light, pinhole):
        way = end - point
        length = norm(way)[:, None]
        direction = way / length
        total = total + direction
        bends.append((np.eye(3) - direction[:, :, None] * direction[:, None]) / length[..., None])
    across = np.eye(3) - normal[:, :, None] * normal[:, None]
    along = dot(normal, total)[:, None, None]
    turned = radius[:, None, None] * across @ (bends[0] + bends[1]) @ across + along * np.eye(3)
    return (bends[0], bends[1]), turned, (across @ total[..., None])[..., 0]


def _differentiated(
    centre: Floats, radius: Floats, light: Floats, pinhole: Floats, normal: Floats
) -> Reflections:
    (by_light, by_pinhole), turned, _ = _law(centre, radius, light, pinhole, normal)
    across = np.eye(3) - normal[:, :, None] * normal[:, None]
    moved = radius[:, None, None] * np.linalg.solve(turned, across)
    with_point = np.eye(3) - moved @ (by_light + by_pinhole)
    return Reflections(
        point=centre + radius[:, None] * normal,
        by_centre=with_point,
        by_radius=(with_point @ normal[..., None])[..., 0],
        by_light=moved @ by_light,
        by_pinhole=moved @ by_pinhole,
    )


def projection(camera: LensCamera, image: Floats) -> tuple[Floats, Floats, Floats]:
    """Pixels (n, 2) of points (n, 3), mm, in the frame of a camera whose pose does not matter.

    With their derivatives by the point (n, 2, 3) and by the lens (n, 2, LENS).
    """
    place = image[:, :2] / image[:, 2:]
    shown = distorted(place, camera.distortion)
    by_place, by_distortion = _distortion_slopes(place, camera.distortion)
    by_point = np.empty((len(image), 2, 3))
    by_point[:, :, :2] = by_place / image[:, 2, None, None]
    by_point[:, :, 2] = -(by_place @ place[..., None])[..., 0] / image[:, 2, None]
    by_lens = np.zeros((len(image), 2, LENS))
    for row in (0, 1):
        by_lens[:, row, row] = shown[:, row]
        by_lens[:, row, 2 + row] = 1
    by_lens[:, :, 4:] = camera.focal[:, None] * by_distortion
    pixel = shown * camera.focal + camera.principal
    return np.asarray(pixel), camera.focal[:, None] * by_point, by_lens


def _distortion_slopes(place: Floats, coefficients: Floats) -> tuple[Floats, Floats]:
    """Of tbcad.core.optics.camera.distorted by the place (n, 2, 2), by k1 k2 p1 p2 k3 (n, 2, 5)."""
    k1, k2, p1, p2, k3 = coefficients
    x, y = place.T
    s = x * x + y * y
    radial = 1 + s * (k1 + s * (k2 + s * k3))
    slope = 2 * (k1 + s * (2 * k2 + s * 3 * k3))
    cross = x * y * slope + 2 * p1 * x + 2 * p2 * y
    by_place = np.stack(
        [
            np.stack([radial + x * x * slope + 2 * p1 * y + 6 * p2 * x, cross], axis=-1),
            np.stack([cross, radial + y * y * slope + 6 * p1 * y + 2 * p2 * x], axis=-1),
        ],
        axis=1,
    )
    by_coefficients = np.stack(
        [
            np.stack([x * s, x * s**2, 2 * x * y, s + 2 * x * x, x * s**3], axis=-1),
            np.stack([y * s, y * s**2, s + 2 * y * y, 2 * x * y, y * s**3], axis=-1),
        ],
        axis=1,
    )
    return by_place, by_coefficients


@dataclass(frozen=True)
class Slopes:
    """Derivatives of figures (n, d) by groups of parameters."""

    columns: tuple[Ints, ...]  # numbers of the parameters, one array (n, c) or (c,) for each group
    values: tuple[Floats, ...]  # derivatives, one array (n, d, c) for each group

    def matrix(self, prior: Prior) -> csr_array:
        """Rows n * d, by free parameters in prior standard deviations."""
        n, d = self.values[0].shape[:2]
        wide = [np.broadcast_to(c, (n, c.shape[-1])) for c in self.columns]
        column = np.repeat(np.concatenate(wide, axis=1)[:, None], d, axis=1)
        value = np.concatenate(self.values, axis=2) * prior.flat_sigma[column]
        start = np.arange(n * d + 1) * value.shape[2]
        shape = (n * d, len(prior.flat_sigma))
        return csr_array((value.ravel(), column.ravel(), start), shape=shape)[:, prior.free]


def highlights_with_slopes(
    prior: Prior, values: Floats, frame: Ints, sphere: Ints, led: Ints
) -> tuple[Floats, csr_array]:
    """Columns and rows (n, 2) of highlights (n,), and derivatives by values (q,), (2 n, q)."""
    machine = prior.machine(values)
    image = light_images(prior, values, machine, frame, sphere, machine.leds[led])
    slopes = Slopes(
        columns=(prior.first[Block.LEDS] + 3 * led[:, None] + np.arange(3), *image.slopes.columns),
        values=(image.by_light, *image.slopes.values),
    )
    return image.pixel, slopes.matrix(prior)


@dataclass(frozen=True)
class LightImages:
    """Where spheres show lights."""

    pixel: Floats  # column and row, (n, 2)
    by_light: Floats  # derivatives by the light's place, px/mm, (n, 2, 3)
    slopes: Slopes  # derivatives by all parameters but the LEDs


def light_images(
    prior: Prior, values: Floats, machine: Machine, frame: Ints, sphere: Ints, light: Floats
) -> LightImages:
    """Where spheres (n,) show lights (n, 3) in frames (n,) of the machine of these values."""
    camera = machine.camera
    centre = machine.centres(frame, sphere)
    seen = reflections(centre, machine.radius[sphere], light, camera.pinhole)
    image = (seen.point - camera.pinhole) @ camera.axes.T
    pixel, by_image, by_lens = projection(camera, image)
    by_point = by_image @ camera.axes
    moved = sphere_slopes(prior, values, machine, frame, sphere)
    columns = (*camera_columns(prior), prior.first[Block.RADII] + sphere[:, None], *moved.columns)
    turned = _left_jacobian(prior.blocks(values)[Block.CAMERA_TURN]).T[None]
    by_logarithm, (x, y) = np.eye(LENS), camera.focal  # of the focal lengths
    by_logarithm[:2, :2] = [[x, x / 2], [y, -y / 2]]
    derivatives = (
        by_image @ np.cross(turned, image[:, None]).swapaxes(1, 2),
        by_point @ (seen.by_pinhole - np.eye(3)),
        by_lens @ by_logarithm,
        by_point @ seen.by_radius[..., None],
        *(by_point @ seen.by_centre @ value for value in moved.values),
    )
    return LightImages(pixel, by_point @ seen.by_light, Slopes(columns, derivatives))


def camera_columns(prior: Prior) -> tuple[Ints, Ints, Ints]:
    """Numbers of the parameters of the camera's rotation, place and lens."""
    lens = [(Block.FOCAL, 2), (Block.PRINCIPAL, 2), (Block.DISTORTION, 5)]
    return (
        prior.first[Block.CAMERA_TURN] + np.arange(3),
        prior.first[Block.PINHOLE] + np.arange(3),
        np.concatenate([prior.first[block] + np.arange(size) for block, size in lens]),
    )


def sphere_slopes(
    prior: Prior, values: Floats, machine: Machine, frame: Ints, sphere: Ints
) -> Slopes:
    """Derivatives of spheres' centres in frames, (n, 3), by what moves them."""
    angle, first = machine.angle[frame], prior.first
    arm = machine.centre[sphere] - machine.axis_point
    turned = rotated(arm, machine.axis, angle)
    rotation = _matrices(machine.axis, angle)
    tilt = prior.tilt(values)
    on_base = rotation @ tilt.as_matrix()
    along = np.broadcast_to(prior.mean.axis, arm.shape)
    carried = np.stack([prior.mean.centre[sphere], along], axis=2)
    about = np.cross(machine.axis, turned)[..., None]
    tilts = (_left_jacobian(tilt.as_rotvec()) @ prior.across.T).T
    # A sphere c is tilted along, so of its arm c - p only the axis's point p is not.
    by_tilt = [
        np.cross(one, turned) + (rotation @ np.cross(one, machine.axis_point)) for one in tilts
    ]
    return Slopes(
        columns=(
            first[Block.CARRIER] + np.arange(2),
            first[Block.CENTRES] + 3 * sphere[:, None] + np.arange(3),
            first[Block.TILT] + np.arange(2),
            first[Block.AXIS_POINT] + np.arange(2),
            first[Block.OFFSET] + prior.series[frame][:, None],
            first[Block.ANGLES] + frame[:, None],
            first[Block.RUNOUT] + 2 * frame[:, None] + np.arange(2),
        ),
        values=(
            on_base @ carried,
            on_base,
            np.stack(by_tilt, axis=2),
            (np.eye(3) - rotation) @ prior.across.T,
            about,
            about,
            np.broadcast_to(prior.across.T, (len(frame), 3, 2)),
        ),
    )


def base_slopes(prior: Prior, values: Floats) -> Slopes:
    """Derivatives of spheres' centres at base angle zero and radii, (k, 4), by what moves them."""
    tilt = prior.tilt(values)
    centre, mean = prior.machine(values).centre, prior.mean
    every = np.arange(len(centre))
    carried = np.stack([mean.centre, np.broadcast_to(mean.axis, centre.shape)], axis=2)
    tilts = (_left_jacobian(tilt.as_rotvec()) @ prior.across.T).T
    of_centres = (
        np.broadcast_to(tilt.as_matrix(), (len(centre), 3, 3)),
        tilt.as_matrix() @ carried,
        np.stack([np.cross(one, centre) for one in tilts], axis=2),
    )
    radius = np.zeros((len(centre), 4, 1))
    radius[:, 3] = 1
    return Slopes(
        columns=(
            prior.first[Block.CENTRES] + 3 * every[:, None] + np.arange(3),
            prior.first[Block.CARRIER] + np.arange(2),
            prior.first[Block.TILT] + np.arange(2),
            prior.first[Block.RADII] + every[:, None],
        ),
        values=(*(np.pad(one, ((0, 0), (0, 1), (0, 0))) for one in of_centres), radius),
    )


def _matrices(axis: Floats, angle: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) about an axis (3,) by angles (n,)."""
    columns = [rotated(np.broadcast_to(one, (len(angle), 3)), axis, angle) for one in np.eye(3)]
    return np.stack(columns, axis=2)


def _left_jacobian(turn: Floats) -> Floats:
    """Small rotation by which exp(turn) changes, by turn, (3, 3) (Sola et al. 2018, eq. 145)."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    if angle < SMALL:
        return np.eye(3) + skew / 2
    second = (1 - np.cos(angle)) / angle**2
    third = (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + second * skew + third * skew @ skew)
