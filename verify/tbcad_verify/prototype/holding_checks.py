"""What holds each ball, again: loads by turning the base, pulls from measured pockets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.magnets import pull_of_pair, pull_on_ball
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_least,
    at_most,
    short_list,
    worst_offenders,
)
from tbcad_verify.step.solids_text import RoundFace, TextSolid, distance_to_line
from tbcad_verify.types import Floats

MIN_RATIO = 2.0  # of the force there is over the force needed
GRAVITY = 9.80665  # m/s^2, standard
STEPS = 720  # base angles in a turn
GLUE_MPA = 0.35
WIDER_MM = 0.5  # by which a printed gap may be wider
ON_AXIS_MM = 1e-5  # of a pocket's axis from its seat's
PARALLEL = 1e-9
SIZE_MM = 1e-4  # of pockets
NEEDED_SHARE, PULL_SHARE, SHARE = 1e-4, 1e-2, 1e-9
CHECKS = {"holding": "faults", "hold ratio": "1"}


@dataclass(frozen=True)
class Pocket:
    """A round pocket on a seat's axis: radius, start and end from the ball's centre, mm."""

    radius: float
    start: float
    end: float


@dataclass(frozen=True)
class Hold:
    """What holds a ball by its pocket: the magnet's name or None, N, N with a wider gap."""

    magnet: str | None
    force: float
    wider: float
    glued: bool


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    carriers: list[TextSolid],
    caps: list[TextSolid],
) -> list[Check]:
    """The record of what holds each ball, and the least ratio of forces."""
    needed = forces_needed(context)
    holds = [_hold(context, carriers, caps, k) for k in range(len(needed))]
    ratio = np.array([hold.force for hold in holds]) / needed
    faults = [*_faults(context, needed, holds)]
    weak = ratio < MIN_RATIO
    ids = context.prototype.balls.names(np.arange(ratio.size))
    return [
        at_most(names[0], len(faults), 0, short_list(faults)),
        at_least(
            names[1], float(ratio.min()), MIN_RATIO, worst_offenders(ids, -ratio, "", weak, ".3g")
        ),
    ]


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
) -> Hold:
    """What holds a ball, by the pocket behind it."""
    balls, base = context.prototype.balls, context.export.spec.prototype.base
    pocket = _pocket(context, carriers, k)
    if pocket is None:
        raise Unknown(f"there is no pocket behind ball {k + 1}")
    glue = float(GLUE_MPA * np.pi * pocket.radius**2)
    if base.hold == "glue":
        return Hold(None, glue, glue, True)
    radius, gap = float(balls.body_radius_mm[k]), base.magnet_gap_mm
    magnet, height = pocket.radius - base.magnet_play_mm / 2, pocket.end - radius - gap
    name = f"MAGNET-{round(2 * magnet, 4):g}x{round(height, 4):g}"
    if not balls.cap[k]:
        force, wider = (pull_on_ball(radius, gap + w, magnet, height) for w in (0.0, WIDER_MM))
        return Hold(name, force, wider, False)
    own = _pocket(context, [caps[int(balls.cap[:k].sum())]], k)
    if own is None:
        return Hold(name, glue, glue, True)
    between = radius + gap - own.end
    sizes = own.radius - base.magnet_play_mm / 2, magnet
    heights = own.end - own.start, height
    force, wider = (pull_of_pair(*sizes, between + w, heights) for w in (0.0, WIDER_MM))
    return Hold(name, force, wider, False)


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


def _faults(context: PrototypeContext, needed: Floats, holds: list[Hold]) -> Iterator[str]:
    """The record against what was worked out."""
    record = context.prototype.holding
    for k, (ball, hold) in enumerate(zip(record.balls, holds, strict=True)):
        where = f"ball {k + 1}: "
        if ball.magnet != hold.magnet:
            yield f"{where}magnet {ball.magnet}, its pocket is for {hold.magnet}"
        if (ball.by == "glue") != hold.glued:
            yield f"{where}held by {ball.by}"
        yield from _unlike(f"{where}force_needed_n", ball.needed, float(needed[k]), NEEDED_SHARE)
        yield from _unlike(f"{where}force_available_n", ball.available, hold.force, PULL_SHARE)
        yield from _unlike(f"{where}wider_gap_n", ball.wider, hold.wider, PULL_SHARE)
        yield from _unlike(f"{where}ratio", ball.ratio, ball.available / ball.needed, SHARE)


def _unlike(name: str, recorded: float, expected: float, share: float) -> Iterator[str]:
    if not abs(recorded - expected) <= share * abs(expected):
        yield f"{name} is {recorded:.4g}, not {expected:.4g}"
