"""The unknowns of a machine as one vector, in units of their prior standard deviations.

Zero is the prior mean. Blocks follow each other in the order of Block; what is fixed has no place
in the vector. A new block is a member of Block, what it does in `Prior.machine`, the derivative
of that in `slopes.sphere_slopes`, and its standard deviation in tbcad.rig.calibration.priors.

Gauge: photographs do not change when camera, axis, spheres and LEDs are moved or rotated together,
when all lengths grow, when the base's angles are offset and the spheres rotated back, when the
point of the axis slides along it, or when a turn or a shift is common to all frames. The prior
alone fixes these; the point slides not at all.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.vectors import norm, perpendicular_axes, unit
from tbcad.core.optics.sphere_forms import TERM_COUNT, power_slope, powered_radius
from tbcad.rig.machine.machine import Machine
from tbcad.types import Bools, Floats, Ints


class Of(StrEnum):
    """Owners of a block's parameters, which repeat for each."""

    MACHINE = "machine"
    SERIES = "series"
    LED = "led"
    SPHERE = "sphere"
    FRAME = "frame"


class Block(StrEnum):
    """Blocks of the vector, in their order, each with what it is of and its size for each."""

    of: Of
    size: int

    def __new__(cls, name: str, of: Of, size: int) -> "Block":
        """Keep both beside the name."""
        block = str.__new__(cls, name)
        block._value_, block.of, block.size = name, of, size
        return block

    CAMERA_TURN = "camera_turn", Of.MACHINE, 3  # about the camera's own axes, radians
    PINHOLE = "pinhole", Of.MACHINE, 3  # mm
    FOCAL = "focal", Of.MACHINE, 2  # logarithm of both, and of columns over rows
    PRINCIPAL = "principal", Of.MACHINE, 2  # pixels
    DISTORTION = "distortion", Of.MACHINE, 5
    # About two directions across the axis, through the origin and with all spheres, radians.
    TILT = "axis_tilt", Of.MACHINE, 2
    AXIS_POINT = "axis_point", Of.MACHINE, 2  # along both, mm
    OFFSET = "angle_offset", Of.SERIES, 1  # radians
    # Growth of the seats' places about the origin, as a share; shift of all along two directions
    # across the axis and along it, mm.
    CARRIER = "carrier", Of.MACHINE, 4
    LEDS = "leds", Of.LED, 3  # mm
    CENTRES = "centres", Of.SPHERE, 3  # of the seats, with their spheres, mm
    RADII = "radii", Of.SPHERE, 1  # mm
    ANGLES = "angles", Of.FRAME, 1  # radians
    # Of the base beside its angle, about two directions across the axis through the origin,
    # radians; then a shift along these and along the axis, mm.
    TURN = "turn", Of.FRAME, 2
    SHIFT = "shift", Of.FRAME, 3
    # By which the spheres' sag and their seats' turns are larger than the mean's, as a share.
    SAG = "sag", Of.MACHINE, 1
    # Of caps: tilts in their seats about two directions across their arms, radians, which take
    # spheres and forms along; by which sagittas are larger over the part in use, the apex where it
    # is, mm; and the terms of their forms (tbcad.core.optics.sphere_forms), mm.
    CAP_TILT = "cap_tilts", Of.SPHERE, 2
    POWER = "cap_powers", Of.SPHERE, 1
    FORM = "cap_forms", Of.SPHERE, TERM_COUNT


