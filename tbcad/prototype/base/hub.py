"""The hub: a disc and a boss about the axis, and the holes of what drives it."""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.core.geometry.rotations import bolt_circle
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec, Drive
from tbcad.types import Floats

WALL_MM = 3.0  # round holes that take a load
MIN_WALL_MM = 1.5  # between the shaft's bore and the holes
SCREW_MM = 3.4  # clearance hole of an M3 screw (ISO 273, medium)
SLIT_MM = 2.0  # width of the clamp's slit
DISC_MM = 10.0  # thickness of the disc
DISC_BEYOND_BOSS_MM = 8.0  # minimum radius of the disc beyond that of the boss
MIN_DISC_RADIUS_MM = 30.0  # with a boss
SOCKET_MM = 9.0  # depth of the bore's free end, within the disc
BELOW_HEAD_MM = 6.0  # material below a counterbore
PIN_MM = 4.0  # diameter of the rod that fixes angle zero
PIN_OUT_MM = 44.0  # of the pin: beyond the largest wheel, short of the motor
ZERO_DISC_MM = 5.0  # thickness of the disc between hub and drive
# Dowel that gives the disc its place about the axis, on the drive's circle between two holes.
KEY_MM, KEY_DEPTH_MM = 3.0, 6.0
KEY_HOLE_MM = 3.1  # in hub and disc; printed holes come out smaller
# On the side without ribs, at a right angle to each other.
SET_SCREW_AZIMUTHS = np.radians([135.0, 225.0])


@dataclass(frozen=True)
class HolePattern:
    """Holes of a purchased part, on a circle about the axis."""

    circle: float  # diameter, mm
    hole: float  # diameter of the holes; zero: inserts of the spec
    # diameter and depth of the counterbore on the side of the object, mm; zero: none
    head: tuple[float, float]
    boss: bool  # whether the hub has a boss with a shaft bore that is locked


PATTERNS: dict[Drive, HolePattern] = {
    # There is no standard for bolted GT2 wheels: the wheel is made to this circle.
    "nema17-belt": HolePattern(28.0, 0.0, (0.0, 0.0), True),
    # Sold as "5 mm flange coupling": flange 22 mm, four M3 holes on 16 mm, collar 10 mm.
    "nema17-direct": HolePattern(16.0, 0.0, (0.0, 0.0), True),
    # Stage tops with tapped M6 holes (ISO 273) on the 25 mm grid of optical tables, one central.
    "stage-60": HolePattern(50.0, 6.6, (11.0, 6.5), False),
}


@dataclass(frozen=True)
class Hub:
    """The hub about the axis; z along the axis, toward the camera, mm."""

    front: float  # z of the disc's face toward the object
    back: float  # z of the disc's other face
    face: float  # z of the outer face, where the drive is bolted on
    disc: float  # radius of the disc
    boss: float  # radius of the boss between back and face; zero: none
    bore: float  # radius of the shaft's through bore
    holes: Floats  # places (h, 2) of the drive's holes across the axis, x toward azimuth zero
    hole: float  # diameter of the holes
    depth: float  # depth of the holes from the outer face
    head: tuple[float, float]  # diameter and depth of their counterbores from the front; zero: none
    lock: str | None  # how the shaft is held; None without a boss
    lock_z: float  # z of the lock's screws
    key_radius: float  # distance of the key's hole from the axis

    @property
    def socket(self) -> float:
        """Z of the shaft's front end: before it the bore is free for the camera's gauge."""
        return self.front - SOCKET_MM

    @property
    def mount(self) -> float:
        """Z of the zero disc's outer face, where wheel, coupling or stage is bolted on."""
        return self.face - ZERO_DISC_MM

    @property
    def key(self) -> Floats:
        """Place (2,) of the key's hole across the axis."""
        return np.array([self.key_radius, 0.0])


def hub_layout(spec: BaseSpec, front: float) -> Hub:
    """The hub whose disc begins at z = front; SpecError when bore and drive's holes meet."""
    pattern, bore = PATTERNS[spec.drive], spec.shaft_mm / 2
    hole = pattern.hole or spec.insert_hole_mm
    largest = pattern.circle - max(hole, pattern.head[0]) - 2 * MIN_WALL_MM
    if spec.shaft_mm > largest:
        raise SpecError(
            f"a shaft of {spec.shaft_mm:g} mm leaves no wall to the holes of drive {spec.drive}: "
            f"make prototype.base.shaft_mm {largest:g} or less"
        )
    outer = pattern.circle / 2 + max(hole, pattern.head[0]) / 2 + WALL_MM
    if pattern.boss:
        boss = max(outer, bore + WALL_MM + spec.insert_depth_mm)
        disc, thickness = max(boss + DISC_BEYOND_BOSS_MM, MIN_DISC_RADIUS_MM), DISC_MM
    else:
        boss, disc, thickness = 0.0, outer, max(DISC_MM, pattern.head[1] + BELOW_HEAD_MM)
    back = front - thickness
    face = back - spec.hub_bosses_mm[0] if pattern.boss else back
    # A clamp's slit ends at a cut below the disc, twice as far from it as it is wide.
    lock_end = back - 2 * SLIT_MM * (spec.lock == "clamp")
    return Hub(
        front=front,
        back=back,
        face=face,
        disc=disc,
        boss=boss,
        bore=bore,
        holes=bolt_circle(pattern.circle / 2),
        hole=hole,
        depth=spec.insert_depth_mm if pattern.boss else thickness,
        head=pattern.head,
        lock=spec.lock if pattern.boss else None,
        lock_z=(lock_end + face + spec.insert_depth_mm) / 2 if pattern.boss else face,
        key_radius=pattern.circle / 2,
    )


def deepened(hub: Hub, face: float) -> Hub:
    """The hub with its outer face at z = face or behind it.

    Its disc gets thicker, and what is below the counterbores stays. One with a boss is returned as
    it is: its length is a key.
    """
    more = hub.face - face
    if hub.boss or more <= 0:
        return hub
    diameter, depth = hub.head
    return replace(
        hub,
        back=face,
        face=face,
        depth=hub.depth + more,
        head=(diameter, depth + more),
        lock_z=face,
    )
