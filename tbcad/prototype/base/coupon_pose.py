"""How the carrier's worst seat lies on the printer's bed: the pose of the coupon's seats."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tbcad.geometry.vectors import norm, unit
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.split import BaseSplit
from tbcad.prototype.printing.pads_up import opening_up
from tbcad.types import Floats

UPRIGHT = 1e-9  # of an axis's level part: a seat without a lean
DECIMALS = 6  # to which seats face up alike
SAME_POSE = np.sin(np.radians(1))  # between the axes of two poses that are taken for the same


@dataclass(frozen=True)
class SeatPose:
    """A seat on the bed.

    Attributes:
        axes: rows of the seat's own frame along the bed's x, y and z; the axis leans toward y,
            (3, 3).
        pad_azimuth: of its first pad about its axis, radians.
    """

    axes: Floats
    pad_azimuth: float

    @property
    def lean(self) -> float:
        """Angle between the seat's axis and straight down, radians."""
        return float(np.arctan2(self.axes[2, 1], -self.axes[2, 2]))

    def is_like(self, other: "SeatPose") -> bool:
        """Whether pads and cup lie nearly alike."""
        apart = float(np.abs(self.axes - other.axes).max())
        return bool(max(apart, abs(self.pad_azimuth - other.pad_azimuth)) < SAME_POSE)


def expected_downs(base: BaseLayout, split: BaseSplit) -> list[Floats]:
    """For each piece the direction (3,) that is probably down when it is printed.

    In the frame of the shell, as all directions here. It is where the piece's pads face up, unless
    the bed is too small for that.
    """
    return [_expected_down(base, in_piece) for in_piece in _seats_of_pieces(base, split)]


def _expected_down(base: BaseLayout, seats: list[int]) -> Floats:
    if not seats:
        return np.asarray(-base.frame[0])
    opening = opening_up(base.seats.pad_normals[seats].reshape(-1, 3))
    return unit(base.seats.axis[seats].sum(axis=0)) if opening is None else opening


def worst_pose(base: BaseLayout, split: BaseSplit, downs: Sequence[Floats]) -> SeatPose:
    """Pose of the seat with the pad that is nearest to facing down; of several, that leans most.

    Args:
        base: with its seats.
        split: into pieces.
        downs: direction that is down when each piece is printed, (3,) each.
    """
    seats, pieces = base.seats, _seats_of_pieces(base, split)
    down = {k: way for way, in_piece in zip(downs, pieces, strict=True) for k in in_piece}

    def height_of_pads(k: int) -> tuple[float, float]:
        lowest = float((seats.pad_normals[k] @ -down[k]).min())
        return round(lowest, DECIMALS), float(seats.axis[k] @ down[k])

    worst = min(down, key=height_of_pads)
    return SeatPose(
        seats.axes[worst] @ _bed(seats.axis[worst], down[worst]), float(seats.pad_azimuth[worst])
    )


def _seats_of_pieces(base: BaseLayout, split: BaseSplit) -> list[list[int]]:
    """Numbers of the seats in each piece."""
    seats = base.local_seats
    piece = [split.piece_of(end) for end in seats.at_depth(seats.back)]
    return [[k for k, at in enumerate(piece) if at == n] for n in range(len(split.pieces))]


def _bed(axis: Floats, down: Floats) -> Floats:
    """Columns x, y and z of a bed on which an axis leans toward y, (3, 3)."""
    level = axis - (axis @ down) * down
    if norm(level) < UPRIGHT:
        level = np.cross(down, np.eye(3)[int(np.abs(down).argmin())])
    y = unit(level)
    return np.column_stack([np.cross(y, -down), y, -down])
