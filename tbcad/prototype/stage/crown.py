"""The components of the stage: crown with pockets, channels and arms, turning disc, post.

An arm carries an LED beside the object: out of the crown below the object's room, then upward,
where the room leaves the capture sphere free. Its section is in the upright plane through the
post's axis and the LED, in coordinates (r, z) from the axis, mm.
"""

from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import (
    Component,
    Cylinder,
    Primitive,
    Prism,
    Revolved,
    box,
    cylinder_between,
)
from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import StageSpec
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.prototype.stage.leds import POCKET_PLAY_MM, pillar_radius
from tbcad.types import Floats

DISC_MM = 3.0  # thickness of the disc
INSIDE_MM = 0.3  # how far the crown stays inside the capture sphere
RIM_MM = 1.8  # thickness of the crown at its rim
ARC_CHORDS = 8  # of the crown's underside
SHOULDER_MM = 2.0  # height of the post's full width above the joint
PLUG_MM, PLUG_PLAY_MM = 15.0, 0.1  # length of the plug in the post, and its play
SET_SCREW_MM = 2.8  # hole that an M3 set screw's end goes into
TAPPED_M3_MM = 2.5
WIRES_MM = 6.0  # hole for the wires in the post
SEAT_MM = 1.0  # depth of the plug's hole for the set screw's end
GROOVE_MM = 1.6  # depth of the wires' grooves
OPEN_MM = 0.5  # by which a groove reaches into the pillar that it comes from
STUD_MM, STUD_HEIGHT_MM, STUD_PLAY_MM = 1.5, 2.5, 0.15  # largest radius, height, play in the disc
DISC_PER_STUD = 10.0  # smallest ratio of the diameter of the disc to the radius of a stud
STUD_PLACE = 0.65  # of the disc's radius
STUD_GAP_MM, STUD_EDGE_MM = 0.2, 1.4  # material between a stud and the bore, and the disc's edge
POCKET = 0.75  # height of a pocket's wall: share of the LED's body below the centre of its dome
THROUGH_MM = 1.0  # by which a removed body extends beyond the part
ROOM_GAP_MM = 0.1  # between arms and the level of the disc's face, above which the object may be
ROOT_SHARE = 0.4  # of the plate's width, from its rim inward, that an arm's root covers
ROOT_MM = 1.0  # by which studs reach into the plate
SCREW_DIRECTION = np.array([0.0, -1.0, 0.0])
LEVEL = np.array([1.0, 0.0, 0.0])
ARM_CHORDS = 6  # along the sphere, of each part
LAP_MM = 1.0  # by which one part reaches into the other, and grooves beyond their ends
ARM_GROOVE_MM = 0.8  # depth of the wires' groove in the arm's inner face
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
            np.vstack([upper, self._arc(max(direction, end), bottom), under]),
            np.vstack([top, self._arc(side, end)]),
        )
        return [self._prism(section, self.half_width) for section in sections]

    def grooves(self, width: float) -> list[Prism]:
        """The wires' way from the pocket's floor along the inner faces to the crown's plate."""
        half, middle = width / 2, self.inner + self.half_width
        root, corner = np.array(self.root), np.array([self.inner, self.turn])
        along = unit(corner - root)
        deep, above = ARM_GROOVE_MM * np.array([along[1], -along[0]]), LAP_MM * UP[1:]
        start, end = root - LAP_MM * along, corner
        round_it = np.add(end, [ARM_GROOVE_MM, 0.0])
        slanting = np.array([start + deep, end + deep, round_it, end + above, start + above])
        top = self.floor + LAP_MM
        return [
            self._prism(slanting, half),
            self._box((self.inner - LAP_MM, self.turn), (self.inner + ARM_GROOVE_MM, top), half),
            self._box(
                (self.inner - LAP_MM, self.floor - ARM_GROOVE_MM), (middle + half, top), half
            ),
        ]

    def _arc(self, first: float, last: float) -> Floats:
        """Points (k, 2) on the sphere between two angles from the horizon, radians."""
        angle = np.linspace(first, last, ARM_CHORDS + 1)
        return np.asarray(self.sphere * np.column_stack([np.cos(angle), np.sin(angle)]))

    def _prism(self, section: Floats, half: float) -> Prism:
        across = np.full(len(section), -half)
        corners = np.column_stack([section[:, 0], across, section[:, 1]]) @ self.axes
        return Prism(corners, 2 * half * self.axes[1])

    def _box(self, low: tuple[float, float], high: tuple[float, float], half: float) -> Prism:
        return box((low[0], -half, low[1]), (high[0], half, high[1]), self.axes)


