"""What there must be: worked out from the spec, and looked for in every file that lists parts.

Record, assembly as STEP and as GLB, and parts list must agree on what there is. A part that is left
out of all of them is missed too, since the spec asks for it.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.files import MAX_TEXT_BYTES, read
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, short_list
from tbcad_verify.step.solids_text import TextSolid, holes, read_solids
from tbcad_verify.types import Floats

STAGE = frozenset({"stage_disc", "stage_crown", "stage_post"})
ZERO_DISC = "zero_disc"  # of the base, beside its carrier
FRAME = frozenset(
    {"bearing_head", "home_bracket", "upright_foot_front", "upright_foot_back", "stage_foot"}
)
CAMERA = frozenset({"camera_bracket", "camera_plate", "camera_fence"})
GAUGE = "camera_gauge"  # a tool, with a camera
STOCK = frozenset({"plate", "upright_left", "upright_right", "home_switch"})
# Bought bodies of each drive; those that turn with the base.
DRIVES: dict[str, frozenset[str]] = {
    "nema17-belt": frozenset(
        {"motor", "wheel", "pinion", "shaft", "bearing_front", "bearing_rear", "collar"}
    ),
    "nema17-direct": frozenset({"motor", "coupling"}),
    "stage-60": frozenset({"rotary_stage", "rotary_stage_top"}),
}
FOUR_STANDS = frozenset({"lamp_stand_1", "lamp_stand_2", "lamp_holder_3", "lamp_holder_4"})
STANDS = {4: FOUR_STANDS, 2: frozenset({"lamp_stand_1", "lamp_holder_2"})}  # of so many lamps
PANELS = frozenset(f"shroud_{name}" for name in ("floor", "lid", "front", "back", "left", "right"))
TURNING = frozenset({"wheel", "shaft", "collar", "coupling", "rotary_stage_top"})
VIEWS = frozenset({"capture_sphere", "camera_view"})
# Names of what the base, or a set of coupons, is cut into.
NUMBERED = r"(_[1-9][0-9]*)?"
TOOL = "tool"  # role of parts that are not in the assembly
UP = np.array([0.0, 0.0, 1.0])
LED_MM = 1e-9
SAME_MM = 1e-6  # of corners in two STEP files
SINGLE_MM = 2e-3  # of the same corner in the GLB, whose numbers are single precision
CHECKS = {"inventory": "faults", "leds as designed": "faults", "assembly step": "mm"}


@dataclass(frozen=True)
class LedSize:
    """Radius of an LED's pocket, and height of its dome's centre over the pocket's floor, mm."""

    pocket: float
    to_dome: float


# Usual T-1 and T-1 3/4: flange 3.8 and 5.9, height 5.4 and 8.7, dome 3 and 5; play 0.1 all round.
LEDS = {"LED-3": LedSize(3.8 / 2 + 0.1, 5.4 - 1.5), "LED-5": LedSize(5.9 / 2 + 0.1, 8.7 - 2.5)}


@dataclass(frozen=True)
class Expected:
    """Names that the spec and the balls ask for.

    Attributes:
        parts: printed, by role; of base and tools any number of pieces.
        bought: bodies of purchased parts.
        panels: of the shroud.
        balls: bodies of balls.
    """

    parts: dict[str, frozenset[str]]
    bought: frozenset[str]
    panels: frozenset[str]
    balls: frozenset[str]


