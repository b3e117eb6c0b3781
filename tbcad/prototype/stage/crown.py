"""The bodies of the stage: crown with pockets and channels, turning disc, post."""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.primitives import (
    Component,
    Cylinder,
    Primitive,
    Prism,
    Revolved,
    box,
    cylinder_between,
)
from tbcad.geometry.vectors import norm
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.prototype.stage.leds import POCKET_PLAY_MM, pillar_radius
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import StageSpec
from tbcad.types import Floats

DISC_MM = 3.0
INSIDE_MM = 0.3  # how far the crown stays inside the capture sphere
RIM_MM = 1.8  # its thickness at the rim
ARC = 8  # parts of its underside
SHOULDER_MM = 2.0
PLUG_MM, PLUG_PLAY_MM = 15.0, 0.1
SET_SCREW_MM = 2.8  # hole that an M3 set screw cuts its thread in
SEAT_MM = 1.0  # depth of the plug's hole for its end
GROOVE_MM = 1.6
OPEN_MM = 0.5  # by which a groove reaches into the pillar that it comes from
STUD_MM, STUD_HEIGHT_MM, STUD_PLAY_MM = 1.5, 2.5, 0.15
STUDS = 0.65  # of the disc's radius
POCKET = 0.75  # of an LED's body below the middle of its dome
THROUGH_MM = 1.0  # tools stick out
UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
SIDE = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True)
class Sizes:
    """Of the crown: heights of plate and joint, and radii (post's wall: thickness), mm."""

    plate: float
    rim: float
    neck: float
    wire: float
    post: float
    wall: float
    joint: float

    @property
    def plug(self) -> float:
        """Radius of the plug in the post."""
        return self.post - self.wall - PLUG_PLAY_MM


def crown(
    keys: StageSpec, led: PurchasedPart, leds: Floats, pockets: Floats, at: Sizes
) -> Component:
    """Plate, neck and plug in one turned body, with pillars and studs on it."""
    studs = [
        Cylinder(np.array([*place, at.plate - 1]), np.array(UP), _stud(keys), STUD_HEIGHT_MM + 1)
        for place in _studs(keys, leds, at.wire)
    ]
    added: list[Primitive] = [Revolved(_profile(at)), *studs]
    removed: list[Primitive] = []
    for place, floor in zip(leds, pockets.tolist(), strict=True):
        middle = float(place[2])
        end = floor + POCKET * (middle - floor)
        foot, top = np.array([*place[:2], at.plate - INSIDE_MM]), np.array([*place[:2], end])
        added.append(cylinder_between(foot, top, pillar_radius(keys, led)))
        removed += _pocket(keys, led, place, floor, end, at.plate)
    inward = np.array([*(SIDE[:2] * (at.plug - SEAT_MM)), at.joint - PLUG_MM / 2])
    removed.append(Cylinder(inward, SIDE, SET_SCREW_MM / 2, SEAT_MM + THROUGH_MM))
    return Component(
        "stage_crown",
        "crown of the object stage with pockets for LEDs",
        tuple(added),
        tuple(removed),
        (UP, DOWN),
    )


def _profile(at: Sizes) -> Floats:
    """The crown's section (z, r) from the plate's middle round to the bore."""
    inside = float(np.hypot(at.rim, at.plate - RIM_MM))
    # Chords of the sphere stay inside of it.
    turn = np.linspace(np.arcsin(at.rim / inside), np.arcsin(at.neck / inside), ARC + 1)
    arc = inside * np.stack([-np.cos(turn), np.sin(turn)], axis=1)
    shoulder = at.joint + SHOULDER_MM
    low = at.joint - PLUG_MM
    return np.vstack(
        [
            [[at.plate, at.wire], [at.plate, at.rim]],
            arc,
            [[shoulder + at.post - at.neck, at.neck], [shoulder, at.post], [at.joint, at.post]],
            [[at.joint, at.plug], [low, at.plug], [low, at.wire]],
        ]
    )


