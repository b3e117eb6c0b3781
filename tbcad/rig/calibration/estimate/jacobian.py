"""Highlights of a machine and their sparse derivatives by its free parameters."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from tbcad.core.geometry.rotations import rotated
from tbcad.rig.calibration.estimate.parameters import Block, Prior
from tbcad.rig.calibration.estimate.reflection import LENS, projection, reflections
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats, Ints

SMALL = 1e-6  # radians: below, series replace quotients


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
