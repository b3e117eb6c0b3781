"""Derivatives of a machine's figures by its unknowns, and the figures' covariances by them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import norm
from tbcad.rig.calibration.estimate.parameters import Block, Of, Prior
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats, Ints

SMALL = 1e-6  # radians: below, series replace quotients


@dataclass(frozen=True)
class Slopes:
    """Derivatives of n groups of d figures by blocks of parameters."""

    of: Mapping[Of, Ints]  # numbers of the frame, sphere ... that each group is of, (n,)
    by: dict[Block, Floats]  # derivatives by the parameters that each block has of it, (n, d, c)

    def matrix(self, prior: Prior) -> csr_array:
        """Rows n * d, by free parameters in prior standard deviations."""
        value = np.concatenate([*self.by.values()], axis=2)
        n, d, c = value.shape
        number = {Of.MACHINE: np.zeros(n, dtype=np.int64), **self.of}
        columns = [prior.columns(block, number[block.of]) for block in self.by]
        column = np.repeat(np.concatenate(columns, axis=1)[:, None], d, axis=1)
        value = value * prior.flat_sigma[column]
        start = np.arange(n * d + 1) * c
        shape = (n * d, len(prior.flat_sigma))
        return csr_array((value.ravel(), column.ravel(), start), shape=shape)[:, prior.free]


def sphere_slopes(
    prior: Prior, values: Floats, machine: Machine, frame: Ints, sphere: Ints
) -> Slopes:
    """Derivatives of spheres' centres in frames, (n, 3), by what moves them."""
    angle, centre = machine.angle[frame], machine.centre[sphere]
    sag = np.zeros_like(centre) if prior.mean.sag is None else prior.mean.sag[frame, sphere]
    still = (
        machine.axis_point
        if machine.sag is None
        else (machine.axis_point - machine.sag[frame, sphere])
    )
    turned = rotated(centre - still, machine.axis, angle)
    turn = np.zeros_like(centre) if machine.turn is None else machine.turn[frame]
    wobble = Rotation.from_rotvec(turn)
    rotation = wobble.as_matrix() @ _matrices(machine.axis, angle)
    tilt = prior.tilt(values)
    on_base = rotation @ tilt.as_matrix()
    ways = np.broadcast_to(prior.ways.T, (len(centre), 3, 3))
    about = wobble.apply(np.cross(machine.axis, turned))[..., None]
    tilts = (left_jacobian(tilt.as_rotvec()) @ prior.across.T).T
    # A sphere c is tilted along, so of its arm only the axis's point and its sag are not.
    by_tilt = [
        wobble.apply(np.cross(one, turned)) + (rotation @ np.cross(one, still)[..., None])[..., 0]
        for one in tilts
    ]
    placed = wobble.apply(machine.axis_point + turned)
    turns = (left_jacobian(turn) @ prior.across.T).swapaxes(1, 2)
    by_power, arm = {}, prior.arms(values)[sphere]
    if prior.mean.forms is not None:
        outward = prior.cap_tilts(values).apply(prior.mean.forms.outward)
        back = -prior.radius_by_power(values)[sphere, None] * outward[sphere]
        by_power = {Block.POWER: on_base @ back[..., None]}
    swung = np.cross(cap_turns(prior, values)[sphere], arm[:, None]).swapaxes(1, 2)
    return Slopes(
        {Of.FRAME: frame, Of.SPHERE: sphere, Of.SERIES: prior.series[frame]},
        {
            Block.CARRIER: on_base @ np.concatenate([prior.seat[sphere, :, None], ways], axis=2),
            Block.CENTRES: on_base,
            Block.CAP_TILT: on_base @ swung,
            Block.TILT: np.stack(by_tilt, axis=2),
            Block.AXIS_POINT: (wobble.as_matrix() - rotation) @ prior.across.T,
            Block.OFFSET: about,
            Block.ANGLES: about,
            Block.TURN: np.cross(turns, placed[:, None]).swapaxes(1, 2),
            Block.SHIFT: ways,
            Block.SAG: (rotation @ sag[..., None]),
            **by_power,
        },
    )


def cap_turns(prior: Prior, values: Floats) -> Floats:
    """Small rotations of spheres about their seats by both of their tilts, (k, 2, 3)."""
    by = left_jacobian(prior.cap_tilts(values).as_rotvec())
    return np.asarray(prior.across_arms @ by.swapaxes(1, 2))