def arm_axes(dome: Floats) -> Floats:
    """Rows out from the post's axis to a place (3,), across, and up, (3, 3)."""
    out = np.array([*dome[:2], 0.0]) / norm(dome[:2])
    return np.stack([out, np.cross(UP, out), UP])


@dataclass(frozen=True)
class CrownSizes:
    """Sizes of the crown, mm."""

    plate: float  # z of its upper face
    rim: float  # radius of its rim
    neck: float  # radius where it leaves the capture sphere
    wire: float  # radius of its bore for the wires
    post: float  # radius of the post
    wall: float  # thickness of the post's wall
    joint: float  # z of the post's upper end

    @property
    def plug(self) -> float:
        """Radius of the plug in the post."""
        return self.post - self.wall - PLUG_PLAY_MM


def crown_component(
    stage: StageSpec, led: PurchasedPart, leds: Floats, pockets: Floats, sizes: CrownSizes
) -> Component:
    """Plate, neck and plug in one revolved body, with studs and pillars or arms for LEDs on it."""
    stud, root = _stud_radius(stage), sizes.plate - ROOT_MM
    pillar = pillar_radius(stage, led)
    added: list[Primitive] = [Revolved(_profile(sizes))]
    added += [
        Cylinder(np.array([*place, root]), UP, stud, STUD_HEIGHT_MM + ROOT_MM)
        for place in _stud_places(stage, leds, sizes.wire)
    ]
    removed: list[Primitive] = []
    for dome, floor in zip(leds, pockets.tolist(), strict=True):
        rim, arm = floor + POCKET * (float(dome[2]) - floor), led_arm(dome, pillar, floor, sizes)
        foot = np.array([*dome[:2], (floor if arm else sizes.plate) - INSIDE_MM])
        added.append(cylinder_between(foot, np.array([*dome[:2], rim]), pillar))
        added += arm.bodies() if arm else []
        removed += _pocket(stage, led, dome, (floor, rim), sizes.plate, arm)
    seat = (sizes.plug - SEAT_MM) * SCREW_DIRECTION + [0, 0, sizes.joint - PLUG_MM / 2]
    removed.append(Cylinder(seat, SCREW_DIRECTION, SET_SCREW_MM / 2, SEAT_MM + THROUGH_MM))
    return Component(
        "stage_crown",
        "crown of the object stage with pockets for LEDs",
        tuple(added),
        tuple(removed),
        (UP, -UP),
    )


def _profile(sizes: CrownSizes) -> Floats:
    """The crown's section (z, r) from the plate's middle round to the bore."""
    inside = float(np.hypot(sizes.rim, sizes.plate - RIM_MM))
    # Chords of the sphere stay inside of it.
    polar = np.linspace(
        np.arcsin(sizes.rim / inside), np.arcsin(sizes.neck / inside), ARC_CHORDS + 1
    )
    arc = inside * np.stack([-np.cos(polar), np.sin(polar)], axis=1)
    joint, shoulder, low = sizes.joint, sizes.joint + SHOULDER_MM, sizes.joint - PLUG_MM
    cone = [[shoulder + sizes.post - sizes.neck, sizes.neck], [shoulder, sizes.post]]
    plug = [[joint, sizes.plug], [low, sizes.plug], [low, sizes.wire]]
    plate = [[sizes.plate, sizes.wire], [sizes.plate, sizes.rim]]
    return np.vstack([plate, arc, cone, [[joint, sizes.post]], plug])


def _pocket(
    stage: StageSpec,
    led: PurchasedPart,
    dome: Floats,
    heights: tuple[float, float],
    plate: float,
    arm: Arm | None,
) -> list[Primitive]:
    """Pocket between two heights, the wires' way down, and their groove to the bore."""
    (floor, rim), half = heights, stage.wire_mm / 2
    radius, groove = led["flange_mm"] / 2 + POCKET_PLAY_MM, plate - GROOVE_MM
    low, bottom = np.array([*dome[:2], groove]), np.array([*dome[:2], floor])
    length = arm.root[0] if arm else float(norm(dome[:2]))
    way = cylinder_between(low, bottom + THROUGH_MM * UP, half)
    return [
        cylinder_between(bottom, np.array([*dome[:2], rim + THROUGH_MM]), radius),
        *(arm.grooves(stage.wire_mm) if arm else [way]),
        box((0.0, -half, groove), (length, half, plate + OPEN_MM), arm_axes(dome)),
    ]


