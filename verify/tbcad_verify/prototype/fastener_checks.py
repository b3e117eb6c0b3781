"""Every fastener is in holes that it fits, grips what it is screwed into, and no hole lacks one.

Places are the record's, sizes those of the parts' names and of standards, holes and bodies those of
the STEP assembly. Threads are drawn at their core in screws, at their nominal diameter in nuts.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import RECORD, PlacedFastener
from tbcad_verify.report.checks import Check, CheckName, no_faults, short_list
from tbcad_verify.step.solids_text import RoundFace, TextSolid, cross_length, distance_to_line
from tbcad_verify.types import Floats

FILE = RECORD
CHECKS = {"fasteners": "faults", "fastener holes": "faults"}
SAME_MM = 1e-6
PARALLEL = 1e-9
# Pitch by nominal diameter (ISO 261, 1/4-20 UNC); a core is smaller by CORE of it (ISO 68-1).
PITCH_MM = {2.0: 0.4, 3.0: 0.5, 4.0: 0.7, 5.0: 0.8, 6.0: 1.0, 6.35: 1.27}
CORE = 1.226869
INSERTS = {"INSERT-M3": (4.0, 5.7), "INSERT-M3-SHORT": (4.0, 3.0), "INSERT-M4": (5.6, 8.1)}
INSERTS |= {"INSERT-M5": (6.4, 9.5)}  # hole and length, mm
WASHERS = {"WASHER-3": (7.0, 0.5), "WASHER-4": (9.0, 0.8), "WASHER-5": (10.0, 1.0)}  # ISO 7089
NUTS_MM = {"3": 2.4, "4": 3.2, "5": 4.7}  # height, ISO 4032
LEDS = {"LED-3": 3.0, "LED-5": 5.0}  # diameter of the body
TNUT_MM = (0.5, 4.5)  # where its thread begins and ends below the slot's face
# Diameters of holes that are fasteners' only (ISO 273 medium, tapped, pilots), by what they are in.
IN_PLATE_MM = (4.2,)
IN_PRINTED_MM = (2.0, 2.8, 3.4, 4.5, 5.5, 6.6)
# Drawn without holes: bodies of catalogue parts.
SOLID = frozenset(
    {
        *("motor", "rotary_stage", "rotary_stage_top", "camera"),
        *("upright_left", "upright_right", "lamp_post_left", "lamp_post_right"),
    }
)
# Smallest grip in nominal diameters: in an insert or aluminium; in a steel nut (thin, ISO 4035).
GRIP, GRIP_NUT = 1.0, 0.5
INSERT = "INSERT-"
BRACKETS = "BRACKET-"  # bought, and drawn with their holes
NUTS = (INSERT, "TNUT-", "NUT-")  # what a screw is turned into
MOTOR_DEPTH_MM = 4.5  # of the thread in a NEMA 17 motor's face


class Size(NamedTuple):
    """Radius of a round face that the body must have, where it begins and ends along, mm.

    The nominal diameter of a thread is zero where there is none. What lies on a part covers a hole
    and is not in it.
    """

    radius: float
    low: float
    high: float
    thread: float = 0.0
    hollow: bool = False
    covers: bool = False


def _screw(thread: str, length: str) -> Size:
    nominal = float(thread)
    return Size((nominal - CORE * PITCH_MM[nominal]) / 2, 0.0, float(length), nominal)


NUMBER = r"(\d+(?:\.\d+)?)"
KINDS: dict[str, Callable[..., Size]] = {
    rf"(?:SET-)?M{NUMBER}x{NUMBER}": _screw,
    rf"UNC1/4-20x{NUMBER}": lambda length: _screw("6.35", length),
    rf"(?:DOWEL|MAGNET)-{NUMBER}x{NUMBER}": lambda wide, long: Size(
        float(wide) / 2, 0.0, float(long)
    ),
    r"(INSERT-\S+)": lambda name: Size(INSERTS[name][0] / 2, 0.0, INSERTS[name][1]),
    r"(WASHER-\d)": lambda name: Size(WASHERS[name][0] / 2, -WASHERS[name][1], 0.0, covers=True),
    r"NUT-M(\d)": lambda thread: Size(
        float(thread) / 2, 0.0, NUTS_MM[thread], hollow=True, covers=True
    ),
    r"TNUT-M(\d)-\d+": lambda thread: Size(float(thread) / 2, *TNUT_MM, hollow=True),
}


def size_of(part: str) -> Size | None:
    """Size by the name of a part; None where the name tells none, as of LEDs."""
    for pattern, size in KINDS.items():
        if match := re.fullmatch(pattern, part):
            try:
                return size(*match.groups())
            except KeyError:
                return None
    return None


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """Fasteners against holes, and holes against fasteners, in the solids of the STEP assembly."""
    found = _fastener_faults(context, solids), _hole_faults(context, solids)
    return [no_faults(*pair) for pair in zip(names, found, strict=True)]


def _fastener_faults(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    fasteners = context.prototype.fasteners
    turning = {part.name for part in context.prototype.parts if part.role in ("base", "cap")}
    turning |= {body.name for body in context.prototype.bought if body.turns}
    for one in fasteners:
        others = [name for name in one.through if one.turns != (name in turning)]
        if others:
            yield f"{one.name} turns otherwise than {short_list(others)}"
        yield from (f"{one.name} {fault}" for fault in faults_of(one, fasteners, solids))


def faults_of(
    one: PlacedFastener, others: list[PlacedFastener], solids: Mapping[str, TextSolid]
) -> Iterator[str]:
    """Faults of a fastener."""
    size, missing = (
        size_of(one.part),
        [name for name in (one.name, *one.through) if name not in solids],
    )
    if missing:
        yield f"needs {short_list(missing)} in the assembly"
    elif one.part in LEDS:
        faces = _coaxial(one, solids[one.name])
        if not any(abs(face.radius - LEDS[one.part] / 2) <= SAME_MM for face in faces):
            yield "is drawn elsewhere"
    elif not size:
        yield f"is of an unknown part {one.part}"
    else:
        if not _is_drawn(one, size, solids[one.name]):
            yield "is drawn elsewhere, or of another size"
        for name in one.through:
            if name not in SOLID and not _hole_depth(one, size, solids[name]):
                yield f"has no hole in {name}"
        if size.thread and not _grips(one, size, others, solids):
            yield f"grips too little in {one.through[-1]}"


def _is_drawn(one: PlacedFastener, size: Size, body: TextSolid) -> bool:
    """Whether the body has the face that a part of this size has in this place."""
    return any(
        face.hollow == size.hollow
        and abs(face.radius - size.radius) <= SAME_MM
        and bool(np.abs(np.subtract(_span(one, face), (size.low, size.high))).max() <= SAME_MM)
        for face in _coaxial(one, body)
    )


def _parallel(one: PlacedFastener, solid: TextSolid) -> list[RoundFace]:
    cylinders = [face for face in solid.faces if face.kind == "cylinder"]
    return [face for face in cylinders if cross_length(face.axis, one.along) <= PARALLEL]


def _coaxial(one: PlacedFastener, solid: TextSolid) -> list[RoundFace]:
    return [face for face in _parallel(one, solid) if _is_on(one, face.point)]


def _is_on(one: PlacedFastener, point: Floats) -> bool:
    """Whether a point is on a fastener's axis."""
    return distance_to_line(point, one.position, one.along) <= SAME_MM


