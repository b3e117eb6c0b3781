"""The force that keeps a ball on its three pads, whatever the angle of the base.

Pads push and do not pull. A magnet or glue must hold so strongly along the seat's axis that each of
the three pads bears some load in every direction of gravity, with the base's acceleration, without
friction: a ball that only stays in its cup would already have left a pad.

Disc magnets pull a steel ball near one face, or another disc magnet. One that is magnetised along
its axis acts as two discs of magnetic charge, of density Br / mu0, on its faces (charge model:
Furlani, Permanent Magnet and Electromechanical Devices, 2001, 3.2). A steel ball is nearly an
equipotential body without net charge, so its answer to a charge is that of an isolated conducting
sphere to an electric one (Jackson, Classical Electrodynamics, 2.3).
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import quad
from scipy.special import j1

from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.geometry.vectors import dot, norm
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.balance import GRAVITY, ball_masses
from tbcad.types import Bools, Floats

MU_0 = 4e-7 * math.pi  # V s / (A m)
REMANENCE_T = 1.29  # least of N42, 1.29 to 1.32 T in makers' tables
# Least share of the ideal pull that catalogues have with a thick steel plate: 25.5 N for 10 x 5 mm.
DERATING = 0.75
NODES = 64  # of Gauss quadrature along a disc's radius
LAST_TERM = 1e-7  # of the series over the first
MAX_TERMS = 20_000
LAST_WAVE = 200.0  # exponent at which the integral over wave numbers ends
PASCAL_MM2 = 1e-6  # N
MIN_RATIO = 2.0  # of the force there is over the force needed
WIDER_GAP_MM = 0.5  # by which a printed gap may be wider than drawn
# Of glue: a quarter of what the weakest glue bears on many plastics in a test, silicone with
# 1.4 N/mm^2 (The Loctite Design Guide for Bonding Plastics).
GLUE_MPA = 0.35
PAD_AZIMUTHS = np.radians(np.arange(0, 120, 5))  # tried for the first pad
WEB_MM = 0.8  # between pocket and pads


@cache
def pull_on_ball(ball: float, gap: float, magnet: float, height: float) -> float:
    """Pull between a steel ball and a disc magnet on one axis, N, derated.

    All in mm: radii of ball and magnet, the gap between them above 0, the magnet's height. The
    ball's moment of order l follows from a_l, the magnet's potential on the ball; with the magnet
    farther away a_l shrinks by (l + 1) a_(l+1) / ball, whence the force is a sum of their products.
    """
    decay = math.log((ball + gap) / ball)
    terms = min(math.ceil(-math.log(LAST_TERM) / 2 / decay) + 2, MAX_TERMS)
    moments = _moments(ball, ball + gap, magnet, terms)
    moments -= _moments(ball, ball + gap + height, magnet, terms)
    order = np.arange(1, terms)
    total = float(((order + 1) * moments[:-1] * moments[1:]).sum())
    return DERATING * 4 * math.pi * REMANENCE_T**2 / MU_0 * PASCAL_MM2 * total


def _moments(ball: float, distance: float, disc: float, terms: int) -> Floats:
    """Moments from 1 on a ball's centre of a disc of unit charge on the axis, mm, (terms,)."""
    node, weight = np.polynomial.legendre.leggauss(NODES)
    out = disc * (node + 1) / 2
    away = np.hypot(out, distance)
    cosine, ratio = distance / away, ball / away
    charge = weight * disc / 2 * out / (2 * away)  # 2 pi r dr / (4 pi d)
    last, legendre, power = np.ones(NODES), cosine, ratio
    moments = np.empty(terms)
    for order in range(1, terms + 1):
        moments[order - 1] = charge @ (legendre * power)
        following = ((2 * order + 1) * cosine * legendre - order * last) / (order + 1)
        last, legendre, power = legendre, following, power * ratio
    return moments


