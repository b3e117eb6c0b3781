"""What is bought for the head of the frame, in its place: bearings, shaft, wheels, motor."""

from dataclasses import dataclass

import numpy as np

from tbcad.geometry.primitives import Component, Cylinder, box, cylinder_between
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.drive import Drive, pitch_diameter
from tbcad.prototype.frame.brackets import SUNK_MM
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats

PLATE_MM = 9.0  # so that M3x12 screws go 3 mm into a motor
COUPLING_MM = 14.0  # length of a flange coupling with its gap to the motor; no list gives it
CLEAR_MM = 4.0  # between hub and motor's shaft in a coupling
PULLEY_RIM_MM = 1.5


@dataclass(frozen=True)
class Plan:
    """Sizes on the way: the plate between low and high out from the axis, half as wide."""

    front: float
    low: float
    high: float
    half: float

    @property
    def back(self) -> float:
        """Of the plate's other face."""
        return self.front - PLATE_MM


@dataclass(frozen=True)
class Bearings:
    """Parts on the shaft, where the tube round them ends, and its radius."""

    bearing: PurchasedPart
    shaft: PurchasedPart
    collar: PurchasedPart
    rear: float
    tube: float


def middles(plan: Plan, held: Bearings) -> tuple[float, ...]:
    """Middles of both bearings along the axis, mm."""
    half = held.bearing["width_mm"] / 2
    return plan.front - half, held.rear + half


def local(base: BaseLayout, along: float, out: float = 0.0, side: float = 0.0) -> Floats:
    """A point along the axis, out from it at azimuth zero, and across, in the shell's frame."""
    result: Floats = np.array([along, out, side]) @ base.frame
    return result


def along(base: BaseLayout, start: float, end: float, radius: float, out: float = 0.0) -> Cylinder:
    """A cylinder between two places along the axis, or beside it, mm."""
    return cylinder_between(local(base, start, out), local(base, end, out), radius)


def bought(
    base: BaseLayout, drive: Drive, plan: Plan, held: Bearings | None
) -> tuple[Component, ...]:
    """All bodies of purchased parts."""
    found = [_motor(base, drive, plan)]
    if drive.wheel and drive.pinion:
        found += [
            _wheel("wheel", base, drive.wheel, base.hub.face, 0.0, turns=True),
            _wheel("pinion", base, drive.pinion, base.hub.face, drive.centre_mm),
        ]
    if drive.coupling:
        one, start = drive.coupling, base.hub.face
        body = along(base, start, start - COUPLING_MM + 2, one["flange_mm"] / 2)
        found.append(Component("coupling", one.what, (body,), part=one.name, turns=True))
    return (*found, *(_running(base, plan, held) if held else ()))


def _running(base: BaseLayout, plan: Plan, held: Bearings) -> list[Component]:
    """Bearings, shaft and the collar that bears what the base weighs along the axis."""
    one, shaft, collar = held.bearing, held.shaft, held.collar
    end = base.hub.front - shaft["length_mm"]
    body = along(base, base.hub.front, end, shaft["diameter_mm"] / 2)
    found = [Component("shaft", shaft.what, (body,), part=shaft.name, turns=True)]
    names = ("bearing_front", "bearing_rear")
    for name, middle in zip(names, middles(plan, held), strict=True):
        ends = middle + one["width_mm"] / 2, middle - one["width_mm"] / 2
        hole = along(base, ends[0] + 1, ends[1] - 1, one["bore_mm"] / 2)
        ring = along(base, *ends, one["outer_mm"] / 2)
        found.append(Component(name, one.what, (ring,), (hole,), part=one.name))
    hole = along(base, held.rear + 1, end - 2, collar["bore_mm"] / 2)
    ring = along(base, held.rear, held.rear - collar["width_mm"], collar["outer_mm"] / 2)
    return [
        *found,
        Component("collar", collar.what, (ring,), (hole,), part=collar.name, turns=True),
    ]


def wheel_radius(part: PurchasedPart) -> float:
    """Radius of a toothed wheel over its rims, mm."""
    return pitch_diameter(part) / 2 + PULLEY_RIM_MM


def _wheel(
    name: str, base: BaseLayout, part: PurchasedPart, start: float, out: float, turns: bool = False
) -> Component:
    end, radius = start - part["width_mm"], wheel_radius(part)
    hole = along(base, start + 1, end - 1, part["bore_mm"] / 2, out)
    return Component(
        name,
        part.what,
        (along(base, start, end, radius, out),),
        (hole,),
        part=part.name,
        turns=turns,
    )


def _motor(base: BaseLayout, drive: Drive, plan: Plan) -> Component:
    """A motor behind the plate with its pilot and shaft, or a stage before it."""
    motor = drive.motor
    if motor.kind == "stages":
        body = along(base, base.hub.face, plan.front, motor["top_mm"] / 2)
        return Component("rotary_stage", motor.what, (body,), part=motor.name)
    half, out = motor["frame_mm"] / 2, drive.centre_mm
    low = np.array([plan.back - motor["length_mm"], out - half, -half])
    ends = plan.back - SUNK_MM, plan.back + motor["pilot_height_mm"]
    # Through the pinion, or into the coupling.
    tip = base.hub.face - (0.0 if drive.belt else CLEAR_MM)
    added = (
        box(low, np.array([plan.back, out + half, half]), base.frame),
        along(base, *ends, motor["pilot_mm"] / 2, out),
        along(base, plan.back, tip, motor["shaft_mm"] / 2, out),
    )
    return Component("motor", motor.what, added, part=motor.name)