@dataclass(frozen=True)
class Prior:
    """Prior of a machine: means and standard deviations."""

    mean: Machine
    # number of the series that each frame belongs to, each with an offset of its angles of its own,
    # (f,)
    series: Ints
    seat: Floats  # centres of the bodies in the seats, which caps tilt about, mm, (k, 3)
    # standard deviations of all blocks, of r series, l LEDs, k spheres or f frames such as (k, 3),
    # of one figure each (k,); zero fixes
    sigma: dict[Block, Floats]

    @cached_property
    def flat_sigma(self) -> Floats:
        """Standard deviations of all parameters, fixed ones too, (p,)."""
        return np.concatenate([self.sigma[block].ravel() for block in Block])

    @cached_property
    def free(self) -> Ints:
        """Numbers of the parameters that are not fixed."""
        return np.flatnonzero(self.flat_sigma > 0)

    @cached_property
    def first(self) -> dict[Block, int]:
        """Number of each block's first parameter."""
        sizes = [self.sigma[block].size for block in Block]
        return dict(zip(Block, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))

    @cached_property
    def across(self) -> Floats:
        """Two directions across the axis, (2, 3)."""
        return perpendicular_axes(self.mean.axis)

    @cached_property
    def ways(self) -> Floats:
        """Directions that frames are shifted along: two across the axis, and the axis, (3, 3)."""
        return np.vstack([self.across, self.mean.axis])

    @cached_property
    def across_arms(self) -> Floats:
        """Two directions across the arm of each sphere from its seat, (k, 2, 3)."""
        has_arm = norm(self.arm)[:, None] > 0
        return perpendicular_axes(unit(np.where(has_arm, self.arm, self.mean.axis)))

    @property
    def arm(self) -> Floats:
        """Of the spheres' centres from their seats, mm, (k, 3)."""
        return self.mean.centre - self.seat

    def is_of(self, what: Of) -> Bools:
        """Whether free parameters are of single frames, spheres ..., (q,)."""
        every = [np.full(self.sigma[block].size, block.of == what) for block in Block]
        return np.concatenate(every)[self.free]

    def columns(self, block: Block, number: Ints) -> Ints:
        """Numbers of the parameters of a block for each frame, sphere ... of (n,), (n, c)."""
        return self.first[block] + block.size * number[:, None] + np.arange(block.size)

    def blocks(self, values: Floats) -> dict[Block, Floats]:
        """All parameters' values in their own units, of free ones in prior standard deviations."""
        every = np.zeros(len(self.flat_sigma))
        every[self.free] = values * self.flat_sigma[self.free]
        return {
            block: every[start : start + self.sigma[block].size].reshape(self.sigma[block].shape)
            for block, start in self.first.items()
        }

    def tilt(self, values: Floats) -> Rotation:
        """By which the axis is tilted about the origin, with the base and its spheres."""
        return Rotation.from_rotvec(self.blocks(values)[Block.TILT] @ self.across)

    def cap_tilts(self, values: Floats) -> Rotation:
        """By which spheres are tilted about their seats, on the base before that is tilted."""
        tilts = self.blocks(values)[Block.CAP_TILT]
        return Rotation.from_rotvec(np.einsum("ka,kax->kx", tilts, self.across_arms))

    def arms(self, values: Floats) -> Floats:
        """Arms of spheres that are tilted, mm, (k, 3): an apex stays when the radius grows."""
        arm, forms = self.arm, self.mean.forms
        if forms is not None:
            arm = arm - (self.powered(values) - self.mean.radius)[:, None] * forms.outward
        return np.asarray(self.cap_tilts(values).apply(arm))

    def aim(self, values: Floats) -> Floats:
        """Rotation of the camera about its own axes that keeps the picture in place, (3,).

        It is aimed by its picture, so one whose principal point is off is turned against that.
        """
        return self.by_principal @ self.blocks(values)[Block.PRINCIPAL]

    @cached_property
    def by_principal(self) -> Floats:
        """Derivatives of `aim` by the principal point, radians/px, (3, 2)."""
        x, y = 1 / self.mean.camera.focal
        return np.array([[0, y], [-x, 0], [0, 0]])

    def machine(self, values: Floats) -> Machine:
        """The machine of free parameters (q,) in prior standard deviations."""
        x, mean = self.blocks(values), self.mean
        growth, *common = x[Block.CARRIER]
        tilt, forms, radius = self.tilt(values), self.mean.forms, self.powered(values)
        seat = (1 + growth) * self.seat + np.array(common) @ self.ways + x[Block.CENTRES]
        if forms is not None:
            turned = tilt * self.cap_tilts(values)
            axes = np.stack([turned.apply(forms.axes[:, i]) for i in (0, 1)], axis=1)
            forms = replace(forms, axes=axes, terms=forms.terms + x[Block.FORM])
        ratio = x[Block.FOCAL][0] + np.array([0.5, -0.5]) * x[Block.FOCAL][1]
        turn = Rotation.from_rotvec(x[Block.CAMERA_TURN]) * Rotation.from_rotvec(self.aim(values))
        camera = replace(
            mean.camera,
            pinhole=mean.camera.pinhole + x[Block.PINHOLE],
            axes=turn.as_matrix() @ mean.camera.axes,
            focal=mean.camera.focal * np.exp(ratio),
            principal=mean.camera.principal + x[Block.PRINCIPAL],
            distortion=mean.camera.distortion + x[Block.DISTORTION],
        )
        return Machine(
            camera=camera,
            axis=tilt.apply(mean.axis),
            axis_point=mean.axis_point + x[Block.AXIS_POINT] @ self.across,
            angle=mean.angle + x[Block.OFFSET][self.series] + x[Block.ANGLES],
            centre=tilt.apply(seat + self.arms(values)),
            radius=radius + x[Block.RADII],
            leds=mean.leds + x[Block.LEDS],
            turn=_sum(mean.turn, x[Block.TURN] @ self.across),
            shift=_sum(mean.shift, x[Block.SHIFT] @ self.ways),
            sag=None if mean.sag is None else (1 + x[Block.SAG][0]) * mean.sag,
            seat_turn=(None if mean.seat_turn is None else (1 + x[Block.SAG][0]) * mean.seat_turn),
            forms=forms,
        )

    def powered(self, values: Floats) -> Floats:
        """Radii of the spheres with the powers of caps, mm, (k,)."""
        forms, power = self.mean.forms, self.blocks(values)[Block.POWER]
        radius = self.mean.radius
        return radius if forms is None else powered_radius(radius, forms.half_aperture, power)

    def radius_by_power(self, values: Floats) -> Floats:
        """Derivatives of the spheres' radii by the powers of caps, (k,)."""
        forms = self.mean.forms
        if forms is None:
            return np.zeros(len(self.mean.radius))
        return power_slope(self.powered(values), forms.half_aperture)


def _sum(mean: Floats | None, more: Floats) -> Floats:
    return more if mean is None else mean + more


def prior_of(
    machine: Machine,
    series: Ints,
    known: Mapping[Block, ArrayLike],
    seat: Floats | None = None,
) -> Prior:
    """A prior by standard deviations, each broadcast to its block; the other blocks are fixed.

    Each frame belongs to a series, (f,). Spheres are their own bodies in the seats, or have seats
    (k, 3).
    """
    numbers = {
        Of.SERIES: int(series.max()) + 1,
        Of.LED: len(machine.leds),
        Of.SPHERE: len(machine.radius),
        Of.FRAME: len(machine.angle),
    }
    sigma = {}
    for block in Block:
        size = (block.size,) if block.size > 1 or block.of is Of.MACHINE else ()
        shape = size if block.of is Of.MACHINE else (numbers[block.of], *size)
        sigma[block] = np.broadcast_to(known.get(block, 0.0), shape).astype(np.float64)
    return Prior(machine, series, machine.centre if seat is None else seat, sigma)