@cache
def pull_of_pair(one: float, two: float, gap: float, heights: tuple[float, float]) -> float:
    """Pull between two disc magnets on one axis, N, derated; radii, gap above 0 and heights in mm.

    The pull of two coaxial discs of charge is pi r s times the integral of J1(k r) J1(k s) exp(-k
    z) / k (Vokoun et al., Magnetostatic interactions and forces between cylindrical permanent
    magnets, J. Magn. Magn. Mater. 321, 2009). Two magnets have four such pairs.
    """

    def wave(k: float) -> float:
        ends = (1 - math.exp(-k * heights[0])) * (1 - math.exp(-k * heights[1]))
        return float(j1(k * one) * j1(k * two)) / k * math.exp(-k * gap) * ends

    total = quad(wave, 0, LAST_WAVE / (gap + min(one, two)), limit=1000)[0]
    return DERATING * math.pi * one * two * REMANENCE_T**2 / MU_0 * PASCAL_MM2 * float(total)


@dataclass(frozen=True)
class Motion:
    """How the base moves."""

    speed: float  # radians/s
    acceleration: float  # radians/s^2


def base_motion(spec: Spec) -> Motion:
    """The motion that a design asks for."""
    motion = spec.prototype.motion
    speed, acceleration = np.radians([motion.feed_deg_min / 60, motion.acceleration_deg_s2])
    return Motion(float(speed), float(acceleration))


def force_needed(
    normals: Floats, axis: Floats, centre: Floats, mass_g: Floats, frame: Floats, motion: Motion
) -> Floats:
    """Least force along the seats' axes with which all pads always bear load, N, (..., k).

    With pads' reactions N, n^T N + F a + f = 0 for a force F along the axis a and a load f. Pad i
    bears load where F is above v_i . f, v_i being row i of the inverse of -n^T over its product
    with a. Over a full turn of the base, gravity across its axis points everywhere.

    The pads' unit normals (..., k, 3, 3) point toward the balls, the seats' unit axes (k, 3) away
    from their pads; centres (k, 3) in mm, masses (k,) in g; rows of the frame are the base's axis
    and two across it.
    """
    inverse: Floats = np.linalg.inv(np.swapaxes(normals, -1, -2)).astype(np.float64)
    share = -inverse / dot(inverse, axis[:, None])[..., None]
    along, *_ = frame
    lean = float(norm(frame[1:, 2]))
    radial = (centre - (centre @ along)[:, None] * along) * 1e-3
    outward = motion.speed**2 * dot(share, radial[:, None])
    tangential = motion.acceleration * np.abs(dot(share, np.cross(along, radial)[:, None]))
    gravity = GRAVITY * (lean * norm(share @ frame[1:].T) - float(frame[0, 2]) * (share @ along))
    return np.asarray(mass_g * 1e-3 * (gravity + outward + tangential).max(axis=-1))


def glue_force(radius: Floats) -> Floats:
    """Force of glued round faces of radii (...) in mm, N, (...)."""
    return np.asarray(GLUE_MPA * np.pi * radius**2)


def pad_normals(tilt: float, azimuth: Floats) -> Floats:
    """Unit normals toward the ball's centre of the pads of k seats, (k, 3, 3).

    Tilted from the seat's axis, which is z, away from the pads; azimuths (k,) of first pads,
    radians.
    """
    around = azimuth[:, None] + np.arange(3) * 2 * np.pi / 3
    along = np.full((*around.shape, 1), np.cos(tilt))
    return -np.concatenate([np.sin(tilt) * unit_circle(around), along], axis=-1)


def glue_wells(prototype: PrototypeLayout, needed: Floats, room: Floats) -> tuple[Floats, ...]:
    """As `magnet_pockets`, wells for glue; SpecError where glue holds a ball too little."""
    radius = np.maximum(room, 0) / 2
    if (weak := glue_force(radius) < MIN_RATIO * needed).any():
        ball = first_ball(weak)
        raise SpecError(
            f"glue holds ball {ball} of {prototype.balls.size[ball - 1]} by "
            f"{glue_force(radius)[ball - 1]:.2f} N, {MIN_RATIO:g} times {needed[ball - 1]:.2f} N "
            "are needed: make prototype.base.pad_mm smaller"
        )
    return np.zeros_like(radius), np.zeros_like(radius), radius


