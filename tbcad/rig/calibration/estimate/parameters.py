"""The unknowns of a machine as one vector, in units of their prior standard deviations.

Zero is the prior mean. Blocks follow each other in the order of Block; what is fixed has no place
in the vector.

Gauge: photographs do not change when camera, axis, spheres and LEDs are moved or rotated together,
when all lengths grow, when the base's angles are offset and the spheres rotated back, when the
point of the axis slides along it, or when one of its run-outs is common to all frames. The prior
alone fixes these; the point slides not at all, and run-out is across the axis only.

Covariance: parameters of one frame (or of one sphere, where there are more spheres than frames)
touch those of no other, so the information has an arrow's shape. With E these and R the rest,

    C_RR = (H_RR - H_RE H_EE^-1 H_ER)^-1,   K = -H_EE^-1 H_ER,
    C = [H_EE^-1 + K C_RR K^T, K C_RR; C_RR K^T, C_RR]       (Schur's complement),

and H_EE^-1 has the blocks of H_EE.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.vectors import perpendicular_axes
from tbcad.rig.machine.machine import Machine
from tbcad.types import Bools, Floats, Ints


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

    def is_of(self, *blocks: Block) -> Bools:
        """Whether free parameters are of some blocks, (q,)."""
        every = [np.full(self.sigma[block].size, block in blocks) for block in Block]
        return np.concatenate(every)[self.free]

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


@dataclass(frozen=True)
class Covariance:
    """Of free parameters in prior standard deviations."""

    inner: Ints  # numbers of the parameters E, (e,)
    outer: Ints  # numbers of the parameters R, (r,)
    inverse: csr_array  # of H_EE, (e, e)
    follows: Floats  # K, (e, r)
    of_outer: Floats  # C_RR, (r, r)

    def of(self, slopes: csr_array, size: int) -> Floats:
        """Covariance of n groups of figures, in the square of their unit, (n, size, size).

        Slopes are derivatives by the parameters, rows group by group, (n * size, q).
        """
        inner = slopes[:, self.inner]
        shape = (slopes.shape[0] // size, size, len(self.outer))
        through = (inner @ self.follows + slopes[:, self.outer].toarray()).reshape(shape)
        shared = through @ self.of_outer @ through.swapaxes(1, 2)
        spread = csr_array(inner @ self.inverse)
        own = np.zeros(shared.shape)
        for row in range(size):
            for column in range(size):
                product = spread[row::size].multiply(inner[column::size])
                own[:, row, column] = np.asarray(product.sum(axis=1)).ravel()
        return np.asarray(shared + own)

    def times(self, vectors: Floats) -> Floats:
        """The whole covariance times vectors (q, c)."""
        inner, outer = vectors[self.inner], vectors[self.outer]
        result = np.empty(vectors.shape)
        result[self.outer] = self.of_outer @ (self.follows.T @ inner + outer)
        result[self.inner] = self.inverse @ inner + self.follows @ result[self.outer]
        return result

    def sigma(self) -> Floats:
        """Standard deviation of each parameter, in prior standard deviations, (q,)."""
        result = np.empty(len(self.inner) + len(self.outer))
        shared = np.einsum("er,rs,es->e", self.follows, self.of_outer, self.follows)
        result[self.inner] = np.sqrt(shared + self.inverse.diagonal())
        result[self.outer] = np.sqrt(np.diag(self.of_outer))
        return result


def covariance(prior: Prior, information: csc_array) -> Covariance:
    """The inverse of the information of a prior's free parameters, (q, q)."""
    is_inner = _is_inner(prior)
    inner, outer = np.flatnonzero(is_inner), np.flatnonzero(~is_inner)
    rows = csr_array(information)
    inverse = _block_inverse(csr_array(rows[inner][:, inner]))
    across = rows[inner][:, outer].toarray()
    follows = -(inverse @ across)
    of_outer = np.linalg.inv(rows[outer][:, outer].toarray() + across.T @ follows)
    return Covariance(inner, outer, inverse, follows, (of_outer + of_outer.T) / 2)


def _is_inner(prior: Prior) -> Bools:
    """Whether free parameters are of one frame, or of one sphere where these are more."""
    of_frames, of_spheres = (Block.ANGLES, Block.RUNOUT), (Block.CENTRES, Block.RADII)
    free = [sum(int((prior.sigma[b] > 0).sum()) for b in two) for two in (of_frames, of_spheres)]
    return prior.is_of(*(of_frames if free[0] > free[1] else of_spheres))


def _block_inverse(matrix: csr_array) -> csr_array:
    count, block = connected_components(matrix, directed=False)
    order = np.argsort(block, kind="stable")
    size = np.bincount(block, minlength=count)
    first = np.cumsum(size) - size
    rows, columns, values = [], [], []
    for width in np.unique(size):
        members = order[first[size == width][:, None] + np.arange(width)]
        i, j = np.broadcast_arrays(members[:, :, None], members[:, None])
        dense = np.asarray(matrix[i.ravel(), j.ravel()]).reshape(i.shape)
        rows.append(i.ravel())
        columns.append(j.ravel())
        values.append(np.linalg.inv(dense).ravel())
    places = np.concatenate(rows), np.concatenate(columns)
    return csr_array((np.concatenate(values), places), shape=matrix.shape)
