"""Fasteners of the frame in their places: on the uprights, in the plate, of motor and hub."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from tbcad.geometry.rotations import bolt_circle
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.fasteners.fastener import Fastener
from tbcad.prototype.frame.brackets import Bracket
from tbcad.prototype.frame.purchased import PLATE_MM, HeadPlate, hub_point
from tbcad.prototype.purchased.choice import choose_screw
from tbcad.prototype.purchased.parts import Parts
from tbcad.spec.prototype import FrameSpec
from tbcad.types import Floats

ENGAGEMENT_MM = 4.0  # smallest length of a screw beyond what it holds
MOTOR_THREAD_MM = 3.0  # length of a screw in the motor
TNUT, WASHER = "TNUT-M5-6", "WASHER-5"


def on_uprights(
    name: str, places: Sequence[Floats], along: Floats, flange: float, parts: Parts
) -> tuple[Fastener, ...]:
    """Screws through a flange into T-nuts of the uprights.

    Args:
        name: of the body with the flange.
        places: on a face of the uprights, mm, (3,).
        along: unit vector into the uprights, (3,).
        flange: its thickness, mm.
        parts: lists of purchased parts.
    """
    screw, fasteners = choose_screw(parts, 5.0, flange + ENGAGEMENT_MM), list[Fastener]()
    for place in places:
        upright = "upright_left" if place[1] > 0 else "upright_right"
        fasteners.append(Fastener(screw, place - flange * along, along, (name, upright)))
        fasteners.append(Fastener(parts[TNUT], place, along, (upright,)))
    return tuple(fasteners)


def plate_fasteners(
    spec: FrameSpec, brackets: Iterable[Bracket], axes: Floats, parts: Parts
) -> Iterator[Fastener]:
    """Screws with washers through the brackets' feet into the base plate's threads."""
    screw = choose_screw(parts, 5.0, spec.flange_mm + 2 * ENGAGEMENT_MM)
    washer, down = parts[WASHER], -axes[2]
    for bracket in brackets:
        through = (bracket.component.name, "plate")
        for x, y in bracket.holes.tolist():
            place = np.array([x, y, spec.floor_mm + spec.flange_mm]) @ axes
            yield Fastener(washer, place, down, through[:1])
            yield Fastener(screw, place - washer["thickness_mm"] * down, down, through)


def motor_screw_places(drive: Drive) -> list[tuple[float, float]]:
    """Places (out, side) of the motor's screws on the head's plate, mm."""
    motor, centre = drive.motor, drive.centre_mm
    if motor.kind == "stages":
        return [(out, side) for out, side in bolt_circle(motor["hole_circle_mm"] / 2).tolist()]
    half = motor["hole_square_mm"] / 2
    return [(out, side) for out in (centre - half, centre + half) for side in (-half, half)]


def motor_fasteners(
    base: BaseLayout, drive: Drive, plate: HeadPlate, parts: Parts
) -> Iterator[Fastener]:
    """Screws through the head's plate into the motor behind it, or into the stage before it."""
    w = base.frame[0]
    if drive.motor.kind == "motors":
        screw = choose_screw(parts, 3.0, PLATE_MM + MOTOR_THREAD_MM)
        start, along, body = plate.front, -w, "motor"
    else:
        screw = choose_screw(parts, 6.0, PLATE_MM + 2 * MOTOR_THREAD_MM)
        start, along, body = plate.back, w, "rotary_stage"
    for out, side in motor_screw_places(drive):
        yield Fastener(screw, hub_point(base, start, out, side), along, ("bearing_head", body))
