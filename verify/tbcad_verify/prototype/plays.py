"""Play between parts that hold each other, in the STEP solids: it is what the design asks for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from tbcad_verify.prototype.cap_tilt import spigots
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import RECORD
from tbcad_verify.report.checks import Check, CheckName, no_faults
from tbcad_verify.step.solids_text import TextSolid, cross_length, distance_to_line

FILE = RECORD
CHECKS = {"plays": "faults"}
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
    """Cups round balls, spigots in pockets, bearings and post in their holes."""
    faults = *_hole_faults(context, solids), *_cup_faults(context, carriers)
    caps = _spigot_faults(context, carriers, cap_solids)
    return [no_faults(names[0], [*faults, *caps])]


def _hole_faults(context: PrototypeContext, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    frame = context.export.spec.prototype.frame
    for name, other in HELD.items():
        if name not in solids or other not in solids:
            continue  # another check says what is missing
        play = frame.bearing_fit_mm if other == "bearing_head" else frame.post_play_mm
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
    balls, asked = context.prototype.balls, context.export.spec.prototype.base.clearance_mm
    centres = balls.columns("bx", 3).T
    for face in (face for solid in carriers for face in solid.faces if face.kind == "sphere"):
        away = np.linalg.norm(centres - face.point, axis=1)
        k = int(away.argmin())
        play = face.radius - float(balls.body_radius_mm[k])
        if face.hollow and away[k] < SAME_MM and abs(play - asked) > SAME_MM:
            yield f"the cup of ball {k + 1} is {play:.3f} mm from it, {asked:g} are asked for"


def _spigot_faults(
    context: PrototypeContext, carriers: list[TextSolid], cap_solids: list[TextSolid]
) -> Iterator[str]:
    asked = context.export.spec.prototype.base.cap_play_mm
    for play, _ in spigots(context, carriers, cap_solids):
        if abs(2 * play - asked) > SAME_MM:
            yield f"a spigot has {2 * play:.3f} mm of play, {asked:g} are asked for"
