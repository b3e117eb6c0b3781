"""The lamps as data: strips, places, bodies, and what holds them."""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import Component, Primitive, Prism
from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.prototype import StageSpec
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.frame.purchased import THROUGH_MM, Bracket
from tbcad.prototype.keepout import KeepOut
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats

STRIP, SHORT_STRIP = "STRIP-COB-24V", "STRIP-240-24V"
EDGE_MM = 2.0  # of a plate beyond the strips
ACROSS, UP = np.eye(3)[1:]
ROOM_SIDES = 12
EDGE_POINTS = 9
MARCHES, NEAR_MM = 48, 0.5  # steps along a line of light, and how near to the base it may come


@dataclass(frozen=True)
class LampLayout:
    """The lamps, in the frame of the shell."""

    strip: PurchasedPart  # that they are made of, from the lists
    strips: int  # number of strips on each, side by side
    length: float  # of a strip, mm
    level: bool  # whether strips lie level, along y; else they are upright
    places: Floats  # middles of the shining faces, mm, (l, 3)
    inward: Floats  # unit directions that they shine in, (l, 3)
    stands: tuple[Bracket, ...]  # on the base plate, to print
    holders: tuple[Component, ...]  # on the uprights, to print
    # heights (z) of the holders' screws on each upright, the upper first, mm
    screws: tuple[float, ...]
    fasteners: tuple[Fastener, ...]  # that hold the holders
    bodies: tuple[Component, ...]  # of the strips of each lamp

    @property
    def width(self) -> float:
        """Of all strips of a lamp, side by side, mm."""
        return self.strips * self.strip["width_mm"]

    @property
    def sides(self) -> tuple[float, float]:
        """Of a shining face, along y and along z, mm."""
        return (self.length, self.width) if self.level else (self.width, self.length)

    @property
    def metres(self) -> float:
        """Length of all strips, m."""
        return len(self.places) * self.strips * self.length / 1e3

    @property
    def watt(self) -> float:
        """Power of all lamps."""
        return self.metres * self.strip["watt_m"]

    @property
    def current_ma(self) -> float:
        """Of all lamps, at the strip's voltage."""
        return 1e3 * self.watt / self.strip["supply_v"]

    @property
    def lumen(self) -> float:
        """Light of one lamp."""
        return self.strips * self.length / 1e3 * self.strip["lumen_m"]

    def outlines(self) -> Floats:
        """Corners of all shining faces and the middles of their upright edges, mm, (l, 6, 3)."""
        y, z = np.array(self.sides) / 2
        around = [side * y * ACROSS + high * UP for side in (-1, 1) for high in (-z, 0.0, z)]
        return np.asarray(self.places[:, None] + np.array(around))


def in_view(bodies: list[Primitive], camera: Camera) -> bool:
    """Whether the camera sees the upper edges of bodies, which are the nearest to its view."""
    edges = np.vstack([_upper_edges(body) for body in bodies])
    right, down, depth = ((edges - camera.pinhole) @ camera.axes.T).T
    half = camera.half_sizes
    return bool(((np.abs(right) < half[0] * depth) & (np.abs(down) < half[1] * depth)).any())


def hidden_by_base(layout: LampLayout, stage: StageSpec, keep_out: KeepOut) -> bool:
    """Whether the base comes between a lamp and the object's room at or between the stops."""
    room = _room(stage, keep_out.capture)
    faces = layout.outlines().reshape(-1, 3)
    starts, ends = np.tile(room, (len(faces), 1)), np.repeat(faces, len(room), axis=0)
    return not _reaches(keep_out.at_stops or keep_out, starts, ends)


def _upper_edges(body: Primitive) -> Floats:
    """Points (n, 3) along the edges of an upright box's upper face."""
    assert isinstance(body, Prism)
    corners = np.vstack([body.corners, body.corners + body.along])
    top = corners[corners[:, 2] > corners[:, 2].max() - THROUGH_MM]
    pairs = (
        top[:, None, None]
        + np.linspace(0, 1, EDGE_POINTS)[:, None] * (top - top[:, None])[:, :, None]
    )
    return np.asarray(pairs.reshape(-1, 3))


def _room(stage: StageSpec, capture: float) -> Floats:
    """Points (p, 3) round the object's room, from the disc to the capture sphere, mm."""
    radius = float(stage.object_diameter_mm) / 2
    top = math.sqrt(max(capture**2 - radius**2, 0.0))
    circle = radius * unit_circle(even_angles(ROOM_SIDES))
    heights = (float(stage.top_mm), 0.0, top)
    return np.vstack([np.column_stack([circle, np.full(len(circle), z)]) for z in heights])


def _reaches(keep_out: KeepOut, starts: Floats, ends: Floats) -> bool:
    """Whether all segments (n, 3) miss what the base sweeps.

    Each is followed in steps of the distance to it, which cannot jump over anything.
    """
    length = norm(ends - starts)
    along, at = (ends - starts) / length[:, None], np.zeros(len(starts))
    for _ in range(MARCHES):
        distance = keep_out.to_swept(starts + at[:, None] * along)
        if distance.min() < NEAR_MM:
            return False
        at = at + distance
        inside = at < length
        if not inside.any():
            return True
        starts, along, at, length = starts[inside], along[inside], at[inside], length[inside]
    return False
