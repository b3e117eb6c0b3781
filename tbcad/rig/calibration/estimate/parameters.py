"""The unknowns of a machine as one vector, in units of their prior standard deviations.

Zero is the prior mean. Blocks follow each other in the order of Block; what is fixed has no place
in the vector.

Gauge: photographs do not change when camera, axis, spheres and LEDs are moved or rotated together,
when all lengths grow, when the base's angles are offset and the spheres rotated back, when the
point of the axis slides along it, or when one of its run-outs is common to all frames. The prior
alone fixes these; the point slides not at all, and run-out is across the axis only.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.vectors import perpendicular_axes
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats, Ints


class Block(StrEnum):
    """Blocks of the vector, in their order."""

    CAMERA_TURN = "camera_turn"
    PINHOLE = "pinhole"
    FOCAL = "focal"
    PRINCIPAL = "principal"
    DISTORTION = "distortion"
    TILT = "axis_tilt"
    AXIS_POINT = "axis_point"
    OFFSET = "angle_offset"
    CARRIER = "carrier"
    LEDS = "leds"
    CENTRES = "centres"
    RADII = "radii"
    ANGLES = "angles"
    RUNOUT = "runout"


CAMERA = (Block.CAMERA_TURN, Block.PINHOLE, Block.FOCAL, Block.PRINCIPAL, Block.DISTORTION)


@dataclass(frozen=True)
class Prior:
    """What is known of a machine before it is photographed: means, and standard deviations."""

    mean: Machine  # the machine, without shift
    # number of the series that each frame belongs to, each with an offset of its angles of its own,
    # (f,)
    series: Ints
    # standard deviations, by block; zero fixes: camera_turn about the camera's own axes, radians,
    # (3,); pinhole, mm, (3,); focal: logarithm of both, and of columns over rows, (2,); principal,
    # px, (2,); distortion (5,); axis_tilt about two directions across the axis, through the origin
    # and with all spheres, radians, (2,); axis_point along both, mm, (2,); angle_offset of each
    # series, radians, (r,); carrier: growth of the spheres' places about the origin, as a share,
    # and their shift along the axis, mm, (2,); leds mm, (l, 3); centres mm, (k, 3); radii mm, (k,);
    # angles of single frames, radians, (f,); runout across the axis, mm, (f, 2)
    sigma: dict[str, Floats]

    @cached_property
    def flat_sigma(self) -> Floats:
        """Standard deviations of all parameters, fixed ones too, (p,)."""
        return np.concatenate([self.sigma[block].ravel() for block in Block])

    @cached_property
    def free(self) -> Ints:
        """Numbers of the parameters that are not fixed."""
        return np.flatnonzero(self.flat_sigma > 0)

    @cached_property
    def first(self) -> dict[str, int]:
        """Number of each block's first parameter."""
        sizes = [self.sigma[block].size for block in Block]
        return dict(zip(Block, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))

    @cached_property
    def across(self) -> Floats:
        """Two directions across the axis, (2, 3)."""
        return perpendicular_axes(self.mean.axis)

    def blocks(self, values: Floats) -> dict[str, Floats]:
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

    def machine(self, values: Floats) -> Machine:
        """The machine of free parameters (q,) in prior standard deviations."""
        x, mean = self.blocks(values), self.mean
        growth, slide = x[Block.CARRIER]
        tilt = self.tilt(values)
        ratio = x[Block.FOCAL][0] + np.array([0.5, -0.5]) * x[Block.FOCAL][1]
        camera = replace(
            mean.camera,
            pinhole=mean.camera.pinhole + x[Block.PINHOLE],
            axes=Rotation.from_rotvec(x[Block.CAMERA_TURN]).apply(mean.camera.axes.T).T,
            focal=mean.camera.focal * np.exp(ratio),
            principal=mean.camera.principal + x[Block.PRINCIPAL],
            distortion=mean.camera.distortion + x[Block.DISTORTION],
        )
        return Machine(
            camera=camera,
            axis=tilt.apply(mean.axis),
            axis_point=mean.axis_point + x[Block.AXIS_POINT] @ self.across,
            angle=mean.angle + x[Block.OFFSET][self.series] + x[Block.ANGLES],
            centre=tilt.apply((1 + growth) * mean.centre + slide * mean.axis + x[Block.CENTRES]),
            radius=mean.radius + x[Block.RADII],
            leds=mean.leds + x[Block.LEDS],
            shift=x[Block.RUNOUT] @ self.across,
        )