def expected(context: PrototypeContext) -> Expected:
    """What the prototype must consist of."""
    spec, cap = context.export.spec.prototype, context.prototype.balls.cap
    lamps = context.prototype.lamps
    count = 0 if spec.light.lamp_z_mm == 0 else 4 if lamps is None else len(lamps.places)
    camera = spec.camera_diameter_mm > 0
    numbers = 1 + np.arange(cap.size)
    return Expected(
        parts={
            "cap": frozenset(f"cap_{k}" for k in numbers[cap]),
            "stage": STAGE,
            "frame": FRAME
            | (CAMERA if camera else frozenset())
            | (STANDS.get(count, FOUR_STANDS) if count else frozenset()),
        },
        bought=STOCK
        | DRIVES[spec.base.drive]
        | ({"camera"} if camera else set())
        | {f"lamp_{k}" for k in range(1, count + 1)},
        panels=PANELS if spec.light.shroud else frozenset(),
        balls=frozenset(f"ball_{k}" for k in numbers[~cap]),
    )


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    drawn: dict[str, Shape],
    solids: dict[str, TextSolid],
    own: dict[str, TextSolid],
) -> list[Check]:
    """Everything is there, everywhere, and in the same place.

    Args:
        names: of the checks.
        context: the record.
        drawn: bodies of the GLB.
        solids: of the STEP assembly.
        own: solids of the parts' own STEP files, by name.
    """
    inventory, leds, same = names
    faults = [*_record_faults(context), *_file_faults(context, drawn, solids)]
    return [
        at_most(inventory, len(faults), 0, short_list(faults)),
        _led_check(leds, context, solids.get("stage_crown")),
        _same_places(same, context, drawn, solids, own),
    ]


def assembly_solids(context: PrototypeContext) -> dict[str, TextSolid]:
    """Solids of the STEP assembly, by name.

    Raises:
        Unknown: there is none, or it cannot be read.
    """
    return _solids(context, context.prototype.assembly.step)


def part_solids(context: PrototypeContext) -> dict[str, TextSolid]:
    """Solids of the STEP files of all parts that are in the assembly, by name.

    Raises:
        Unknown: a file has no solid of its part's name, or cannot be read.
    """
    found: dict[str, TextSolid] = {}
    for part in context.prototype.parts:
        if part.role != TOOL:
            solids = _solids(context, part.step)
            if list(solids) != [part.name]:
                raise Unknown(f"{part.step} holds {short_list(list(solids))}, not {part.name}")
            found |= solids
    return found


def _solids(context: PrototypeContext, file: str) -> dict[str, TextSolid]:
    if not file:
        raise Unknown("there is no STEP file")
    return read_solids(read(context.export.folder, file, MAX_TEXT_BYTES).text())


def _record_faults(context: PrototypeContext) -> Iterable[str]:
    """What prototype.json lists too little, too much, or with another role or count."""
    prototype, spec, must = context.prototype, context.export.spec.prototype, expected(context)
    by_role: dict[str, set[str]] = {}
    for part in prototype.parts:
        by_role.setdefault(part.role, set()).add(part.name)
        if part.quantity != 1:
            yield f"{part.name}: {part.quantity} of them"
        if part.role == "cap" and part.name != f"cap_{part.number}":
            yield f"{part.name} is the cap of ball {part.number}"
    for role, names in must.parts.items():
        yield from _differences(names, by_role.pop(role, set()), f"{role} part")
    for role, stem in (("base", "carrier"), ("tool", "coupon")):
        found = by_role.pop(role, set())
        if role == "base":
            yield from () if ZERO_DISC in found else [f"{role} part {ZERO_DISC} is missing"]
            found -= {ZERO_DISC}
        elif spec.camera_diameter_mm > 0:
            yield from () if GAUGE in found else [f"{role} {GAUGE} is missing"]
            found -= {GAUGE}
        if not found or not all(re.fullmatch(stem + NUMBERED, name) for name in found):
            yield f"{role} parts are {short_list(sorted(found)) or 'missing'}"
        elif len(found) > 1 and found != {f"{stem}_{k}" for k in range(1, len(found) + 1)}:
            yield f"{role} parts are not numbered from 1"
    yield from _differences(must.bought, {one.name for one in prototype.bought}, "purchased part")
    panels = prototype.shroud.panels if prototype.shroud else []
    yield from _differences(must.panels, {one.name for one in panels}, "panel")
    for one in prototype.bought:
        if one.turns != (one.name in TURNING):
            yield f"{one.name} turns" if one.turns else f"{one.name} does not turn"
    if spec.k != len(prototype.balls):
        yield f"{len(prototype.balls)} balls, the spec asks for {spec.k}"


