"""Caps: parts made like balls whose front is turned to a larger radius, for the same seats.

In the cap's own frame the centre of its body is the origin and its axis, away from the light, z.
"""

from collections import Counter

import numpy as np
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
)
from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face

from tbcad.cad.solids import moved, one_solid, revolved
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.purchased import magnet_name
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.purchased.parts import Parts

WEB_MM = 0.8  # between the flat and the pads, and round the magnet's pocket
FRONT_MM = 2.0  # least material before the pocket


def cap_parts(base: BaseLayout, made: PrototypeLayout) -> list[PlacedSolid]:
    """A cap for each ball that is not bought, in its seat, its front up when it is printed.

    Raises:
        InvalidSolidError: when the kernel fails.
    """
    return [_cap(base, made, k) for k in np.flatnonzero(made.balls.cap).tolist()]


def _cap(base: BaseLayout, made: PrototypeLayout, k: int) -> PlacedSolid:
    seats, name = base.seats, f"cap_{k + 1}"
    line = _section(base, float(made.balls.radius[k]), float(made.balls.body_depth[k]), k)
    axes = seats.axes[k]
    shape = one_solid(name, moved(revolved(line), axes, seats.centre[k]))
    # Turned over, so that the front is up and the flat lies on the bed.
    over = axes.T @ np.diag([1.0, -1.0, -1.0])
    return PlacedSolid(
        name, shape, over, np.array([0, 0, flat_depth(base, k)]) - seats.centre[k] @ over
    )


def flat_depth(base: BaseLayout, k: int) -> float:
    """Distance of the flat behind the centre of the body, clear of the pads, mm."""
    seats = base.seats
    angle = seats.tilt - np.arcsin((seats.pad[k] + WEB_MM) / seats.radius[k])
    return float(seats.radius[k] * np.cos(angle))


def cap_pocket(base: BaseLayout, k: int, depth: float) -> tuple[float, float]:
    """Radius and depth of the pocket for the cap's own magnet, mm; zeros where there is none.

    Args:
        base: with the seats.
        k: number of the seat.
        depth: of the body's centre behind the apex, mm.
    """
    keys, behind = base.keys, flat_depth(base, k)
    wide = float(np.sqrt(base.seats.radius[k] ** 2 - behind**2)) - WEB_MM
    sizes = [(size + keys.magnet_play_mm) / 2 for size in keys.magnets_mm]
    fitting = [size for size in sizes if size <= wide]
    if keys.hold == "glue" or not fitting or depth + behind < keys.magnet_height_mm + FRONT_MM:
        return 0.0, 0.0
    return max(fitting), keys.magnet_height_mm


def cap_magnets(base: BaseLayout, made: PrototypeLayout, parts: Parts) -> dict[str, int]:
    """Magnets in the caps' own pockets, by name.

    Raises:
        SpecError: when one is in no list.
    """
    depth, play = made.balls.body_depth, base.keys.magnet_play_mm
    radii = [
        cap_pocket(base, k, float(depth[k]))[0] for k in np.flatnonzero(made.balls.cap).tolist()
    ]
    return dict(Counter(magnet_name(base, 2 * r - play, parts) for r in radii if r))


def _section(base: BaseLayout, front: float, depth: float, k: int) -> TopoDS_Face:
    """Half section (x out, z along) in y = 0: front, body, flat, pocket."""
    body, behind = float(base.seats.radius[k]), flat_depth(base, k)
    wide, deep = cap_pocket(base, k, depth)
    edge = body / np.sqrt(2)
    wire = BRepBuilderAPI_MakeWire()
    apex, rim = (0.0, -depth), (float(np.sqrt(body**2 - behind**2)), behind)
    if front > body:
        wire.Add(_arc(front - depth, front, apex, (edge, -edge)))
        wire.Add(_arc(0.0, body, (edge, -edge), rim))
    else:
        wire.Add(_arc(0.0, body, apex, rim))
    inner = (
        [(wide, behind), (wide, behind - deep), (0.0, behind - deep)] if wide else [(0.0, behind)]
    )
    for a, b in zip([rim, *inner], [*inner, apex], strict=True):
        wire.Add(BRepBuilderAPI_MakeEdge(gp_Pnt(a[0], 0, a[1]), gp_Pnt(b[0], 0, b[1])).Edge())
    return BRepBuilderAPI_MakeFace(wire.Wire(), True).Face()


def _arc(
    middle: float, radius: float, start: tuple[float, float], end: tuple[float, float]
) -> TopoDS_Edge:
    """Arc about a point of the axis between two points (x, z), z rising."""
    circle = gp_Circ(gp_Ax2(gp_Pnt(0, 0, middle), gp_Dir(0, -1, 0), gp_Dir(1, 0, 0)), radius)
    ends = (gp_Pnt(start[0], 0, start[1]), gp_Pnt(end[0], 0, end[1]))
    return BRepBuilderAPI_MakeEdge(circle, *ends).Edge()
