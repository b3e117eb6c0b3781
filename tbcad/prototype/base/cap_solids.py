"""Caps: parts like balls whose front is turned to a larger radius, for the same seats.

In the cap's own frame the centre of its body is the origin and its axis, away from the light, z.
"""

import numpy as np
from OCP.TopoDS import TopoDS_Face

from tbcad.cad.kernel.checks import closed_mesh
from tbcad.cad.kernel.measures import properties
from tbcad.cad.kernel.solids import moved, one_solid, revolved
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.caps import cap_pocket, cap_spigot, flat_depth
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.seat_solids import Point, arc_about_axis, lines, section_face
from tbcad.prototype.printed import PlacedSolid

UPSIDE_DOWN = np.diag([1.0, -1.0, -1.0])


def cap_parts(base: BaseLayout, prototype: PrototypeLayout, mesh_mm: float) -> list[PlacedSolid]:
    """A cap for each ball that is not bought, in its seat, its front up when it is printed.

    Raises:
        InvalidSolidError: when the kernel fails.
    """
    caps = np.flatnonzero(prototype.balls.cap).tolist()
    return [_cap(base, prototype, k, mesh_mm) for k in caps]


def _cap(base: BaseLayout, prototype: PrototypeLayout, k: int, mesh_mm: float) -> PlacedSolid:
    seats, balls, name = base.seats, prototype.balls, f"cap_{k + 1}"
    section = _section(base, float(balls.radius[k]), float(balls.body_depth[k]), k)
    axes, centre = seats.axes[k], seats.centre[k]
    shape = one_solid(name, moved(revolved(section), axes, centre))
    # The front is up and the flat lies on the bed.
    on_bed = axes.T @ UPSIDE_DOWN
    _, end = cap_spigot(base, k)
    mesh, origin = closed_mesh(name, shape, mesh_mm), np.array([0, 0, end]) - centre @ on_bed
    return PlacedSolid(name, shape, mesh, properties(shape), on_bed, origin)


def _section(base: BaseLayout, front: float, depth: float, k: int) -> TopoDS_Face:
    """Half section in y = 0: front, body, flat, spigot, pocket."""
    body, flat = float(base.seats.radius[k]), flat_depth(base, k)
    pocket, pocket_depth = cap_pocket(base, k, depth)
    spigot, end = cap_spigot(base, k)
    half_width = body / np.sqrt(2)
    apex, edge = (0.0, -depth), (half_width, -half_width)
    rim = (float(np.sqrt(body**2 - flat**2)), flat)
    if front > body:
        arcs = [
            arc_about_axis(front - depth, front, apex, edge),
            arc_about_axis(0.0, body, edge, rim),
        ]
    else:
        arcs = [arc_about_axis(0.0, body, apex, rim)]
    back: list[Point] = [(spigot, flat), (spigot, end)]
    if pocket:
        back += [(pocket, end), (pocket, end - pocket_depth)]
    back.append((0.0, end - (pocket_depth if pocket else 0.0)))
    return section_face([*arcs, *lines([rim, *back, apex])])
