"""A camera that moves in mid-run: all highlights of later frames are off together."""

from dataclasses import dataclass

import numpy as np

from tbcad.calibration.estimate.solve import Estimate
from tbcad.geometry.vectors import norm
from tbcad.types import Bools, Floats, Ints

MIN_HIGHLIGHTS = 4  # of a frame, to say where it is
MIN_FRAMES = 3  # on either side of a move
MIN_MOVE_PX, MOVE_SIGMAS = 0.15, 8.0  # less is no move
FEW = 0.3  # share of the usual number of pairs: fewer are not where the machine shows them


@dataclass(frozen=True)
class Move:
    """A move of the camera.

    Attributes:
        first: number of the first frame after it.
        kept: whether each frame is on the side that is kept, (f,).
    """

    first: int
    kept: Bools


def find_move(estimate: Estimate, frames: int, spots: Floats) -> Move | None:
    """The one move of the camera that the residuals show best; None where there is none.

    Args:
        estimate: of the machine from the highlights of all frames.
        frames: number of frames.
        spots: number of spots that each frame shows, (f,).
    """
    frame = estimate.highlights.frame
    count = np.bincount(frame, minlength=frames).astype(np.int64)
    lost = (count < FEW * np.median(count[count > 0])) & (spots > 0)
    if lost.sum() >= MIN_FRAMES and _at_one_end(lost):
        first = int(np.flatnonzero(lost)[0]) if not lost[0] else int(np.flatnonzero(~lost)[0])
        return Move(first, ~lost)
    return _step(estimate, count)


def _at_one_end(lost: Bools) -> bool:
    """Whether what is lost is all that comes before or after one frame."""
    return int(np.count_nonzero(np.diff(lost.astype(int)))) == 1


def _step(estimate: Estimate, count: Ints) -> Move | None:
    known = np.flatnonzero(count >= MIN_HIGHLIGHTS)
    if len(known) < 2 * MIN_FRAMES:
        return None
    frame = estimate.highlights.frame
    middle = np.array([np.median(estimate.residual[frame == f], axis=0) for f in known])
    before = np.arange(1, len(known))[:, None]
    sums = np.cumsum(middle, axis=0)
    step = (sums[-1] - sums[:-1]) / (len(known) - before) - sums[:-1] / before
    # A step in the middle is known better than one near an end.
    weight = np.sqrt(before * (len(known) - before) / len(known))
    score = norm(step * weight)
    score[: MIN_FRAMES - 1] = score[len(known) - MIN_FRAMES :] = 0
    best = int(score.argmax())
    scatter = float(np.median(np.abs(np.diff(middle, axis=0)))) + np.finfo(float).eps
    if norm(step[best]) < MIN_MOVE_PX or score[best] < MOVE_SIGMAS * scatter:
        return None
    first = int(known[best + 1])
    after = np.arange(len(count)) >= first
    return Move(first, after if after.sum() > (~after).sum() else ~after)
