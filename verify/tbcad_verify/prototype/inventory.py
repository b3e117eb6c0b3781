"""What there is: the bodies of the record are those of the assembly as STEP and as GLB."""

from __future__ import annotations

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

ZERO_DISC = "zero_disc"  # of the base, beside its carrier
TURNING = frozenset({"wheel", "shaft", "collar", "coupling", "rotary_stage_top"})
VIEWS = frozenset({"capture_sphere", "camera_view"})
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
    faults = list(_faults(context, drawn, solids))
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


def _faults(
    context: PrototypeContext, drawn: Collection[str], solids: Collection[str]
) -> Iterable[str]:
    """What the assembly has too little or too much, and what turns without need."""
    prototype = context.prototype
    names = {part.name for part in prototype.parts if part.role != TOOL} | VIEWS
    names |= {f"ball_{k + 1}" for k in np.flatnonzero(~prototype.balls.cap)}
    names |= {one.name for one in prototype.bought} | {one.name for one in prototype.fasteners}
    names |= {one.name for one in (prototype.shroud.panels if prototype.shroud else ())}
    yield from _differences(names, set(drawn), f"body in {prototype.assembly.glb}")
    yield from _differences(names, set(solids), f"solid in {prototype.assembly.step}")
    for one in prototype.bought:
        if one.turns != (one.name in TURNING):
            yield f"{one.name} turns" if one.turns else f"{one.name} does not turn"
    if context.export.spec.prototype.k != len(prototype.balls):
        yield f"{len(prototype.balls)} balls, the spec asks for {context.export.spec.prototype.k}"


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
