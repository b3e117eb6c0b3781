"""No two bodies of the assembly share room at base angle zero, but where a fit is meant.

Printed parts are those of their STL files, all other bodies those of the GLB. The assembly has no
belt: it is what runs round both wheels, within their rims.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.fastener_checks import MOTOR_DEPTH_MM
from tbcad_verify.record.prototype import GLB, PlacedFastener
from tbcad_verify.record.spec import BaseSpec
from tbcad_verify.report.checks import Check, CheckName, at_most, informative, short_list
from tbcad_verify.run.kept import kept
from tbcad_verify.types import Floats

FILE = GLB
CHECKS = {"bodies apart": "mm", "meant fits": "pairs"}
# Mean thickness of what chords cut from round faces in contact: two thirds of the 0.1 mm by which
# facets of the GLB leave them. On flat faces nothing is cut; a clash of less harms no print.
SKIN_MM = 0.07
# Greatest depth of a screw in a body that is drawn without its tapped hole: NEMA 17; a tripod's
# thread (ISO 1222); of a rotary stage one and a half diameters, which is assumed.
TAPPED_MM = {"motor": MOTOR_DEPTH_MM, "camera": 5.5, "rotary_stage": 9.0, "rotary_stage_top": 9.0}
SCREW = r"(?:M|UNC1/4-20x)\d.*"
BELT, WHEELS, BELT_MM = "belt", ("wheel", "pinion"), 2.5
# Other fits by what both bodies are, and how deep one is pressed into the other, mm: a seat and a
# dowel by the design's keys, a belt as it lies below the rims that its wheels are drawn with.
FITS: tuple[tuple[str, str, Callable[[BaseSpec], float]], ...] = (
    (r"ball_\d+|cap_\d+", r"carrier(_\d+)?", lambda base: -base.pad_offset_mm),
    (r"DOWEL-.*", r"carrier(_\d+)?", lambda base: -base.dowel_press_mm / 2),
    (BELT, "|".join(WHEELS), lambda base: BELT_MM),
)


@dataclass(frozen=True)
class SharedRoom:
    """The room that two bodies share."""

    pair: tuple[str, str]  # names of both
    corners: Floats  # (V, 3) mm
    volume: float  # mm^3
    thickness: float  # mean of its thickest piece, mm


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    closed: Mapping[str, Any],
    drawn: Mapping[str, Shape],
) -> list[Check]:
    """All bodies against all; meant fits are listed with their depth."""
    with_belt = drawn.keys() >= {*WHEELS}
    own = {BELT: belt(context, [drawn[name][0] for name in WHEELS])} if with_belt else {}
    base = context.export.spec.prototype.base
    skin = max(SKIN_MM, context.export.mesh_error_mm)
    placed = {one.name: one for one in context.prototype.fasteners}
    fits, worst, clashes = list[str](), 0.0, list[tuple[float, str]]()
    for room in shared_rooms({**closed, **own}):
        depth, both = meant_fit(base, placed, room, skin), " and ".join(room.pair)
        if depth is not None:
            fits.append(f"{both} {depth:.2f}")
            continue
        worst = max(worst, room.thickness)
        if room.thickness > skin:
            clashes.append((-room.volume, f"{both} share {room.volume:.3g} mm^3"))
    apart = at_most(names[0], worst, skin, short_list([text for _, text in sorted(clashes)]))
    return [apart, informative(names[1], len(fits), ", ".join(fits))]


@kept("checks of bodies apart")
def shared_rooms(solids: Mapping[str, Any]) -> list[SharedRoom]:
    """The room of all pairs of solids that share some; `solids`: of manifold3d, by name."""
    titles = sorted(solids)
    low, high = np.split(np.array([solids[name].bounding_box() for name in titles]), 2, axis=1)
    near = ((low[:, None] < high) & (low < high[:, None])).all(axis=2)
    pairs = [(titles[a], titles[b]) for a, b in np.argwhere(np.triu(near, 1)).tolist()]
    rooms = [(pair, solids[pair[0]] ^ solids[pair[1]]) for pair in pairs]
    return [
        SharedRoom(pair, room.to_mesh64().vert_properties[:, :3], room.volume(), thickness(room))
        for pair, room in rooms
        if not room.is_empty()
    ]


def thickness(shared: Any) -> float:
    """Mean thickness of the thickest piece of a solid, mm: of a thin sheet, its thickness."""
    pieces = (piece for piece in shared.decompose() if piece.surface_area() > 0)
    return max((2 * piece.volume() / piece.surface_area() for piece in pieces), default=0.0)


def meant_fit(
    base: BaseSpec,
    placed: Mapping[str, PlacedFastener],
    room: SharedRoom,
    skin: float,
) -> float | None:
    """Depth of a fit that is in the tables and no deeper than there, mm; None of anything else.

    `placed`: all fasteners, by name.
    """
    for name, other in (room.pair, room.pair[::-1]):
        screw = placed.get(name)
        if screw and other in TAPPED_MM and re.fullmatch(SCREW, screw.part):
            # Its shank beyond the face that it presses on, in what it is turned into.
            along = (room.corners - screw.position) @ screw.along
            shank, depth = along.min() >= -skin, float(np.ptp(along))
            fits = shank and screw.through[-1] == other and depth <= TAPPED_MM[other] + skin
            return depth if fits else None
        for first, second, pressed in FITS:
            if re.fullmatch(first, screw.part if screw else name) and re.fullmatch(second, other):
                return room.thickness if 0 < pressed(base) >= room.thickness - skin else None
    return None


def belt(context: PrototypeContext, wheels: list[Floats]) -> Any:
    """The room of a belt round two wheels, whose corners (V, 3) are given.

    It is as wide as the first of them: the pinion's hub is beside it.
    """
    import manifold3d

    placed = [corners @ context.frame.T for corners in wheels]
    ends = placed[0][:, 0].min(), placed[0][:, 0].max()
    for corners in placed:
        corners[:, 0] = corners[:, 0].clip(*ends)

    def loop(inset: float) -> Any:
        points = [_shrunk(corners, inset) for corners in placed]
        return manifold3d.Manifold.hull_points(np.concatenate(points) @ context.frame)

    return loop(0.0) - loop(BELT_MM)


def _shrunk(corners: Floats, inset: float) -> Floats:
    """Corners (V, 3) along the axis and across it, nearer to their middle across."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    share = 1 - 2 * inset / (high - low)[1]
    return np.asarray((low + high) / 2 + (corners - (low + high) / 2) * [1.0, share, share])