def _span(one: PlacedFastener, face: RoundFace) -> tuple[float, float]:
    """Where a parallel face begins and ends along a fastener, from its place, mm."""
    shift, sign = (face.point - one.position) @ one.along, np.sign(face.axis @ one.along)
    ends = sorted(float(shift + sign * end) for end in face.span)
    return ends[0], ends[1]


def _hole_depth(one: PlacedFastener, size: Size, solid: TextSolid) -> float:
    """Largest length over which a fastener is in a hole, or a slot's middle, of a solid, mm.

    Of a washer or nut, the hole's.
    """
    spans = _hole_spans(one, size, solid)
    if size.covers:
        return max([0.0, *(high - low for low, high in spans)])
    return max([0.0, *(min(high, size.high) - max(low, size.low) for low, high in spans)])


def _hole_spans(one: PlacedFastener, size: Size, solid: TextSolid) -> list[tuple[float, float]]:
    """Where holes, or middles of slots, that a fastener fits begin and end along it, mm."""
    hollow = [face for face in _parallel(one, solid) if face.hollow]
    wide = [face for face in hollow if size.covers or face.radius >= size.radius - SAME_MM]
    return [_span(one, face) for k, face in enumerate(wide) if _holds(one, face, wide[:k])]


def _holds(one: PlacedFastener, face: RoundFace, others: list[RoundFace]) -> bool:
    """Whether a hollow face is round a fastener, or with another one a slot's end round it."""
    return _is_on(one, face.point) or any(
        abs(face.radius - other.radius) <= SAME_MM and _is_on(one, (face.point + other.point) / 2)
        for other in others
    )


