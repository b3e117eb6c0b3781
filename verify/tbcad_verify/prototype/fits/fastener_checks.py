"""Every fastener is in holes that it fits, grips what it is screwed into, and no hole lacks one.

Places are the record's, sizes those of the parts' names and of standards, holes and bodies those of
the STEP assembly. Threads are drawn at their core in screws, at their nominal diameter in nuts.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype_sections import PlacedFastener
from tbcad_verify.report.checks import Check, CheckName, at_most, short_list
from tbcad_verify.step.solids_text import RoundFace, TextSolid, cross_length, distance_to_line

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
IN_PRINTED_MM = (1.7, 2.8, 3.4, 4.5, 5.5, 6.6)
# Drawn without holes: bodies of catalogue parts.
SOLID = frozenset(
    {
        *("motor", "rotary_stage", "rotary_stage_top", "coupling", "camera"),
        *("upright_left", "upright_right"),
    }
)
# Smallest grip in nominal diameters: in an insert or aluminium; in a steel nut (thin, ISO 4035).
GRIP, GRIP_NUT = 1.0, 0.5
INSERT = "INSERT-"
NUTS = (INSERT, "TNUT-", "NUT-")  # what a screw is turned into
MOTOR_DEPTH_MM = 4.5  # of the thread in a NEMA 17 motor's face


@dataclass(frozen=True)
class Size:
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


def _rod(diameter: str, length: str) -> Size:
    return Size(float(diameter) / 2, 0.0, float(length))


NUMBER = r"(\d+(?:\.\d+)?)"
KINDS: dict[str, Callable[..., Size]] = {
    rf"(?:SET-)?M{NUMBER}x{NUMBER}": _screw,
    rf"UNC1/4-20x{NUMBER}": lambda length: _screw("6.35", length),
    rf"(?:DOWEL|MAGNET)-{NUMBER}x{NUMBER}": _rod,
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
    """Fasteners against holes, and holes against fasteners.

    Args:
        names: of the checks.
        context: the record.
        solids: of the STEP assembly, by name.
    """
    return [
        _check(names[0], _fastener_faults(context, solids)),
        _check(names[1], _hole_faults(context, solids)),
    ]


def _check(name: CheckName, faults: Iterator[str]) -> Check:
    found = list(faults)
    return at_most(name, len(found), 0, short_list(found))


def _fastener_faults(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    fasteners = context.prototype.fasteners
    turning = {part.name for part in context.prototype.parts if part.role in ("base", "cap")}
    turning |= {body.name for body in context.prototype.bought if body.turns}
    for one in fasteners:
        others = [name for name in one.through if one.turns != (name in turning)]
        if others:
            yield f"{one.name} turns otherwise than {short_list(others)}"
        yield from (f"{one.name} {fault}" for fault in _faults(one, fasteners, solids))


def _faults(
    one: PlacedFastener, others: list[PlacedFastener], solids: Mapping[str, TextSolid]
) -> Iterator[str]:
    """What is wrong with a fastener."""
    missing = [name for name in (one.name, *one.through) if name not in solids]
    if missing:
        yield f"needs {short_list(missing)} in the assembly"
    elif one.part in LEDS:
        if not _led_drawn(one, solids[one.name]):
            yield "is drawn elsewhere"
    elif size := size_of(one.part):
        yield from _size_faults(one, size, others, solids)
    else:
        yield f"is of an unknown part {one.part}"


def _size_faults(
    one: PlacedFastener,
    size: Size,
    others: list[PlacedFastener],
    solids: Mapping[str, TextSolid],
) -> Iterator[str]:
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


def _led_drawn(one: PlacedFastener, body: TextSolid) -> bool:
    radius = LEDS[one.part] / 2
    return any(abs(face.radius - radius) <= SAME_MM for face in _coaxial(one, body))


def _coaxial(one: PlacedFastener, solid: TextSolid) -> list[RoundFace]:
    return [
        face
        for face in _parallel(one, solid)
        if distance_to_line(face.point, one.position, one.along) <= SAME_MM
    ]


def _parallel(one: PlacedFastener, solid: TextSolid) -> list[RoundFace]:
    return [
        face
        for face in solid.faces
        if face.kind == "cylinder" and cross_length(face.axis, one.along) <= PARALLEL
    ]


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
    wide = [
        face
        for face in _parallel(one, solid)
        if face.hollow and (size.covers or face.radius >= size.radius - SAME_MM)
    ]
    return [_span(one, face) for k, face in enumerate(wide) if _holds(one, face, wide[:k])]


def _holds(one: PlacedFastener, face: RoundFace, others: list[RoundFace]) -> bool:
    """Whether a hollow face is round a fastener, or with another one a slot's end round it."""
    if distance_to_line(face.point, one.position, one.along) <= SAME_MM:
        return True
    return any(
        abs(face.radius - other.radius) <= SAME_MM
        and distance_to_line((face.point + other.point) / 2, one.position, one.along) <= SAME_MM
        for other in others
    )


def _grips(
    one: PlacedFastener,
    size: Size,
    others: list[PlacedFastener],
    solids: Mapping[str, TextSolid],
) -> bool:
    """Whether a screw is long enough in insert, nut, thread or motor."""
    nuts = [
        (other, nut)
        for other in others
        if other.through[-1] == one.through[-1]
        and other.part.startswith(NUTS)
        and (nut := size_of(other.part))
        and distance_to_line(other.position, one.position, one.along) <= SAME_MM
    ]
    if nuts:
        # A nut on the way to an insert only locks.
        inserts = [pair for pair in nuts if pair[0].part.startswith(INSERT)]
        return any(_in_nut(one, size, *pair) for pair in inserts or nuts)
    if one.through[-1] not in SOLID:
        return _hole_depth(one, size, solids[one.through[-1]]) > 0
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
    """Holes of fasteners' diameters that nothing goes through."""
    fasteners, prototype = context.prototype.fasteners, context.prototype
    base = context.export.spec.prototype.base
    inserts = {hole for hole, _ in INSERTS.values()} | {base.insert_hole_mm}
    dowels = {base.dowel_mm + base.dowel_press_mm, base.dowel_mm + base.dowel_slip_mm}
    dowels = dowels if [p for p in prototype.parts if p.name.startswith("carrier_")] else set()
    diameters = {
        part.name: {*IN_PRINTED_MM, *inserts, *dowels}
        for part in prototype.parts
        if part.role in ("base", "stage", "frame")
    }
    diameters["plate"] = set(IN_PLATE_MM)
    for name, sizes in diameters.items():
        solid = solids.get(name)
        if solid is None:
            continue  # another check says so
        through = [one for one in fasteners if name in one.through]
        faces = [face for face in solid.faces if _is_for_fastener(face, sizes)]
        empty = [
            face
            for face in faces
            if not any(_is_filled(one, face, faces) for one in through)
            and distance_to_line(np.zeros(3), face.point, face.axis) > SAME_MM  # bores for wires
        ]
        if empty:
            yield f"{name}: {len(empty)} of {2 * empty[0].radius:g} mm without a fastener"


def _is_for_fastener(face: RoundFace, diameters: set[float]) -> bool:
    return (
        face.kind == "cylinder"
        and face.hollow
        and any(abs(2 * face.radius - diameter) <= SAME_MM for diameter in diameters)
    )


def _is_filled(one: PlacedFastener, face: RoundFace, faces: list[RoundFace]) -> bool:
    if cross_length(face.axis, one.along) > PARALLEL:
        return False
    return _holds(one, face, [other for other in faces if other is not face])
