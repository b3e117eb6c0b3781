"""Caps: parts like balls whose front is turned to a larger radius, for the same seats.

Pads fix the centre of a ball, which is all a ball needs; a cap could tilt on them, and its front's
centre with it. A spigot in the pocket of the seat's magnet takes that up.

In the cap's own frame the centre of its body is the origin and its axis, away from the light, z.
"""

import numpy as np
from OCP.TopoDS import TopoDS_Face

from tbcad.cad.checks import closed_mesh
from tbcad.cad.measures import properties
from tbcad.cad.solids import moved, one_solid, revolved
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.fasteners import magnet_part
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.seat_solids import Point, arc_about_axis, lines, section_face
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.purchased.parts import Parts

WEB_MM = 0.8  # between the flat and the pads, and round the magnet's pocket
FRONT_MM = 2.0  # minimum material before the pocket
SPIGOT_GAP_MM = 0.2  # between a spigot and the magnet or well behind it
SHOULDER_MM = 0.1  # of the flat round the spigot
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


def cap_spigot(base: BaseLayout, k: int) -> tuple[float, float]:
    """Radius of a cap's spigot, and distance of its end behind the centre of the body, mm."""
    spec, seats = base.spec, base.seats
    gap = min(SPIGOT_GAP_MM, spec.magnet_gap_mm / 2)
    end = float(seats.radius[k]) + spec.magnet_gap_mm - gap
    return float(seats.pocket[k]) - spec.cap_play_mm / 2, end


def cap_tilt(base: BaseLayout, k: int) -> float:
    """Largest tilt of a cap on its pads, until its spigot touches the pocket, radians."""
    _, end = cap_spigot(base, k)
    return float(np.arcsin(base.spec.cap_play_mm / 2 / end))


def flat_depth(base: BaseLayout, k: int) -> float:
    """Distance of the flat behind the centre of the body, clear of the pads, mm."""
    seats, (spigot, _) = base.seats, cap_spigot(base, k)
    radius = float(seats.radius[k])
    angle = seats.tilt - np.arcsin((seats.pad[k] + WEB_MM) / radius)
    wide = float(np.sqrt(radius**2 - (spigot + SHOULDER_MM) ** 2))
    return min(float(radius * np.cos(angle)), wide)


def cap_pocket(base: BaseLayout, k: int, depth: float) -> tuple[float, float]:
    """Radius and depth of the pocket for the cap's own magnet, mm; zeros where there is none.

    Args:
        base: with the seats.
        k: number of the seat.
        depth: of the body's centre behind the apex, mm.
    """
    spec, (spigot, end) = base.spec, cap_spigot(base, k)
    largest = spigot - WEB_MM
    radii = [(size + spec.magnet_play_mm) / 2 for size in spec.magnets_mm]
    fitting = [radius for radius in radii if radius <= largest]
    if spec.holds[0] == "glue" or not fitting or depth + end < spec.magnet_height_mm + FRONT_MM:
        return 0.0, 0.0
    return max(fitting), spec.magnet_height_mm


def cap_magnets(base: BaseLayout, prototype: PrototypeLayout, parts: Parts) -> list[Fastener]:
    """Magnets in the caps' own pockets.

    Raises:
        SpecError: when one is in no list.
    """
    seats, spec, magnets = base.seats, base.spec, []
    for k in np.flatnonzero(prototype.balls.cap).tolist():
        radius, height = cap_pocket(base, k, float(prototype.balls.body_depth[k]))
        if radius:
            part = magnet_part(2 * radius - spec.magnet_play_mm, height, parts)
            place = seats.centre[k] + cap_spigot(base, k)[1] * seats.axis[k]
            magnets.append(Fastener(part, place, -seats.axis[k], (f"cap_{k + 1}",), rotates=True))
    return magnets


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
