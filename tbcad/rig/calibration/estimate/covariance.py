"""The covariance of a machine's parameters, and of what follows from them.

Parameters of one frame (or of one sphere, where there are more spheres than frames) touch those of
no other, so the information has an arrow's shape. With E these and R the rest,

    C_RR = (H_RR - H_RE H_EE^-1 H_ER)^-1,   K = -H_EE^-1 H_ER,
    C = [H_EE^-1 + K C_RR K^T, K C_RR; C_RR K^T, C_RR]       (Schur's complement),

and H_EE^-1 has the blocks of H_EE.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, csr_array
from scipy.sparse.csgraph import connected_components

from tbcad.rig.calibration.estimate.parameters import Block, Prior
from tbcad.types import Floats, Ints


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


def _is_inner(prior: Prior) -> np.ndarray:
    """Whether free parameters are of one frame, or of one sphere where these are more."""
    of_frames, of_spheres = (Block.ANGLES, Block.RUNOUT), (Block.CENTRES, Block.RADII)
    free = [sum(int((prior.sigma[b] > 0).sum()) for b in two) for two in (of_frames, of_spheres)]
    blocks = of_frames if free[0] > free[1] else of_spheres
    result = np.zeros(len(prior.flat_sigma), dtype=bool)
    for block in blocks:
        result[prior.first[block] : prior.first[block] + prior.sigma[block].size] = True
    return result[prior.free]


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
