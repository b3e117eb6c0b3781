"""Caps: parts like balls whose front is turned to a larger radius, for the same seats.

In the cap's own frame the centre of its body is the origin and its axis, away from the light, z.
"""

from collections import Counter

import numpy as np
from OCP.TopoDS import TopoDS_Face

from tbcad.cad.solids import moved, one_solid, revolved
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.purchased import magnet_name
from tbcad.prototype.base.seat_solids import Point, arc_about_axis, lines, section_face
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.purchased.parts import Parts

WEB_MM = 0.8  # between the flat and the pads, and round the magnet's pocket
FRONT_MM = 2.0  # minimum material before the pocket
UPSIDE_DOWN = np.diag([1.0, -1.0, -1.0])


def cap_parts(base: BaseLayout, prototype: PrototypeLayout) -> list[PlacedSolid]:
    """A cap for each ball that is not bought, in its seat, its front up when it is printed.

    Raises:
        InvalidSolidError: when the kernel fails.
    """
    return [_cap(base, prototype, k) for k in np.flatnonzero(prototype.balls.cap).tolist()]


def _cap(base: BaseLayout, prototype: PrototypeLayout, k: int) -> PlacedSolid:
    seats, balls, name = base.seats, prototype.balls, f"cap_{k + 1}"
    section = _section(base, float(balls.radius[k]), float(balls.body_depth[k]), k)
    axes, centre = seats.axes[k], seats.centre[k]
    shape = one_solid(name, moved(revolved(section), axes, centre))
    # The front is up and the flat lies on the bed.
    on_bed = axes.T @ UPSIDE_DOWN
    return PlacedSolid(name, shape, on_bed, np.array([0, 0, flat_depth(base, k)]) - centre @ on_bed)


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
    spec, flat = base.spec, flat_depth(base, k)
    largest = float(np.sqrt(base.seats.radius[k] ** 2 - flat**2)) - WEB_MM
    radii = [(size + spec.magnet_play_mm) / 2 for size in spec.magnets_mm]
    fitting = [radius for radius in radii if radius <= largest]
    if spec.holds[0] == "glue" or not fitting or depth + flat < spec.magnet_height_mm + FRONT_MM:
        return 0.0, 0.0
    return max(fitting), spec.magnet_height_mm


def cap_magnets(base: BaseLayout, prototype: PrototypeLayout, parts: Parts) -> dict[str, int]:
    """Magnets in the caps' own pockets, by name.

    Raises:
        SpecError: when one is in no list.
    """
    depth, play = prototype.balls.body_depth, base.spec.magnet_play_mm
    caps = np.flatnonzero(prototype.balls.cap).tolist()
    radii = [cap_pocket(base, k, float(depth[k]))[0] for k in caps]
    return dict(Counter(magnet_name(base, 2 * r - play, parts) for r in radii if r))


def _section(base: BaseLayout, front: float, depth: float, k: int) -> TopoDS_Face:
    """Half section in y = 0: front, body, flat, pocket."""
    body, flat = float(base.seats.radius[k]), flat_depth(base, k)
    pocket, pocket_depth = cap_pocket(base, k, depth)
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
    back: list[Point] = [(0.0, flat)]
    if pocket:
        bottom = flat - pocket_depth
        back = [(pocket, flat), (pocket, bottom), (0.0, bottom)]
    return section_face([*arcs, *lines([rim, *back, apex])])