def _grips(
    one: PlacedFastener, size: Size, others: list[PlacedFastener], solids: Mapping[str, TextSolid]
) -> bool:
    """Whether a screw is long enough in insert, nut, thread or motor."""
    last = one.through[-1]
    nuts = [
        (other, nut)
        for other in others
        if other.through[-1] == last
        and other.part.startswith(NUTS)
        and (nut := size_of(other.part))
        and _is_on(one, other.position)
    ]
    if nuts:
        # A nut on the way to an insert only locks.
        inserts = [pair for pair in nuts if pair[0].part.startswith(INSERT)]
        return any(_in_nut(one, size, *pair) for pair in inserts or nuts)
    if last not in SOLID:
        return _hole_depth(one, size, solids[last]) > 0
    before = _hole_spans(one, size, solids[one.through[-2]])
    beyond = size.high - max([size.low, *(high for _, high in before)])
    return beyond >= min(GRIP * size.thread, MOTOR_DEPTH_MM) - SAME_MM


def _in_nut(one: PlacedFastener, size: Size, other: PlacedFastener, nut: Size) -> bool:
    """Whether a screw is long enough in a coaxial nut or insert."""
    start, sign = (other.position - one.position) @ one.along, other.along @ one.along
    ends = float(start + sign * nut.low), float(start + sign * nut.high)
    share = GRIP if other.part.startswith(INSERT) else GRIP_NUT
    grip = min(max(ends), size.high) - max(min(ends), 0.0)
    return grip >= share * size.thread - SAME_MM


def _hole_faults(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    """Holes of fasteners' diameters that nothing goes through, but for bores for wires."""
    prototype, base = context.prototype, context.export.spec.prototype.base
    printed = {*IN_PRINTED_MM, base.insert_hole_mm, *(hole for hole, _ in INSERTS.values())}
    if any(part.name.startswith("carrier_") for part in prototype.parts):
        printed |= {base.dowel_mm + base.dowel_press_mm, base.dowel_mm + base.dowel_slip_mm}
    some = [part.name for part in prototype.parts if part.role in ("base", "stage", "frame")]
    some += [one.name for one in prototype.bought if str(one.part).startswith(BRACKETS)]
    diameters = dict.fromkeys(some, printed) | {"plate": {*IN_PLATE_MM}}
    for name in diameters.keys() & solids.keys():  # another check says what is missing
        through = [one for one in prototype.fasteners if name in one.through and not _covers(one)]
        faces = [
            face
            for face in solids[name].faces
            if face.kind == "cylinder"
            and face.hollow
            and any(abs(2 * face.radius - diameter) <= SAME_MM for diameter in diameters[name])
        ]
        empty = [
            face
            for face in faces
            if not any(is_filled(one, face, faces) for one in through)
            and distance_to_line(np.zeros(3), face.point, face.axis) > SAME_MM
        ]
        if empty:
            yield f"{name}: {len(empty)} of {2 * empty[0].radius:g} mm without a fastener"


def _covers(one: PlacedFastener) -> bool:
    """Whether a fastener lies on a hole and is not in it."""
    size = size_of(one.part)
    return size is not None and size.covers


def is_filled(one: PlacedFastener, face: RoundFace, faces: list[RoundFace]) -> bool:
    """Whether a fastener goes through a hole, or with another one through a slot of both."""
    if cross_length(face.axis, one.along) > PARALLEL:
        return False
    return _holds(one, face, [other for other in faces if other is not face])
