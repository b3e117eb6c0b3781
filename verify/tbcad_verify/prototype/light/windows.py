"""Windows of the mirrors' cells on their balls, where weight has them at their stops.

The software puts each window to the highlight of its ball that a calibration finds, so windows are
those of balls as they hang, not as designed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad_verify.mesh.surfaces import (
    PreparedSurfaces,
    ReflectedRays,
    Surfaces,
    prepare_for_rays,
    reflect,
)
from tbcad_verify.mesh.vectors import cross, dot, norm, take, unit
from tbcad_verify.prototype.bodies import MeasuredPrototype, rigid_motions
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.types import Floats, Ints

HALVINGS = 50


class Reflecting(Protocol):
    """Map from directions of the shell's picture to rays after the balls."""

    def reflected(self, mirror: Ints, d: Floats) -> tuple[Floats, ReflectedRays]:
        """Directions (3, N) of mirrors' cells as they meet the balls, and their reflections."""


@dataclass(frozen=True)
class HeldBase:
    """The base at N pictures, as their balls have it: it turns and moves with the ball's seat."""

    turn: Floats  # (3, 3, N) from the frame of the base to the ground's
    shift: Floats  # (3, N) and then so far, mm

    def take(self, which: Ints) -> HeldBase:
        """At some of the pictures."""
        return take(self, which)

    def placed(self, points: Floats) -> Floats:
        """Points of the base (3, N) in the frame of the ground, mm."""
        return rotated(self.turn, points) + self.shift

    def on_base(self, points: Floats) -> Floats:
        """Points (3, N) of the ground's frame in that of the base, mm."""
        return self.vectors_on_base(points - self.shift)

    def vectors_on_base(self, vectors: Floats) -> Floats:
        """The same of directions (3, N)."""
        return rotated(self.turn.swapaxes(0, 1), vectors)


@dataclass(frozen=True)
class RayTransfer:
    """Map from directions of the shell's picture to rays after the balls, for m mirrors."""

    measured: MeasuredPrototype  # balls and obstacles
    # (3, 3, m) rotates directions of a mirror's cell in the shell's picture to where the merged
    # picture has them on the mirror's ball
    merged: Floats
    middle: Floats  # (3, m) unit, in which the balls show the origin
    mirrors: PreparedSurfaces  # a reflecting sphere for each mirror, at its stop
    held: HeldBase  # at the picture of each mirror
    ball: Ints  # (m,) that substitutes for the mirror

    def reflected(self, mirror: Ints, d: Floats) -> tuple[Floats, ReflectedRays]:
        """Directions (3, N) of mirrors' cells as they meet the balls, and their reflections."""
        turned = rotated(self.merged[:, :, mirror], d)
        return turned, reflect(self.mirrors, mirror, turned)


def ray_transfer(measured: MeasuredPrototype) -> RayTransfer:
    """The transfer for all mirrors of the camera. Unknown: sag.csv has other stops or balls."""
    context, held = measured.context, held_base(measured)
    ball, pinhole = context.ball, context.pinhole
    centre, radius = held.placed(measured.centre[:, ball]), measured.radius[ball]
    apex = highlights(pinhole, centre, radius, np.zeros(3))
    after = sights(apex, pinhole)
    surfaces = Surfaces(apex, (apex - centre) / radius, 1 / radius)
    prepared = prepare_for_rays(pinhole, surfaces)
    merged = window_rotations(sights(_window_middles(context), pinhole), after)
    return RayTransfer(measured, merged, after[0], prepared, held, ball)


def held_base(measured: MeasuredPrototype) -> HeldBase:
    """The base at the picture of each mirror: with its ball, turned as the ball's seat is.

    By the carrier each seat turns its own way, by the rest as all balls' best motion does.

    Unknown: sag.csv has other stops or balls.
    """
    context = measured.context
    moved, seats = context.sag_at_stops, measured.seated.T
    stops = context.base_rotation(np.radians(context.prototype.stops.angle)).as_matrix()
    places = seats @ stops.swapaxes(1, 2)
    told = context.told_sag
    as_one, own = (moved, 0 * moved) if told is None else (told[1:4].sum(axis=0), told[4])
    turn = np.stack([_best_turn(*pair) for pair in zip(places, as_one, strict=True)])
    stop, ball = context.stop, context.ball
    by_weight = Rotation.from_rotvec(turn[stop] + own[stop, ball])
    matrix = (by_weight.as_matrix() @ stops[stop]).transpose(1, 2, 0)
    place = (places + moved)[stop, ball].T
    return HeldBase(matrix, place - rotated(matrix, seats[ball].T))


def _best_turn(places: Floats, moved: Floats) -> Floats:
    """(3,) small turn of the motion that fits displacements (K, 3) of places best, rad."""
    return np.asarray(np.linalg.lstsq(rigid_motions(places), moved.ravel(), rcond=None)[0][3:])


def _window_middles(context: PrototypeContext) -> Floats:
    """(3, m) what is in the middle of each mirror's window before it follows its ball, mm."""
    if context.moved:
        return context.export.mirrors.columns("px", 3)[:, context.mirror_rows]
    apex = context.prototype.balls.columns("px", 3)[:, context.ball]
    return np.asarray(context.base_rotation(context.angle).apply(apex.T).T)


def sights(apex: Floats, pinhole: Floats) -> Floats:
    """(3, 3, m) rows: to each apex, at right angles to it in the plane of the origin, and third."""
    ahead = unit(apex - pinhole[:, None])
    across = unit(cross(ahead, np.broadcast_to(-pinhole[:, None], ahead.shape)))
    return np.stack([ahead, cross(across, ahead), across])


def window_rotations(before: Floats, after: Floats) -> Floats:
    """(3, 3, m) that rotate directions of windows with sights (3, 3, m) to those of others."""
    return np.asarray(np.einsum("rim,rjm->ijm", after, before))


def rotated(matrix: Floats, d: Floats) -> Floats:
    """(3, N) columns d under matrices (3, 3, N)."""
    return np.asarray(np.einsum("ijn,jn->in", matrix, d))


def highlights(pinhole: Floats, centre: Floats, radius: Floats, led: Floats) -> Floats:
    """(3, m) points of spheres by which the way from a light (3,) to the pinhole is shortest.

    They lie in the plane of centre, light and pinhole, between both, where the way's slope is zero.
    """
    to_led, to_pinhole = led[:, None] - centre, pinhole[:, None] - centre
    first, between = unit(to_led), dot(to_led, to_pinhole) / (norm(to_led) * norm(to_pinhole))
    second = unit(to_pinhole - dot(to_pinhole, first) * first)
    low, high = np.zeros(radius.size), np.arccos(np.clip(between, -1, 1))

    def point(angle: Floats) -> Floats:
        return np.asarray(radius * (np.cos(angle) * first + np.sin(angle) * second))

    def slope(angle: Floats) -> Floats:
        along = -np.sin(angle) * first + np.cos(angle) * second
        return dot(along, unit(point(angle) - to_led) + unit(point(angle) - to_pinhole))

    for _ in range(HALVINGS):
        middle = (low + high) / 2
        falls = slope(middle) < 0
        low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    return np.asarray(centre + point((low + high) / 2))
