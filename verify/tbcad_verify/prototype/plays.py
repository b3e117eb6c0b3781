"""Play between parts that hold each other, in the STEP solids, and the tilt of caps by it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.holding_checks import cylinders
from tbcad_verify.record.prototype import RECORD
from tbcad_verify.report.checks import Check, CheckName, Unknown, each_at_most, no_faults
from tbcad_verify.step.solids_text import TextSolid, cross_length, distance_to_line

FILE = RECORD
CHECKS = {"cap tilt": "deg", "plays": "faults"}
# Once the LEDs have shown it, a degree takes 0.06 mm of the 60: so much tilt takes what a design's
# balls have to spare (0.04 mm at n = 18), a tenth of its share of the margin (docs/prototype.md).
TILT_DEG = 0.5
SAME_MM = 1e-5  # lengths of holes on the base's inclined axis have six digits
# Round bodies, and what they are held in, where there are such.
HELD = {"bearing_front": "bearing_head", "bearing_rear": "bearing_head", "stage_post": "stage_foot"}


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    solids: Mapping[str, TextSolid],
    carriers: list[TextSolid],
    cap_solids: list[TextSolid],
) -> list[Check]:
    """Tilt of caps on their pads by the play of their spigots; plays against the spec."""
    tilt, as_asked = names
    balls, base = context.prototype.balls, context.export.spec.prototype.base
    plays = [*_spigots(context, carriers, cap_solids)]
    faults = [*_hole_faults(context, solids), *_cup_faults(context, carriers)]
    faults += [
        f"a spigot has {2 * play:.3f} mm of play, {base.cap_play_mm:g} are asked for"
        for play, _ in plays
        if abs(2 * play - base.cap_play_mm) > SAME_MM
    ]
    made = [no_faults(as_asked, faults)]
    if plays:
        tilts = np.degrees(np.arcsin([play / end for play, end in plays]))
        ids = balls.names(np.flatnonzero(balls.cap))
        made.insert(0, each_at_most(tilt, ids, tilts, TILT_DEG, "deg", "tilts: "))
    return made


def _hole_faults(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    frame = context.export.spec.prototype.frame
    for name, other in HELD.items():
        if name not in solids or other not in solids:
            continue  # another check says what is missing
        play = frame.bearing_fit_mm if other == "bearing_head" else 0.0  # a clamp has none
        outer = max(
            (face for face in solids[name].faces if not face.hollow), key=lambda x: x.radius
        )
        plays = [
            2 * (face.radius - outer.radius)
            for face in solids[other].faces
            if face.kind == "cylinder"
            and face.hollow
            and cross_length(face.axis, outer.axis) < SAME_MM
            and distance_to_line(face.point, outer.point, outer.axis) < SAME_MM
        ]
        if not any(abs(one - play) < SAME_MM for one in plays):
            yield f"{other} has no hole for {name} with {play:g} mm of play"


def _cup_faults(context: PrototypeContext, carriers: list[TextSolid]) -> Iterator[str]:
    """Every ball has a cup about it, a hollow sphere as far from it as the spec asks for."""
    balls, asked = context.prototype.balls, context.export.spec.prototype.base.clearance_mm
    cups = [
        face for solid in carriers for face in solid.faces if face.kind == "sphere" and face.hollow
    ]
    for k, centre in enumerate(balls.columns("bx", 3).T):
        own = [face.radius for face in cups if np.linalg.norm(face.point - centre) < SAME_MM]
        if not own:
            yield f"the cup of ball {k + 1} is no sphere about it, and cannot be measured"
        for play in np.subtract(own, balls.body_radius_mm[k]).tolist():
            if abs(play - asked) > SAME_MM:
                yield f"the cup of ball {k + 1} is {play:.3f} mm from it, {asked:g} are asked for"


def _spigots(
    context: PrototypeContext, carriers: list[TextSolid], cap_solids: list[TextSolid]
) -> Iterator[tuple[float, float]]:
    """Of each cap the play of its spigot to a side, and the end's distance from its centre, mm.

    Unknown: there is no spigot, or none that goes into a pocket.
    """
    which = np.flatnonzero(context.prototype.balls.cap)
    for k, cap in zip(which.tolist(), cap_solids, strict=True):
        own = [*cylinders(context, [cap], k, hollow=False)]
        if len({round(radius, 6) for radius, *_ in own}) != 1:
            raise Unknown(f"the cap of ball {k + 1} has no spigot")
        sockets = cylinders(context, carriers, k, hollow=True)
        play = min((socket for socket, *_ in sockets), default=np.nan) - own[0][0]
        if not play > 0:
            raise Unknown(f"the spigot of ball {k + 1} does not go into a pocket")
        yield play, max(end for *_, end in own)
