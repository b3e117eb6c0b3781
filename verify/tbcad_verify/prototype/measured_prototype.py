"""The prototype as its files define it: balls where their pads put them, and all obstacles.

Everything is seen from the base: its frame is fixed, and what is fixed to the ground is rotated
back by the base's angle. Pinhole and capture sphere lie on the axis, so they stay where they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.mesh import indexed_mesh, join_meshes
from tbcad_verify.mesh.rays import RayScene, build_scene
from tbcad_verify.mesh.surfaces import PreparedSurfaces, Surfaces, prepare_for_rays
from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.bodies import NOT_BODIES, OWN, turning
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.fits.caps import MeasuredCap
from tbcad_verify.prototype.fits.seats import MeasuredSeat
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats, Ints


@dataclass(frozen=True)
class Obstacles:
    """Bodies that may obstruct the light."""

    scene: RayScene | None  # all of them; None without any
    owner: Ints  # (F + 1,) number of each facet's body; -1 at the end, for no facet
    names: tuple[str, ...]  # of the bodies


@dataclass(frozen=True)
class MeasuredPrototype:
    """The prototype with its base at angle zero."""

    context: PrototypeContext  # the record
    centre: Floats  # (3, K) of the reflecting spheres, mm
    radius: Floats  # (K,) of them, mm
    body: Floats  # (3, K) centres of the spheres that lie on the pads, mm
    body_radius: Floats  # (K,) mm
    mirrors: PreparedSurfaces  # the reflecting spheres, for rays from the pinhole
    rotating: Obstacles  # base, caps, and what is fastened to them
    fixed: Obstacles  # all else


def measure_prototype(
    context: PrototypeContext,
    seats: list[MeasuredSeat],
    caps: list[MeasuredCap],
    parts: list[MeasuredPart],
    drawn: Mapping[str, Shape],
) -> MeasuredPrototype:
    """Put balls on their pads, and caps as they were measured.

    Args:
        context: the record.
        seats: of all balls.
        caps: as measured.
        parts: printed.
        drawn: bodies of the assembly, of which all that is bought is taken.

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
    bought = drawn.keys() - {*NOT_BODIES, *OWN, *(part.part.name for part in parts)}
    bought = {name for name in bought if not name.startswith("ball_")}
    swung = turning(context, ())
    return MeasuredPrototype(
        context,
        centre,
        radius,
        body,
        body_radius,
        prepare_for_rays(context.pinhole, surfaces),
        _obstacles(of_roles(parts, "base", "cap"), drawn, bought & swung),
        _obstacles(of_roles(parts, "stage", "frame"), drawn, bought - swung),
    )


def _obstacles(
    parts: list[MeasuredPart], drawn: Mapping[str, Shape], bought: set[str]
) -> Obstacles:
    meshes = {part.part.name: part.placed_mesh for part in parts}
    shapes = [(name, *drawn[name]) for name in sorted(bought)]
    meshes |= {name: indexed_mesh(points, faces.astype(np.int32)) for name, points, faces in shapes}
    if not meshes:
        return Obstacles(None, np.full(1, -1), ())
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes.values()])
    scene = build_scene(join_meshes([*meshes.values()]))
    return Obstacles(scene, np.append(owner, -1), tuple(meshes))
