"""Balls where their pads put them, and everything that can stand in the light, ready for rays.

All is looked at from the base: its frame stands still, and what stands on the ground is turned
back by the base's angle. Pinhole and capture sphere lie on the axis, so they stay where they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.mesh.rays import RayScene, build_scene
from tbcad_verify.mesh.surfaces import PreparedSurfaces, Surfaces, prepare_for_rays
from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype import axis
from tbcad_verify.prototype.caps import MeasuredCap
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, joined_meshes, of_roles
from tbcad_verify.prototype.seats import MeasuredSeats
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats


@dataclass(frozen=True)
class Obstacles:
    """Parts that may stand in the light.

    Attributes:
        scene: all of them; None without any.
        owner: (F + 1,) name of each facet's part, by number; the last is nobody's.
        names: of the parts.
    """

    scene: RayScene | None
    owner: NDArray[np.intp]
    names: tuple[str, ...]


@dataclass(frozen=True)
class MeasuredPrototype:
    """The machine as its files make it, base at angle zero.

    Attributes:
        context: the record.
        centre: (3, K) of the reflecting spheres, mm.
        radius: (K,) of them, mm.
        body: (3, K) centres of what lies on the pads, mm.
        body_radius: (K,) mm.
        seen: the reflecting spheres from the pinhole.
        turning: base and caps.
        standing: stage and frame.
    """

    context: PrototypeContext
    centre: Floats
    radius: Floats
    body: Floats
    body_radius: Floats
    seen: PreparedSurfaces
    turning: Obstacles
    standing: Obstacles


def measure_prototype(
    context: PrototypeContext,
    held: MeasuredSeats,
    caps: list[MeasuredCap],
    bodies: list[MeasuredPart],
) -> MeasuredPrototype:
    """Put balls on their pads, and caps as they were measured.

    Raises:
        Unknown: a centre, a cap or a mesh is not known.
    """
    balls = context.prototype.balls
    if lost := [why for why in held.reason if why]:
        raise Unknown(lost[0])
    body, radius = held.centre.T.copy(), balls.radius_mm.copy()
    centre, body_radius = body.copy(), balls.body_radius_mm.copy()
    without = {*np.flatnonzero(balls.cap).tolist()} - {cap.ball for cap in caps}
    if without:
        raise Unknown(f"no part is the cap of ball {min(without) + 1}")
    for cap in caps:
        # The cap lies with its body on the pads, wherever the file has it.
        centre[:, cap.ball] += cap.front.centre - cap.body.centre
        radius[cap.ball], body_radius[cap.ball] = cap.front.radius, cap.body.radius
    normal = unit(balls.columns("nx", 3))
    surfaces = Surfaces(centre + radius * normal, normal, 1 / radius)
    return MeasuredPrototype(
        context,
        centre,
        radius,
        body,
        body_radius,
        prepare_for_rays(context.pinhole, surfaces),
        obstacles(of_roles(bodies, "base", "cap")),
        obstacles(of_roles(bodies, "stage", "frame")),
    )


def obstacles(bodies: list[MeasuredPart]) -> Obstacles:
    """Parts as one scene.

    Raises:
        Unknown: a mesh is not known.
    """
    names = tuple(one.part.name for one in bodies)
    if not bodies:
        return Obstacles(None, np.zeros(1, dtype=np.intp), names)
    mesh, owner = joined_meshes(bodies)
    return Obstacles(build_scene(mesh), np.append(owner, -1), names)


def to_base(context: PrototypeContext, x: Floats, angle: Floats) -> Floats:
    """Columns of the ground's frame (3, N) in the base's, which has turned by angles (N,)."""
    return axis.turned(x, context.frame[0][:, None], -angle)


def to_ground(context: PrototypeContext, x: Floats, angle: Floats) -> Floats:
    """The way back."""
    return axis.turned(x, context.frame[0][:, None], angle)
