"""The carrier: magnets and what hub and joints need in their places; how it is put together."""

from collections.abc import Iterator

import numpy as np

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned
from tbcad.prototype.base.hub import (
    BELOW_HEAD_MM,
    KEY_DEPTH_MM,
    KEY_MM,
    SET_SCREW_AZIMUTHS,
    ZERO_DISC_MM,
)
from tbcad.prototype.base.joints import M3_MM, MIN_ENGAGEMENT_MM, Joint, by_length, joint_hardware
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import meridian
from tbcad.prototype.base.split import BaseSplit
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.part import Part
from tbcad.prototype.purchased.parts import (
    SAME_SIZE_MM,
    Parts,
    PurchasedPart,
    choose_screw,
    of_kind,
)
from tbcad.records.prototype import MATT_BLACK
from tbcad.types import Floats

COUPLING_FLANGE_MM = 3.0  # thickness; no list gives it
M6_MM, M6_ENGAGEMENT_MM = 6.0, 6.0  # of a screw in a stage, and its length in the thread
AXIS, ACROSS = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


def base_fasteners(
    base: BaseLayout, split: BaseSplit, drive: Drive, parts: Parts
) -> list[Fastener]:
    """Fasteners of the base; SpecError when a part is in no list."""
    places = _Places(base, split)
    return [
        *_magnets(places, parts),
        *_hub_inserts(places, parts),
        *_lock(places, parts),
        _key(places, parts),
        *_drive_screws(places, drive, parts),
        *(one for joint in split.joints for one in _joint(places, joint, parts)),
    ]


class _Places:
    """Fasteners whose places are in the carrier's own frame."""

    def __init__(self, base: BaseLayout, split: BaseSplit) -> None:
        self.base, self.split = base, split

    def piece(self, point: Floats) -> str:
        """Name of the piece of the carrier that a point (3,) is in."""
        return f"carrier_{self.split.piece_of(point) + 1}" if self.split.joints else "carrier"

    def fastener(
        self, part: PurchasedPart, place: Floats, along: Floats, *through: str
    ) -> Fastener:
        """A fastener; without names it is in the piece at its place."""
        axes = self.base.axes
        names = through or (self.piece(place + SAME_SIZE_MM * along),)
        return Fastener(part, place @ axes, along @ axes, names, rotates=True)


def _magnets(places: _Places, parts: Parts) -> Iterator[Fastener]:
    """Magnets behind the balls; those in caps are not among them."""
    seats = places.base.local_seats
    start, ends = seats.at_depth(seats.bottom - seats.magnet_height), seats.at_depth(seats.back)
    for k, part in enumerate(seat_magnets(places.base, parts)):
        if part:
            yield places.fastener(part, start[k], seats.axis[k], places.piece(ends[k]))


def seat_magnets(base: BaseLayout, parts: Parts) -> list[PurchasedPart | None]:
    """The magnet behind each ball, None for glue; SpecError when one is in no list."""
    sizes = np.column_stack([base.seats.magnet, base.seats.magnet_height]).tolist()
    return [
        magnet_part(diameter, height, parts) if diameter else None for diameter, height in sizes
    ]


def magnet_part(diameter: float, height: float, parts: Parts) -> PurchasedPart:
    """The disc magnet of a diameter and a height, mm; SpecError when it is in no list."""
    for part in of_kind(parts, "magnets", diameter_mm=diameter, height_mm=height):
        return part
    raise SpecError(
        f"no magnet of {diameter:g} x {height:g} mm is in magnets.csv: change "
        "prototype.base.magnets_mm, magnet_height_mm or strong_magnet_height_mm"
    )


def _hub_inserts(places: _Places, parts: Parts) -> Iterator[Fastener]:
    hub, spec = places.base.hub, places.base.spec
    if abs(hub.hole - spec.insert_hole_mm) < SAME_SIZE_MM:
        for hole in hub.holes:
            yield places.fastener(m3_insert(spec, parts), np.array([*hole, hub.face]), AXIS)


def _lock(places: _Places, parts: Parts) -> Iterator[Fastener]:
    """Inserts and screws that hold the shaft in the hub."""
    hub, spec = places.base.hub, places.base.spec
    if hub.lock == "set-screws":
        # It stands out of the boss a little rather than grip too little.
        insert, middle = m3_insert(spec, parts), hub.lock_z * AXIS
        grip = hub.boss - insert["length_mm"] + M3_MM - hub.bore
        refusal = f"no M3 set screw of at least {grip:.1f} mm is in setscrews.csv: add one"
        screw = by_length(parts, "setscrews", refusal, grip, thread_mm=M3_MM)[0]
        end = hub.bore + screw["length_mm"]
        for azimuth in SET_SCREW_AZIMUTHS.tolist():
            out = meridian(azimuth)[0]
            yield places.fastener(insert, middle + hub.boss * out, -out)
            yield places.fastener(screw, middle + end * out, -out, places.piece(middle))
    elif hub.lock == "clamp":
        middle = np.array([-(hub.bore + hub.boss) / 2, 0.0, hub.lock_z])
        half = float(np.sqrt(hub.boss**2 - middle[0] ** 2)) * ACROSS
        yield places.fastener(m3_insert(spec, parts), middle + half, -ACROSS)
        room = 2 * float(half[1])
        refusal = f"no M3 screw of at most {room:.1f} mm is in screws.csv: add one"
        screw = by_length(parts, "screws", refusal, high=room, thread_mm=M3_MM)[-1]
        yield places.fastener(screw, middle - half, ACROSS)


