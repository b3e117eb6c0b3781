"""What holds each ball: loads by turning the base, pulls from measured pockets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.fits.magnets import pull_of_pair, pull_on_ball
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_least,
    worst_offenders,
)
from tbcad_verify.step.solids_text import RoundFace, TextSolid, distance_to_line
from tbcad_verify.types import Floats

MIN_RATIO = 2.0  # of the force there is over the force needed
GRAVITY = 9.80665  # m/s^2, standard
STEPS = 720  # base angles in a turn
GLUE_MPA = 0.35
ON_AXIS_MM = 1e-5  # of a pocket's axis from its seat's
PARALLEL = 1e-9
CHECKS = {"hold ratio": "1"}


@dataclass(frozen=True)
class Pocket:
    """A round pocket on a seat's axis: radius, start and end from the ball's centre, mm."""

    radius: float
    start: float
    end: float


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    carriers: list[TextSolid],
    caps: list[TextSolid],
) -> list[Check]:
    """The least ratio of the force that holds a ball over the force needed."""
    needed = forces_needed(context)
    holds = [_hold(context, carriers, caps, k) for k in range(len(needed))]
    ratio, ids = np.array(holds) / needed, context.prototype.balls.names(np.arange(len(holds)))
    weak = worst_offenders(ids, -ratio, "", ratio < MIN_RATIO, ".3g")
    return [at_least(names[0], float(ratio.min()), MIN_RATIO, weak)]


def forces_needed(context: PrototypeContext) -> Floats:
    """(K,) force along each seat's axis with which no pad is ever without load, N.

    The base is turned in small steps; at each, the reactions of the three pads to the load and to a
    unit force along the axis are solved for.
    """
    motion, balls = context.export.spec.prototype.motion, context.prototype.balls
    axis = context.frame[0]
    angle = np.linspace(0, 2 * np.pi, STEPS, endpoint=False)
    gravity = context.base_rotation(-angle).apply([0.0, 0.0, -GRAVITY])
    speed, acceleration = np.radians([motion.feed_deg_min / 60, motion.acceleration_deg_s2])
    centre, mass = balls.columns("bx", 3).T / 1000, context.masses_g / 1000
    outward = centre - np.outer(centre @ axis, axis)
    around = np.cross(axis, outward)
    needed = np.zeros(len(mass))
    for k, seat in enumerate(context.prototype.seats):
        steady = gravity + speed**2 * outward[k]
        loads = mass[k] * np.vstack([steady + s * acceleration * around[k] for s in (-1, 1)])
        back = -balls.columns("nx", 3)[:, k]
        pads = np.array(seat.normals).T
        by_load, by_hold = np.linalg.solve(pads, -loads.T), np.linalg.solve(pads, -back)
        if not (by_hold > 0).all():
            raise Unknown(f"the pads of ball {k + 1} do not carry it along its seat's axis")
        needed[k] = float((-by_load / by_hold[:, None]).max())
    return needed


def _hold(
    context: PrototypeContext, carriers: list[TextSolid], caps: list[TextSolid], k: int
) -> float:
    """Force that holds a ball by the pocket behind it, N."""
    balls, base = context.prototype.balls, context.export.spec.prototype.base
    pocket = _pocket(context, carriers, k)
    if pocket is None:
        raise Unknown(f"there is no pocket behind ball {k + 1}")
    own = _pocket(context, [caps[int(balls.cap[:k].sum())]], k) if balls.cap[k] else None
    if base.hold == "glue" or (balls.cap[k] and own is None):
        return float(GLUE_MPA * np.pi * pocket.radius**2)
    radius, gap = float(balls.body_radius_mm[k]), base.magnet_gap_mm
    magnet, height = pocket.radius - base.magnet_play_mm / 2, pocket.end - radius - gap
    _require_magnet(context, k, magnet, height)
    if own is None:
        return pull_on_ball(radius, gap, magnet, height)
    smaller = own.radius - base.magnet_play_mm / 2
    _require_magnet(context, k, smaller, own.end - own.start)
    return pull_of_pair(smaller, magnet, radius + gap - own.end, (own.end - own.start, height))


def _require_magnet(context: PrototypeContext, k: int, radius: float, height: float) -> None:
    """Refuse a pocket that no magnet of its size is put in.

    Raises:
        Unknown: there is none on the ball's axis.
    """
    balls, name = context.prototype.balls, f"MAGNET-{round(2 * radius, 4):g}x{round(height, 4):g}"
    centre, axis = balls.columns("bx", 3)[:, k], balls.columns("nx", 3)[:, k]
    on_axis = [
        one.part
        for one in context.prototype.fasteners
        if distance_to_line(one.position, centre, axis) < ON_AXIS_MM
    ]
    if name not in on_axis:
        raise Unknown(f"ball {k + 1} has no {name}, for which its pocket is")


def _pocket(context: PrototypeContext, solids: list[TextSolid], k: int) -> Pocket | None:
    """The narrowest hollow cylinder on a seat's axis behind the ball, or in a cap."""
    balls = context.prototype.balls
    centre, back = balls.columns("bx", 3)[:, k], -balls.columns("nx", 3)[:, k]
    found: dict[float, list[float]] = {}
    for solid in solids:
        for face in solid.faces:
            if _on_axis(face, centre, back):
                ends = [float((face.point + end * face.axis - centre) @ back) for end in face.span]
                if max(ends) > 0:
                    found.setdefault(round(face.radius, 6), []).extend(ends)
    if not found:
        return None
    radius = min(found)
    return Pocket(radius, min(found[radius]), max(found[radius]))


def _on_axis(face: RoundFace, centre: Floats, axis: Floats) -> bool:
    return (
        face.kind == "cylinder"
        and face.hollow
        and float(np.linalg.norm(np.cross(face.axis, axis))) < PARALLEL * 1e3
        and distance_to_line(centre, face.point, face.axis) < ON_AXIS_MM
    )