def magnet_pockets(
    spec: BaseSpec, prototype: PrototypeLayout, needed: Floats, room: Floats
) -> tuple[Floats, ...]:
    """Diameters and heights of magnets, zero with glue, and radii of their pockets, mm, (k,) each.

    The largest that fit, of the strong height only where the other would not hold.
    SpecError when none fits into a room between the pads (radii (k,), mm), or holds as needed (N).
    """
    diameter = _largest(spec, room)
    height = np.full_like(diameter, spec.magnet_height_mm)
    weak = _pull(spec, prototype, diameter, height) < MIN_RATIO * needed
    height[weak] = max(spec.magnet_height_mm, spec.strong_magnet_height_mm)
    pull = _pull(spec, prototype, diameter, height)
    weak &= (pull < MIN_RATIO * needed) & ~prototype.balls.cap  # a cap has a magnet too
    if weak.any():
        ball = first_ball(weak)
        raise SpecError(
            f"ball {ball} of {prototype.balls.size[ball - 1]} needs {MIN_RATIO:g} times "
            f"{needed[ball - 1]:.2f} N, its magnet of {diameter[ball - 1]:g} mm pulls "
            f"{pull[ball - 1]:.2f} N: add larger ones to prototype.base.magnets_mm, make "
            "prototype.base.strong_magnet_height_mm larger, prototype.base.magnet_gap_mm smaller, "
            "or set prototype.base.hold to glue"
        )
    return diameter, height, (diameter + spec.magnet_play_mm) / 2


def worst_force_needed(prototype: PrototypeLayout, axes: Floats, tilt: float) -> Floats:
    """Force that each ball needs with its pads at their worst azimuth, N, (k,)."""
    motion = base_motion(prototype.spec)
    masses = ball_masses(prototype)
    turned = [np.full(len(masses), one) for one in PAD_AZIMUTHS.tolist()]
    normals = np.stack([pad_normals(tilt, azimuth) @ axes for azimuth in turned])
    frame = prototype.array.ellipsoid.frame()
    needed = force_needed(normals, axes[:, 2], masses.centre, masses.mass_g, frame, motion)
    return np.asarray(needed.max(axis=0))


def first_ball(flags: Bools) -> int:
    """Number of the first ball whose flag is set, from 1."""
    return int(flags.argmax()) + 1


def _largest(spec: BaseSpec, room: Floats) -> Floats:
    """Diameter of the largest magnet in each room, mm, (k,)."""
    sizes = np.array(sorted(spec.magnets_mm))
    fitting = (sizes + spec.magnet_play_mm) / 2 <= room[:, None]
    if (none := np.logical_not(fitting.any(axis=1))).any():
        ball = first_ball(none)
        largest = float(2 * room[ball - 1] - spec.magnet_play_mm)
        raise SpecError(
            f"no magnet fits between the pads of ball {ball}: add one of {max(largest, 0):.1f} mm "
            "or less to prototype.base.magnets_mm, or set prototype.base.hold to glue"
        )
    return np.asarray(np.where(fitting, sizes, 0).max(axis=1))


def _pull(spec: BaseSpec, prototype: PrototypeLayout, diameter: Floats, height: Floats) -> Floats:
    """Pull on each ball, N, (k,); of a cap as if it were a ball."""
    gap, radius = spec.magnet_gap_mm, prototype.balls.body_radius
    sizes = np.column_stack([radius, diameter / 2, height]).tolist()
    return np.array([pull_on_ball(ball, gap, magnet, tall) for ball, magnet, tall in sizes])