def _file_faults(
    context: PrototypeContext, drawn: Collection[str], solids: Collection[str]
) -> Iterable[str]:
    """What assembly and parts list have too little or too much."""
    must, prototype = expected(context), context.prototype
    placed = {part.name for part in prototype.parts if part.role != TOOL}
    names = placed | must.balls | must.bought | must.panels | VIEWS
    names |= {*must.parts["stage"], *must.parts["frame"]}
    names |= {one.name for one in prototype.fasteners}
    yield from _differences(names, set(drawn), f"body in {prototype.assembly.glb}")
    yield from _differences(names, set(solids), f"solid in {prototype.assembly.step}")


def _differences(names: Iterable[str], found: set[str], what: str) -> Iterable[str]:
    names = set(names)
    yield from (f"{what} {name} is missing" for name in sorted(names - found))
    yield from (f"{what} {name} is not asked for" for name in sorted(found - names))


def _led_check(name: CheckName, context: PrototypeContext, crown: TextSolid | None) -> Check:
    """The LEDs are those of the spec, in order, shine upward, and have their pockets."""
    leds, places = context.prototype.leds, context.export.spec.prototype.stage.leds_mm
    faults = []
    if len(leds) != len(places):
        faults.append(f"{len(leds)} LEDs, the spec has {len(places)}")
    for k, (led, place) in enumerate(zip(leds, places, strict=False), 1):
        error = max(np.abs(led.position - place).max(), np.abs(led.direction - UP).max())
        if led.name != f"led_{k}" or error > LED_MM:
            faults.append(f"{led.name} is not as the spec has LED {k}")
    pockets = _pockets(context, crown)
    if len(pockets) != len(leds):
        faults.append(f"{len(leds)} LEDs, the crown has {len(pockets)} pockets")
    for led in leds:
        distance = [np.abs(led.position - pocket).max() for pocket in pockets]
        if not min(distance, default=np.inf) <= SAME_MM:
            faults.append(f"{led.name} has no pocket")
    return at_most(name, len(faults), 0, short_list(faults))


def _pockets(context: PrototypeContext, crown: TextSolid | None) -> list[Floats]:
    """Where LEDs in the crown's pockets have the centres of their domes, mm."""
    led = LEDS[context.export.spec.prototype.stage.led]
    if crown is None or not context.prototype.leds:
        return []
    return [
        hole.point + (led.to_dome - hole.depth / 2) * UP
        for hole in holes(crown.faces, led.pocket, SAME_MM)
        if abs(hole.axis @ UP) > 1 - SAME_MM
    ]


def _same_places(
    name: CheckName,
    context: PrototypeContext,
    drawn: dict[str, Shape],
    solids: dict[str, TextSolid],
    own: dict[str, TextSolid],
) -> Check:
    """Corners of the STEP assembly are those of the parts' own files, and of the GLB."""
    errors: dict[str, float] = {}
    for title in own.keys() & solids.keys():
        one, two = own[title].corners, solids[title].corners
        same = one.shape == two.shape
        # Both have all digits, and their limit is stricter in this share.
        errors[title] = float(np.abs(one - two).max(initial=0)) if same else np.inf
        errors[title] *= SINGLE_MM / SAME_MM
    for title, solid in solids.items():
        if title in drawn:
            distance = np.asarray(cKDTree(drawn[title][0]).query(solid.corners)[0])
            errors[title] = max(errors.get(title, 0.0), float(distance.max(initial=0)))
    balls = context.prototype.balls
    for k in np.flatnonzero(~balls.cap).tolist():
        centre, radius = balls.columns("bx", 3)[:, k], float(balls.body_radius_mm[k])
        errors[f"ball_{k + 1}"] = _sphere_error(solids.get(f"ball_{k + 1}"), centre, radius)
    wrong = sorted(title for title, error in errors.items() if not error <= SINGLE_MM)
    worst = max(errors.values(), default=np.inf)
    return at_most(name, worst, SINGLE_MM, f"elsewhere, or of another shape: {short_list(wrong)}")


def _sphere_error(solid: TextSolid | None, centre: Floats, radius: float) -> float:
    spheres = [face for face in solid.faces if face.kind == "sphere"] if solid else []
    if not spheres:
        return np.inf
    return max(
        float(max(np.abs(face.point - centre).max(), abs(face.radius - radius))) for face in spheres
    )