def turn_slopes(
    prior: Prior, values: Floats, machine: Machine, frame: Ints, sphere: Ints
) -> dict[Block, Floats]:
    """Small rotations of forms of spheres in frames, (n, 3, c), by what turns base and caps."""
    turn = np.zeros((len(frame), 3)) if machine.turn is None else machine.turn[frame]
    wobble = Rotation.from_rotvec(turn).as_matrix()
    tilts = left_jacobian(prior.tilt(values).as_rotvec()) @ prior.across.T
    about = wobble @ machine.axis[:, None]
    rotation = wobble @ _matrices(machine.axis, machine.angle[frame])
    seat = rotation @ machine.seat_turns(frame, sphere).as_matrix()
    on_base, mean = seat @ prior.tilt(values).as_matrix(), prior.mean.seat_turn
    by_sag = np.zeros((len(frame), 3)) if mean is None else mean[frame, sphere]
    # A seat's turn is not tilted along with the base.
    return {
        Block.CAP_TILT: on_base @ cap_turns(prior, values)[sphere].swapaxes(1, 2),
        Block.TILT: wobble @ tilts + (seat - rotation) @ tilts,
        Block.SAG: rotation @ by_sag[..., None],
        Block.OFFSET: about,
        Block.ANGLES: about,
        Block.TURN: left_jacobian(turn) @ prior.across.T,
    }


def camera_turns(prior: Prior, values: Floats) -> tuple[Floats, Floats]:
    """Small rotations of what the camera sees, by its turn, (3, 3), and principal point, (3, 2)."""
    turn = prior.blocks(values)[Block.CAMERA_TURN]
    aim = left_jacobian(prior.aim(values)) @ prior.by_principal
    return left_jacobian(turn), Rotation.from_rotvec(turn).as_matrix() @ aim


def base_slopes(prior: Prior, values: Floats) -> Slopes:
    """Derivatives of spheres' centres at base angle zero and radii, (k, 4), by what moves them."""
    machine = prior.machine(values)
    still = replace(machine, angle=0 * machine.angle, turn=None, sag=None)
    every = np.arange(len(machine.radius))
    moved = sphere_slopes(prior, values, still, 0 * every, every)
    by: dict[Block, Floats] = {
        block: np.pad(moved.by[block], ((0, 0), (0, 1), (0, 0)))
        for block in (Block.CENTRES, Block.CARRIER, Block.TILT, Block.CAP_TILT, Block.POWER)
        if block in moved.by
    }
    if Block.POWER in by:
        by[Block.POWER][:, 3, 0] = prior.radius_by_power(values)
    by[Block.RADII] = np.broadcast_to(np.eye(4)[:, 3:], (len(every), 4, 1))
    return Slopes(moved.of, by)


def _matrices(axis: Floats, angle: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) about an axis (3,) by angles (n,)."""
    columns = [rotated(np.broadcast_to(one, (len(angle), 3)), axis, angle) for one in np.eye(3)]
    return np.stack(columns, axis=2)


def left_jacobian(turn: Floats) -> Floats:
    """Small rotations by which exp(turn) changes, by turns (..., 3), (..., 3, 3).

    Sola et al. 2018, eq. 145.
    """
    angle = norm(turn)[..., None, None]
    skew = np.cross(np.eye(3), turn[..., None, :])
    some = np.where(angle < SMALL, 1.0, angle)
    second = np.where(angle < SMALL, 0.5, (1 - np.cos(some)) / some**2)
    third = np.where(angle < SMALL, 1 / 6, (some - np.sin(some)) / some**3)
    return np.asarray(np.eye(3) + second * skew + third * skew @ skew)


def covariances(covariance: Floats, slopes: csr_array, size: int) -> Floats:
    """Covariance of n groups of figures, in the square of their unit, (n, size, size).

    By that of the parameters (q, q) and the figures' derivatives by them, (n * size, q), group by
    group.
    """
    spread = slopes @ covariance
    groups = [(slopes[row::size], spread[row::size]) for row in range(size)]
    rows = [[one.multiply(to).sum(axis=1) for one, _ in groups] for _, to in groups]
    return np.asarray(rows).transpose(2, 0, 1)