def _pocket(
    keys: StageSpec, led: PurchasedPart, place: Floats, floor: float, end: float, plate: float
) -> list[Primitive]:
    """Pocket, the wires' way down, and their groove to the bore."""
    hole, groove = led["flange_mm"] / 2 + POCKET_PLAY_MM, plate - GROOVE_MM
    low, middle = np.array([*place[:2], groove]), np.array([*place[:2], floor])
    return [
        cylinder_between(middle, np.array([*place[:2], end + THROUGH_MM]), hole),
        cylinder_between(low, middle + THROUGH_MM * np.array(UP), keys.wire_mm / 2),
        _groove(keys, place, groove, plate + OPEN_MM),
    ]


def _groove(keys: StageSpec, place: Floats, low: float, high: float) -> Prism:
    out = np.array([*place[:2], 0.0]) / norm(place[:2])
    axes = np.stack([out, np.cross(UP, out), UP])
    half, length = keys.wire_mm / 2, float(norm(place[:2]))
    return box(np.array([0.0, -half, low]), np.array([length, half, high]), axes)


def _stud(keys: StageSpec) -> float:
    return min(STUD_MM, keys.disc_mm / 10)


def _studs(keys: StageSpec, leds: Floats, wire: float) -> Floats:
    """Places (2, 2) of the disc's studs, where they are farthest from the grooves."""
    away = max(STUDS * keys.disc_mm / 2, wire + 0.2 + _stud(keys))
    if away + _stud(keys) + 0.8 > keys.disc_mm / 2:
        raise SpecError(
            f"prototype.stage.disc_mm {keys.disc_mm:g} has no room for its studs: make it at least "
            f"{2 * (away + _stud(keys) + 0.8):.1f}"
        )
    turn = np.radians(np.arange(0, 180, 5.0))
    azimuth = np.arctan2(leds[:, 1], leds[:, 0])
    apart = np.abs(np.sin(turn[:, None] - azimuth)).min(axis=1, initial=1.0)
    best = float(turn[np.round(apart, 9).argmax()])
    if away * apart.max() < _stud(keys) + keys.wire_mm / 2:
        raise SpecError(
            "prototype.stage.leds_mm: the wires' grooves leave no room for the disc's studs: move "
            "LEDs to more even azimuths, or make prototype.stage.wire_mm smaller"
        )
    one = away * np.array([np.cos(best), np.sin(best)])
    return np.stack([one, -one])


def disc(keys: StageSpec, leds: Floats, plate: float, wire: float) -> Component:
    """The disc under the object; its holes take the studs two ways round, half a turn apart."""
    holes = _studs(keys, leds, wire)
    radius = _stud(keys) + STUD_PLAY_MM
    low = plate - THROUGH_MM
    return Component(
        "stage_disc",
        "disc under the object, turned by 180 degrees for the other half",
        (Cylinder(np.array([0, 0, plate]), np.array(UP), keys.disc_mm / 2, DISC_MM),),
        tuple(
            Cylinder(np.array([*at, low]), np.array(UP), radius, DISC_MM + 2 * THROUGH_MM)
            for at in holes
        ),
        (DOWN,),
    )


def post_tube(post: float, wall: float, joint: float, foot: float) -> Component:
    """A tube, with a hole for the set screw that holds the plug."""
    top, bottom = np.array([0, 0, joint]), np.array([0, 0, foot])
    beyond = np.array([0, 0, THROUGH_MM])
    screw = Cylinder(top - [0, 0, PLUG_MM / 2], SIDE, SET_SCREW_MM / 2, post + THROUGH_MM)
    return Component(
        "stage_post",
        "post of the object stage",
        (cylinder_between(bottom, top, post),),
        (cylinder_between(bottom - beyond, top + beyond, post - wall), screw),
        (DOWN, UP, (1.0, 0.0, 0.0)),
    )
