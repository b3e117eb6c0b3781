"""The base's place along its axis: what lies in contact from the hub to the head and back.

Zero disc, wheel, spacer and inner ring of the front bearing on one side, inner ring of the rear
bearing and collar on the other: their ends, from the corners of the assembly's solids. A spacer
that is wider than the inner ring's shoulder would rub on the shield; its radius is
taken at 0.3 of the way from bore to outer one (608: 12.2 mm across, 6000: 14.8, 6001: 16.8; makers'
sheets: 12.1, 14.8, 17.0).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import RECORD
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most
from tbcad_verify.step.solids_text import TextSolid

CONTACTS = (
    ("zero_disc", "wheel"),
    ("wheel", "spacer"),
    ("spacer", "bearing_front"),
    ("bearing_rear", "collar"),
)
SHOULDER = 0.3
CLOSED_MM = 0.05  # of all gaps together: less than the thinnest feeler gauge
FILE = RECORD
CHECKS = {"axial chain": "mm"}


def checks(
    names: list[CheckName], context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> list[Check]:
    """All gaps along the axis; without a shaft the motor or the stage is what holds the base."""
    if context.export.spec.prototype.base.drive != "nema17-belt":
        return [at_most(names[0], 0.0, CLOSED_MM, "no shaft")]
    gaps = dict(_gaps(context, solids))
    wide = _radius(solids, "spacer") - _shoulder(solids)
    if wide > 0:
        return [at_most(names[0], wide, 0.0, "the spacer is wider than the inner ring's shoulder")]
    worst = max(gaps, key=lambda pair: gaps[pair])
    detail = "" if gaps[worst] <= CLOSED_MM else f"{worst}: {gaps[worst]:.2f} mm"
    return [at_most(names[0], sum(gaps.values()), CLOSED_MM, detail)]


def _gaps(
    context: PrototypeContext, solids: Mapping[str, TextSolid]
) -> Iterator[tuple[str, float]]:
    """Distance along the axis from the back of one to the front of the next, either way, mm."""
    for before, after in CONTACTS:
        back = (_solid(solids, before).corners @ context.frame[0]).min()
        front = (_solid(solids, after).corners @ context.frame[0]).max()
        yield f"{before} and {after}", float(abs(back - front))


def _shoulder(solids: Mapping[str, TextSolid]) -> float:
    """Radius of the shoulder of the front bearing's inner ring, mm."""
    faces = _solid(solids, "bearing_front").faces
    bore = min(face.radius for face in faces if face.hollow)
    return bore + SHOULDER * (_radius(solids, "bearing_front") - bore)


def _radius(solids: Mapping[str, TextSolid], name: str) -> float:
    """Outer radius of a ring, mm."""
    return max(face.radius for face in _solid(solids, name).faces if not face.hollow)


def _solid(solids: Mapping[str, TextSolid], name: str) -> TextSolid:
    if name not in solids:
        raise Unknown(f"there is no {name} in the assembly")
    return solids[name]
