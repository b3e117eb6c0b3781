"""The carrier as a solid: wall, ribs, rings, hub and bosses in one fuse, the hollows in one cut.

Built about z with azimuth zero along x, then moved into the frame of the shell.
"""

import numpy as np
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.brep import InvalidSolidError
from tbcad.cad.checks import COARSE_MM, checked
from tbcad.cad.glyphs import fitting, relief
from tbcad.cad.solids import cut, fused, polygon, prism, ring, volume_by_meshes
from tbcad.prototype.base import hub_solids as hubs
from tbcad.prototype.base import seat_solids as seat
from tbcad.prototype.base.gaps import rib_gaps, ring_arcs
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.seats import Seats
from tbcad.prototype.base.split import BaseSplit, downward_directions
from tbcad.prototype.base.split_solids import (
    carrier_pieces,
    flange_solids,
    label_windows,
    number_solids,
)
from tbcad.prototype.printing.placing import PlacedSolid, placed_on_bed
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Floats

SUNK_MM = 0.4
# Tried in turn, mm; at 1e-6 meshes have gaps of some nanometres more often than not.
SAME = (1e-5, 1e-6, 1e-4)
COLUMN_MM = 80.0
# Of the hub's radius, to where ribs go in it.
ROOT = 0.6
LABEL_ROOM = 0.85  # of a boss's end


def carrier_parts(base: BaseLayout, plan: BaseSplit, printer: PrinterSpec) -> list[PlacedSolid]:
    """The carrier laid on the bed: in one piece where it fits, else in as few as can be.

    Args:
        base: in numbers.
        plan: how it is cut.
        printer: with its bed.

    Raises:
        SpecError: when a piece does not fit; it says how large the bed must be.
        InvalidSolidError: when the kernel fails.
    """
    solid = carrier_solid(base, plan)
    if plan.joints:
        return carrier_pieces(base, plan, solid, printer)
    return [
        placed_on_bed(
            "carrier", solid, downward_directions(base, plan.pieces[0]), base.axes, printer
        )
    ]


def carrier_solid(base: BaseLayout, plan: BaseSplit | None = None) -> TopoDS_Solid:
    """The carrier before it is cut up, about z, with the flanges of its joints.

    Raises:
        InvalidSolidError: when the kernel fails, whatever it takes for the same point.
    """
    seats = base.own_seats
    added, removed = added_solids(base, seats, plan), removed_solids(base, seats)
    expected = volume_by_meshes(added, removed, COARSE_MM)
    contacts, pads = seats.contacts.reshape(-1, 3), np.repeat(seats.pad, 3)
    faults = []
    for same in SAME:
        try:
            shape = cut(fused(added, same), removed, same)
            return checked("carrier", shape, expected, contacts, pads)
        except InvalidSolidError as fault:
            faults.append(fault)
    raise faults[0]


def added_solids(
    base: BaseLayout, seats: Seats, plan: BaseSplit | None = None
) -> list[TopoDS_Shape]:
    """What the carrier is the union of."""
    plan = plan or BaseSplit((np.zeros((0, 4)),), ())
    labels = number_solids(base, plan)
    labels += [solid for k in range(len(seats)) for solid in _number(base, seats, k)]
    bosses = [seat.moved_to_seat(seat.boss_solid(seats, k), seats, k) for k in range(len(seats))]
    return [_wall(base), *_struts(base, plan), *hubs.hub_bodies(base.hub), *bosses, *labels]


def removed_solids(base: BaseLayout, seats: Seats) -> list[TopoDS_Shape]:
    """What is cut out of that union: cups with their pockets, ways of the balls, holes."""
    own = [(seat.seat_hollow(seats, k), k) for k in range(len(seats))]
    own += [(seat.insertion_path(seats, k), k) for k in range(len(seats))]
    placed = [seat.moved_to_seat(shape, seats, k) for shape, k in own]
    return [*placed, *hubs.hub_holes(base.hub, base.keys)]


def _wall(base: BaseLayout) -> TopoDS_Shape:
    low, high = base.sector
    return ring(np.vstack([base.inner, base.outer[::-1]]), low, high - low)


def _struts(base: BaseLayout, plan: BaseSplit) -> list[TopoDS_Shape]:
    """Ribs, rings and flanges, left out where numbers are read."""
    low, high = base.sector
    # Their ends lie within the ribs at the edges, not in a plane with other faces.
    inside = base.keys.rib_mm / 2 / float(base.inner[:, 1].max())
    rings = [
        ring(one, start, end - start)
        for one in base.rings
        for start, end in ring_arcs(base, one, low + inside, high - inside)
    ]
    struts, joints = [*_ribs(base), *rings], flange_solids(base, plan)
    if not joints:
        return struts
    return [cut(fused([*struts, *joints]), [*_ends(base), *label_windows(base, plan)])]


def _ends(base: BaseLayout) -> list[TopoDS_Shape]:
    seats = base.own_seats
    return [
        seat.moved_to_seat(seat.column_behind_boss(seats, k, COLUMN_MM), seats, k)
        for k in range(len(seats))
    ]


def _ribs(base: BaseLayout) -> list[TopoDS_Shape]:
    """Plates along meridians; those at the edges end with the wall."""
    section, thick = _rib_section(base), base.keys.rib_mm
    sides = np.full(len(base.ribs), -0.5)
    sides[0], sides[-1] = 0.0, -1.0
    ribs = zip(base.ribs.tolist(), sides.tolist(), strict=True)
    return [
        cut(
            _plate(section, azimuth, thick, side),
            [
                _plate(gap, azimuth, 2 * thick, (side - 0.5) / 2)
                for gap in rib_gaps(base, azimuth, side)
            ],
        )
        for azimuth, side in ribs
    ]


def _rib_section(base: BaseLayout) -> Floats:
    """Polygon (n, 2) of (z, r): from the middle of the wall to the ribs' outline."""
    held, middle = base.hub, base.middle
    reach = ROOT * (held.boss or held.disc)
    # Where ribs meet, their faces lie in one plane across the axis, or not nearly so.
    root = [[middle[0, 0], reach], [base.outline[0, 0], reach]]
    return np.vstack([root, base.outline, middle[::-1]])


def _plate(section: Floats, azimuth: float, thickness: float, side: float) -> TopoDS_Shape:
    """A polygon (z, r) at an azimuth made thick; side -0.5 is evenly to both sides."""
    z, r = section.T
    out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    across = np.array([-out[1], out[0], 0.0])
    at = r[:, None] * out + side * thickness * across
    at[:, 2] = z
    return prism(polygon(at), thickness * across)


def _number(base: BaseLayout, seats: Seats, k: int) -> list[TopoDS_Shape]:
    """The ball's number, from 1, on the end of its boss; its top is toward the camera."""
    text, room = str(k + 1), LABEL_ROOM * float(seats.boss[k])
    up, _, out = seats.axes[k]
    right = np.cross(up, out)
    height = fitting(text, base.keys.digit_mm, room)
    at = seats.centre[k] + seats.back[k] * out
    return relief(text, height, base.keys.relief_mm, SUNK_MM, np.stack([right, up, out]), at)
