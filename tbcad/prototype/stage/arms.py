"""Arms that carry LEDs beside the object: out of the crown below its room, then upward.

An arm fills what the object's room leaves free inside the capture sphere. Its section is in the
upright plane through the post's axis and the LED, in coordinates (r, z) from the axis, mm.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import Prism, box
from tbcad.core.geometry.vectors import norm, unit
from tbcad.types import Floats

ARC_CHORDS = 6  # along the sphere, of each part
LAP_MM = 1.0  # by which one part reaches into the other, and grooves beyond their ends
GROOVE_MM = 0.8  # depth of the wires' groove in the arm's inner face
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Arm:
    """The arm of one LED."""

    axes: Floats  # rows: out from the axis, across, up, (3, 3)
    inner: float  # r of its upright inner face; the LED is half the width farther out
    outer: float  # r of its outer side at the pocket
    floor: float  # z of the pocket's floor
    turn: float  # z below which the object's room ends and the arm turns outward
    root: tuple[float, float]  # (r, z) where its upper face leaves the crown's plate
    low: float  # z of the plate's lower face at its rim
    sphere: float  # radius of the sphere that it stays in

    @property
    def half_width(self) -> float:
        """Of the arm, and radius of the pillar on it."""
        return (self.outer - self.inner) / 2

    def bodies(self) -> list[Prism]:
        """The part below the object's room, and the upright part to the pocket's floor."""
        corner, lap = (self.inner, self.turn), (self.inner, self.turn - LAP_MM)
        direction = float(np.arctan2(self.turn, self.inner))
        bottom = float(np.arcsin(self.low / self.sphere))
        side = -float(np.arccos(self.outer / self.sphere))
        end = max(
            -float(np.arccos(self.inner / self.sphere)), float(np.arcsin(lap[1] / self.sphere))
        )
        top = np.array([lap, (self.inner, self.floor), (self.outer, self.floor)])
        upper, under = np.array([self.root, corner]), np.array([(self.root[0], self.low)])
        sections = (
            np.vstack([upper, self._arc(direction, bottom), under]),
            np.vstack([top, self._arc(side, end)]),
        )
        return [self._prism(section, self.half_width) for section in sections]

    def grooves(self, width: float) -> list[Prism]:
        """The wires' way from the pocket's floor along the inner faces to the crown's plate."""
        half, middle = width / 2, self.inner + self.half_width
        root, corner = np.array(self.root), np.array([self.inner, self.turn])
        along = unit(corner - root)
        deep, above = GROOVE_MM * np.array([along[1], -along[0]]), LAP_MM * UP[1:]
        start, end = root - LAP_MM * along, corner + GROOVE_MM * along
        slanting = np.array([start + deep, end + deep, end + above, start + above])
        top = self.floor + LAP_MM
        return [
            self._prism(slanting, half),
            self._box((self.inner - LAP_MM, self.turn), (self.inner + GROOVE_MM, top), half),
            self._box((self.inner - LAP_MM, self.floor - GROOVE_MM), (middle + half, top), half),
        ]

    def _arc(self, first: float, last: float) -> Floats:
        """Points (k, 2) on the sphere between two angles from the horizon, radians."""
        angle = np.linspace(first, last, ARC_CHORDS + 1)
        return np.asarray(self.sphere * np.column_stack([np.cos(angle), np.sin(angle)]))

    def _prism(self, section: Floats, half: float) -> Prism:
        across = np.full(len(section), -half)
        corners = np.column_stack([section[:, 0], across, section[:, 1]]) @ self.axes
        return Prism(corners, 2 * half * self.axes[1])

    def _box(self, low: tuple[float, float], high: tuple[float, float], half: float) -> Prism:
        first, last = (np.array([r, side, z]) for (r, z), side in ((low, -half), (high, half)))
        return box(first, last, self.axes)


def arm_axes(dome: Floats) -> Floats:
    """Rows out from the post's axis to a place (3,), across, and up, (3, 3)."""
    out = np.array([*dome[:2], 0.0]) / norm(dome[:2])
    return np.stack([out, np.cross(UP, out), UP])
