"""The prototype as its files define it: balls where their pads put them, and all obstacles.

Everything is seen from the base: its frame is fixed, and what is fixed to the ground is rotated
back by the base's angle. Pinhole and capture sphere lie on the axis, so they stay where they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.rays import RayScene, build_scene
from tbcad_verify.mesh.surfaces import PreparedSurfaces, Surfaces, prepare_for_rays
from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype.caps import MeasuredCap
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, joined_meshes, of_roles
from tbcad_verify.prototype.seats import MeasuredSeat
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats, Ints


@dataclass(frozen=True)
class Obstacles:
    """Parts that may obstruct the light.

    Attributes:
        scene: all of them; None without any.
        owner: (F + 1,) number of each facet's part; -1 at the end, for no facet.
        names: of the parts.
    """

    scene: RayScene | None
    owner: Ints
    names: tuple[str, ...]


@dataclass(frozen=True)
class MeasuredPrototype:
    """The prototype with its base at angle zero.

    Attributes:
        context: the record.
        centre: (3, K) of the reflecting spheres, mm.
        radius: (K,) of them, mm.
        body: (3, K) centres of the spheres that lie on the pads, mm.
        body_radius: (K,) mm.
        mirrors: the reflecting spheres, for rays from the pinhole.
        rotating: base and caps.
        fixed: stage and frame.
    """

    context: PrototypeContext
    centre: Floats
    radius: Floats
    body: Floats
    body_radius: Floats
    mirrors: PreparedSurfaces
    rotating: Obstacles
    fixed: Obstacles


def measure_prototype(
    context: PrototypeContext,
    seats: list[MeasuredSeat],
    caps: list[MeasuredCap],
    parts: list[MeasuredPart],
) -> MeasuredPrototype:
    """Put balls on their pads, and caps as they were measured.

    Raises:
        Unknown: a centre, a cap or a mesh is not known.
    """
    balls = context.prototype.balls
    if missing := [seat.reason for seat in seats if seat.reason]:
        raise Unknown(missing[0])
    body, radius = np.array([seat.centre for seat in seats]).T.copy(), balls.radius_mm.copy()
    centre, body_radius = body.copy(), balls.body_radius_mm.copy()
    without = {*np.flatnonzero(balls.cap).tolist()} - {cap.ball for cap in caps}
    if without:
        raise Unknown(f"no part is the cap of ball {min(without) + 1}")
    for cap in caps:
        # The cap's body lies on the pads, wherever the cap's own file has it.
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
        _obstacles(of_roles(parts, "base", "cap")),
        _obstacles(of_roles(parts, "stage", "frame")),
    )


def _obstacles(parts: list[MeasuredPart]) -> Obstacles:
    names = tuple(part.part.name for part in parts)
    if not parts:
        return Obstacles(None, np.full(1, -1), names)
    mesh, owner = joined_meshes(parts)
    return Obstacles(build_scene(mesh), np.append(owner, -1), names)
