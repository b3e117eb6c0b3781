"""Displacements of a prototype's balls by weight at the stops of its base: sag.csv.

The frame here is the base's at angle zero: x along the axis w, y at azimuth zero.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tbcad.cad.formats.checked_files import Row, columns, write_table
from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.vectors import norm
from tbcad.errors import InputError
from tbcad.prototype.gravity.compliance import rigid_motion
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.tables import SAG, BallRow, SagRow, StopRow
from tbcad.types import Floats

LEFT = {"turn and run-out": [3, 1, 2], "six freedoms": [0, 1, 2, 3, 4, 5]}
"""Freedoms of `Sag.unmodelled` that a calibration may give to each stop."""
PARTS = ("carrier", "head", "shaft", "uprights")  # that bend


@dataclass(frozen=True)
class Sag:
    """Displacements of k balls at s stops in the base's frame, which turns with it, mm."""

    angle: Floats  # of the base at each stop, radians, (s,)
    centre: Floats  # of the bodies as designed, in the base's frame, mm, (k, 3)
    axes: Floats  # of that frame at angle zero in the shell's, as rows, (3, 3)
    of: dict[str, Floats]  # by what bends, one of PARTS, (s, k, 3)
    seat_turn: Floats  # small rotations of the seats as the carrier bends, radians, (s, k, 3)

    @property
    def gravity(self) -> Floats:
        """Direction of gravity at each stop, (s, 3)."""
        down = np.broadcast_to(-self.axes[:, 2], (len(self.angle), 3))
        return rotated_about_x(down, -self.angle)

    @property
    def whole(self) -> Floats:
        """Displacements by all together, mm, (s, k, 3)."""
        return np.asarray(np.sum(list(self.of.values()), axis=0))

    def between_stops(self, moved: Floats) -> float:
        """The longest way of a ball between two stops, mm, by displacements (s, k, 3)."""
        return max(
            float(norm(ball[:, None] - ball[None]).max()) for ball in np.swapaxes(moved, 0, 1)
        )

    def unmodelled(self, moved: Floats, freedoms: list[int]) -> Floats:
        """Residual of displacements (s, k, 3) after calibration, mm, (s, k).

        Calibration takes out where the balls are on the mean over stops, and for each stop the best
        rigid motion of some freedoms: 0 to 2 are shifts along the axes, 3 to 5 turns about them.
        """
        motion = rigid_motion(self.centre)[:, :, freedoms].reshape(-1, len(freedoms))
        left = (moved - moved.mean(axis=0)).reshape(len(moved), -1)
        left = left - left @ np.linalg.pinv(motion).T @ motion.T
        return norm(left.reshape(moved.shape))

    def record(self) -> dict[str, Any]:
        """For other programs, in mm: by what bends, and what is left after calibration."""
        ways = {name: self.between_stops(moved) for name, moved in self.of.items()}
        left = {name: self.unmodelled(self.whole, freedoms) for name, freedoms in LEFT.items()}
        return {
            "schema": "tbcad-sag/1",
            "between_stops_mm": self.between_stops(self.whole),
            "parts_between_stops_mm": ways,
            "left_rms_mm": {name: float(np.sqrt((one**2).mean())) for name, one in left.items()},
            "left_max_mm": {name: float(one.max()) for name, one in left.items()},
        }

    def lines(self) -> list[str]:
        """The same in words."""
        record = self.record()
        rms, most = record["left_rms_mm"], record["left_max_mm"]
        ways = ", ".join(f"{n} {mm:.2f}" for n, mm in record["parts_between_stops_mm"].items())
        return [
            f"Sag: a ball moves by up to {record['between_stops_mm']:.2f} mm between stops",
            f"  by what bends: {ways}",
            *(
                f"  left by {name} for each stop: {rms[name]:.3f} mm RMS, {most[name]:.3f} at most"
                for name in LEFT
            ),
        ]

    def rows(self) -> Iterable[Row]:
        """Rows of sag.csv: displacements and turns in the frame of the shell."""
        vectors = (*(self.of[part] for part in PARTS), self.seat_turn)
        turned = [rotated_about_x(one, self.angle[:, None]) for one in vectors]
        moved = np.concatenate([one @ self.axes for one in turned], axis=2)
        for stop, balls in enumerate((moved + 0.0).tolist(), 1):
            for ball, cells in enumerate(balls, 1):
                yield dict(zip(SagRow.columns(), (stop, ball, *cells), strict=True))


def read_sag(folder: Path) -> Sag | None:
    """The sag that a build has in sag.csv; None where it was not worked out.

    InputError: a file of the prototype is missing, cannot be read, or is of another prototype.
    """
    record = Prototype.read(folder / NAME)
    if not (folder / SagRow.FILE).is_file():
        return None
    balls, stops, rows = BallRow.read(folder), StopRow.read(folder), SagRow.read(folder)
    shape = len(stops), len(balls)
    if [(row.stop, row.ball) for row in rows] != [(s + 1, k + 1) for s, k in np.ndindex(shape)]:
        raise InputError(
            f"{folder / SagRow.FILE} lacks a row for each of {shape[0]} stops and {shape[1]} "
            "balls, in order: run tbcad build again"
        )
    angle = np.radians([row.base_angle_deg for row in stops])
    axes = np.array([record.frame.axis, record.frame.zero, record.frame.third])
    moved = np.array([[getattr(row, one) for one in SagRow.columns()[2:]] for row in rows])
    vectors = moved.reshape(*shape, len(PARTS) + 1, 3).transpose(2, 0, 1, 3) @ axes.T
    *turned, seat_turn = rotated_about_x(vectors, -angle[:, None])
    centre = (columns(balls, "bx by bz") + columns(balls, SAG)) @ axes.T
    return Sag(angle, centre, axes, dict(zip(PARTS, turned, strict=True)), seat_turn)


def write_sag(folder: Path, sag: Sag) -> None:
    """Write sag.csv."""
    write_table(folder / SagRow.FILE, SagRow.columns(), list(sag.rows()))