def _key(places: _Places, parts: Parts) -> Fastener:
    """The longest dowel through the zero disc into the hub's hole."""
    hub, room = places.base.hub, ZERO_DISC_MM + KEY_DEPTH_MM
    refusal = f"no dowel of {KEY_MM:g} mm is at most {room:g} mm long: add one"
    part = by_length(parts, "dowels", refusal, high=room, diameter_mm=KEY_MM)[-1]
    piece = places.piece(np.array([*hub.key, hub.face + SAME_SIZE_MM]))
    return places.fastener(part, np.array([*hub.key, hub.mount]), AXIS, "zero_disc", piece)


def _drive_screws(places: _Places, drive: Drive, parts: Parts) -> Iterator[Fastener]:
    """Screws that hold wheel, coupling or stage and the zero disc to the hub."""
    hub = places.base.hub
    carrier = places.piece(np.array([*hub.holes[0], hub.face + SAME_SIZE_MM]))
    if drive.motor.kind == "motors":
        body = "wheel" if drive.wheel else "coupling"
        on_hub = drive.wheel["width_mm"] if drive.wheel else COUPLING_FLANGE_MM
        screw = choose_screw(parts, M3_MM, on_hub + ZERO_DISC_MM + MIN_ENGAGEMENT_MM)
        start, along, through = hub.mount - on_hub, AXIS, (body, "zero_disc", carrier)
    else:
        screw = choose_screw(parts, M6_MM, BELOW_HEAD_MM + ZERO_DISC_MM + M6_ENGAGEMENT_MM)
        start, along = hub.front - hub.head[1], -AXIS
        through = (carrier, "zero_disc", "rotary_stage_top")
    for hole in hub.holes:
        yield places.fastener(screw, np.array([*hole, start]), along, *through)


def _joint(places: _Places, joint: Joint, parts: Parts) -> Iterator[Fastener]:
    spec, normal = places.base.spec, joint.plane.normal
    hardware = joint_hardware(spec)
    dowel, screw = parts[hardware.dowel], parts[hardware.screw]

    def pieces(at: Floats, along: Floats) -> tuple[str, str]:
        return places.piece(at - along), places.piece(at + along)

    for at in joint.dowels:
        start = at - dowel["length_mm"] / 2 * normal
        yield places.fastener(dowel, start, normal, *pieces(at, normal))
    for at, head in zip(joint.screws, joint.heads.tolist(), strict=True):
        along = -head * normal
        through = pieces(at, along)
        yield places.fastener(screw, at - spec.joint_mm * along, along, *through)
        yield places.fastener(m3_insert(spec, parts), at, along, through[1])


def m3_insert(spec: BaseSpec, parts: Parts) -> PurchasedPart:
    """The longest M3 insert that the holes of the spec take; SpecError when there is none."""
    refusal = (
        f"no M3 insert for holes of {spec.insert_hole_mm:g} mm, {spec.insert_depth_mm:g} mm deep, "
        "is in inserts.csv: change prototype.base.insert_hole_mm or insert_depth_mm"
    )
    sizes = {"thread_mm": M3_MM, "hole_mm": spec.insert_hole_mm}
    return by_length(parts, "inserts", refusal, high=spec.insert_depth_mm, **sizes)[-1]


@planned("Try the seats", "coupon_*")
def coupon_step(machine: AssembledMachine) -> Values:
    """The coupons, before the carrier is printed."""
    names = [machine.body_ref(body) for body in machine.bodies if body.startswith("coupon_")]
    black = sum(part.finish == MATT_BLACK for part in machine.record.parts)
    return {"names": ", ".join(names), "black": black}


@planned("The carrier", "carrier", "carrier_*", loose=("GLUE-EPOXY",))
def carrier_step(machine: AssembledMachine) -> Values:
    """Words for parts glued and pressed into the carrier, and for its joints."""
    cut, shaft = machine.has("carrier_1"), machine.has("shaft")
    magnets = [one for one in machine.record.holding.balls if one.by == "magnet"]
    part = machine.listed(machine.bodies["shaft"]) if shaft else None
    return {
        "shaft": shaft,
        "size": f" {part['diameter_mm']:g} H7" if part else "",
        "cut": cut,
        "inserted": "hub and the joints" if cut else "hub",
        "magnets": [{"ball": one.ball, "magnet": machine.ref(one.magnet or "")} for one in magnets],
        "glue": not magnets,
    }


COUPON, CARRIER = Part((coupon_step,)), Part((carrier_step,))
