"""Holding of each ball: loads by turning the base, measured pockets.

Pull of a disc magnet on a steel ball or on another disc magnet is that of rings of magnetic charge.
The faces of a magnet are discs of charge of density Br / mu0; each is divided into rings. What a
steel ball answers to a ring is its image in the ball, a smaller ring of the opposite charge, and
the same charge at the centre: Kelvin's inversion. The field of a ring is a complete elliptic
integral.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from scipy.special import ellipe

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import RECORD
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_least, require, worst_offenders
from tbcad_verify.step.solids_text import TextSolid, distance_to_line
from tbcad_verify.types import Floats

MU_0 = 4e-7 * np.pi
REMANENCE_T = 1.29  # least of the grade N42
DERATING = 0.75  # catalogues have 0.78 to 0.99 of the ideal pull on steel plate
RINGS_PER_GAP, MIN_RINGS, MAX_RINGS = 8.0, 48, 400
PASCAL_MM2 = 1e-6
MIN_RATIO = 2.0  # of the force there is over the force needed
GRAVITY = 9.80665  # m/s^2, standard
STEPS = 720  # base angles in a turn
GLUE_MPA = 0.35
ON_AXIS_MM, PARALLEL = 1e-5, 1e-6  # of a cylinder's axis from its seat's
FILE = RECORD
CHECKS = {"hold ratio": "1"}

Rings = tuple[Floats, Floats, Floats]
"""Radii, places along the axis, charges over the density, of n rings, mm, mm, mm^2."""
Pocket = tuple[float, float, float]
"""Radius, start and end from the ball's centre of a round pocket on a seat's axis, mm."""


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    carriers: list[TextSolid],
    cap_solids: list[TextSolid],
) -> list[Check]:
    """The least ratio of the force that holds a ball over the force needed."""
    needed = forces_needed(context)
    holds = [_hold(context, carriers, cap_solids, k) for k in range(len(needed))]
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
    pocket = require(_pocket(context, carriers, k), f"there is no pocket behind ball {k + 1}")
    own = _pocket(context, [caps[int(balls.cap[:k].sum())]], k) if balls.cap[k] else None
    if base.hold == "glue" or (balls.cap[k] and own is None):
        return float(GLUE_MPA * np.pi * pocket[0] ** 2)
    radius, gap = float(balls.body_radius_mm[k]), base.magnet_gap_mm
    magnet, height = pocket[0] - base.magnet_play_mm / 2, pocket[2] - radius - gap
    _require_magnet(context, k, magnet, height)
    if own is None:
        return pull_on_ball(radius, gap, magnet, height)
    smaller, thick = own[0] - base.magnet_play_mm / 2, own[2] - own[1]
    _require_magnet(context, k, smaller, thick)
    return pull_of_pair(smaller, magnet, radius + gap - own[2], (thick, height))


def _require_magnet(context: PrototypeContext, k: int, radius: float, height: float) -> None:
    """Refuse a pocket that no magnet of its size is put in.

    Unknown: there is none on the ball's axis.
    """
    balls, name = context.prototype.balls, f"MAGNET-{round(2 * radius, 4):g}x{round(height, 4):g}"
    centre, axis = balls.columns("bx", 3)[:, k], balls.columns("nx", 3)[:, k]
    for one in context.prototype.fasteners:
        if one.part == name and distance_to_line(one.position, centre, axis) < ON_AXIS_MM:
            return
    raise Unknown(f"ball {k + 1} has no {name}, for which its pocket is")


def _pocket(context: PrototypeContext, solids: list[TextSolid], k: int) -> Pocket | None:
    """The narrowest hollow cylinder on a seat's axis behind the ball, or in a cap."""
    found = [*cylinders(context, solids, k, hollow=True)]
    if not found:
        return None
    radius = min(round(one[0], 6) for one in found)
    same = [one for one in found if round(one[0], 6) == radius]
    return radius, min(start for _, start, _ in same), max(end for *_, end in same)


def cylinders(
    context: PrototypeContext, solids: list[TextSolid], k: int, *, hollow: bool
) -> Iterator[Pocket]:
    """Cylinders on a seat's axis that end behind the body's centre."""
    balls = context.prototype.balls
    centre, back = balls.columns("bx", 3)[:, k], -balls.columns("nx", 3)[:, k]
    for face in (face for solid in solids for face in solid.faces):
        if face.kind != "cylinder" or face.hollow != hollow:
            continue
        parallel = np.linalg.norm(np.cross(face.axis, back)) < PARALLEL
        if parallel and distance_to_line(centre, face.point, face.axis) < ON_AXIS_MM:
            ends = [float((face.point + end * face.axis - centre) @ back) for end in face.span]
            if max(ends) > 0:
                yield face.radius, min(ends), max(ends)


def pull_on_ball(ball: float, gap: float, magnet: float, height: float) -> float:
    """Pull, N, between a ball of a radius and a magnet of a radius and height at a gap, mm."""
    faces = _magnet(magnet, height, ball + gap, gap)
    return DERATING * _force(_images(faces, ball), faces)


def pull_of_pair(one: float, two: float, gap: float, heights: tuple[float, float]) -> float:
    """Pull, N, between two magnets of radii and heights at a gap, mm."""
    first = _magnet(one, heights[0], -heights[0], gap)
    second = _magnet(two, heights[1], gap, gap)
    return DERATING * _force(first, second)


def _magnet(radius: float, height: float, start: float, gap: float) -> Rings:
    """Both faces of a magnet that begins at a place on the axis: positive in front."""
    count = int(np.clip(RINGS_PER_GAP * radius / gap, MIN_RINGS, MAX_RINGS))
    node, weight = _quadrature(count)
    out = radius * (node + 1) / 2
    charge = weight * radius / 2 * 2 * np.pi * out
    place = np.concatenate([np.full(count, start), np.full(count, start + height)])
    return np.tile(out, 2), place, np.concatenate([charge, -charge])


@cache
def _quadrature(count: int) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss and Legendre: eigenvalues, slow for hundreds of nodes."""
    node, weight = np.polynomial.legendre.leggauss(count)
    return node, weight


def _images(rings: Rings, ball: float) -> Rings:
    """Response of a ball about the origin: images of the rings, and their charge at its centre."""
    radius, place, charge = rings
    away = np.hypot(radius, place)
    share, image = (ball / away) ** 2, -charge * ball / away
    out, along = np.append(radius * share, 0.0), np.append(place * share, 0.0)
    return out, along, np.append(image, -image.sum())


def _force(source: Rings, rings: Rings) -> float:
    """Force on rings toward the source's side of the axis, downward, N."""
    (b, low, p), (a, high, q) = ([one[:, None] for one in source], rings)
    rise = high - low
    near, far = (a - b) ** 2 + rise**2, (a + b) ** 2 + rise**2
    field = rise * ellipe(4 * a * b / far) / (near * np.sqrt(far)) / (2 * np.pi**2)
    total = float((p * q * field).sum())
    return -total * REMANENCE_T**2 / MU_0 * PASCAL_MM2