def led_arm(dome: Floats, pillar: float, floor: float, sizes: CrownSizes) -> Arm | None:
    """The arm of an LED (3,) whose pillar does not stand on the plate; None where it does."""
    distance = float(norm(dome[:2]))
    if distance + pillar <= sizes.rim:
        return None
    return Arm(
        axes=arm_axes(dome),
        inner=distance - pillar,
        outer=distance + pillar,
        floor=floor,
        turn=sizes.plate + DISC_MM - ROOM_GAP_MM,
        root=(sizes.rim - ROOT_SHARE * (sizes.rim - sizes.wire), sizes.plate),
        low=sizes.plate - RIM_MM,
        sphere=float(np.hypot(sizes.rim, sizes.plate - RIM_MM)),
    )


def _stud_radius(stage: StageSpec) -> float:
    return min(STUD_MM, stage.disc_mm / DISC_PER_STUD)


def _stud_places(stage: StageSpec, leds: Floats, wire: float) -> Floats:
    """Places (2, 2) of the disc's studs, where they are farthest from the grooves."""
    stud = _stud_radius(stage)
    outmost, inmost = stage.disc_mm / 2 - stud - STUD_EDGE_MM, wire + STUD_GAP_MM + stud
    radius = max(min(STUD_PLACE * stage.disc_mm / 2, outmost), inmost)
    min_disc = radius + stud + STUD_EDGE_MM
    if min_disc > stage.disc_mm / 2:
        raise SpecError(
            f"prototype.stage.disc_mm {stage.disc_mm:g} has no room for its studs: make it at "
            f"least {2 * min_disc:.1f}"
        )
    candidates = np.radians(np.arange(0, 180, 5.0))
    azimuth = np.arctan2(leds[:, 1], leds[:, 0])
    apart = np.abs(np.sin(candidates[:, None] - azimuth)).min(axis=1, initial=1.0)
    best = candidates[np.round(apart, 9).argmax()]
    if radius * apart.max() < stud + stage.wire_mm / 2:
        raise SpecError(
            "prototype.stage.leds_mm: the wires' grooves leave no room for the disc's studs: move "
            "LEDs to more even azimuths, or make prototype.stage.wire_mm smaller"
        )
    place = radius * unit_circle(best)
    return np.stack([place, -place])


def disc_component(stage: StageSpec, leds: Floats, sizes: CrownSizes) -> Component:
    """The disc under the object; its holes take the studs two ways round, half a turn apart."""
    low = sizes.plate - THROUGH_MM
    radius, depth = _stud_radius(stage) + STUD_PLAY_MM, DISC_MM + 2 * THROUGH_MM
    return Component(
        "stage_disc",
        "disc under the object, turned by 180 degrees for the other half",
        (Cylinder(np.array([0, 0, sizes.plate]), UP, stage.disc_mm / 2, DISC_MM),),
        tuple(
            Cylinder(np.array([*place, low]), UP, radius, depth)
            for place in _stud_places(stage, leds, sizes.wire)
        ),
        (-UP,),
    )


def post_component(sizes: CrownSizes, tube: PurchasedPart, foot: float, wires: float) -> Component:
    """A tube down to a height (mm), with a thread for the set screw that holds the plug.

    In line with it is a hole for the wires, at another height.
    """
    top, bottom = np.array([0, 0, sizes.joint]), np.array([0, 0, foot])
    beyond = np.array([0, 0, THROUGH_MM])
    screw, way = top - [0, 0, PLUG_MM / 2], np.array([0, 0, wires])
    long = sizes.post + THROUGH_MM
    return Component(
        "stage_post",
        f"{tube.what}, cut to {sizes.joint - foot:.1f} mm",
        (cylinder_between(bottom, top, sizes.post),),
        (
            cylinder_between(bottom - beyond, top + beyond, sizes.post - sizes.wall),
            Cylinder(screw, SCREW_DIRECTION, TAPPED_M3_MM / 2, long),
            Cylinder(way, SCREW_DIRECTION, min(WIRES_MM, sizes.post) / 2, long),
        ),
        part=tube.name,
    )
