"""The base cut to fit the bed: flanges, holes and numbers of its joints, and the pieces.

All is built in the carrier's own frame: z the axis, x azimuth zero.
"""

import numpy as np
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.checks import checked
from tbcad.cad.glyphs import fitting, relief
from tbcad.cad.solids import common, cut, cylinder, polygon, prism, ring, volume_by_cut_mesh
from tbcad.geometry.vectors import unit
from tbcad.prototype.base.hub import SCREW_MM
from tbcad.prototype.base.joints import ACCESS_MM, LABEL_MM, Joint, flange_profile
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.screws import access_radius, joint_hardware
from tbcad.prototype.base.split import BaseSplit, downward_directions
from tbcad.prototype.printing.placing import PlacedSolid, placed_on_bed
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Floats

FAR_MM = 2000.0
FINE_MM = 0.02  # of meshes, for volumes
THROUGH_MM = 1.0  # tools stick out this far
SPOT_MM = 0.2  # that heads and numbers are let into their flange
SUNK_MM = 0.4
LABEL_ROOM = 0.95


def flange_solids(base: BaseLayout, plan: BaseSplit) -> list[TopoDS_Shape]:
    """Both flanges of each joint in one."""
    return [_flange(base, joint) for joint in plan.joints]


def _flange(base: BaseLayout, joint: Joint) -> TopoDS_Shape:
    low, high = base.sector
    # Its ends lie within the ribs at the edges.
    inside = 0.7 * base.keys.rib_mm / float(base.inner[:, 1].max())
    band = ring(flange_profile(base), low + inside, high - low - 2 * inside)
    thick, normal = base.keys.joint_mm, joint.plane.normal
    slab = prism(_square(normal, joint.plane.level - thick), 2 * thick * normal)
    return cut(common(band, slab), [_beyond(row) for row in joint.within])


def _square(normal: Floats, level: float) -> TopoDS_Shape:
    """A square across a unit normal, larger than any base."""
    one = unit(np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))]))
    two = np.cross(normal, one)
    corners = np.stack([-one - two, one - two, one + two, two - one]) * FAR_MM / 2
    return polygon(level * normal + corners)


def _beyond(row: Floats) -> TopoDS_Shape:
    """All that is above a plane, given as unit normal and level."""
    return prism(_square(row[:3], float(row[3])), FAR_MM * row[:3])


def number_solids(base: BaseLayout, plan: BaseSplit) -> list[TopoDS_Shape]:
    """The number of the piece, from 1, on the outer face of each of its flanges."""
    return [
        solid
        for joint in plan.joints
        for side, place in zip((-1, 1), joint.labels, strict=True)
        for solid in _number(base, plan, side * joint.plane.normal, place)
    ]


def label_windows(base: BaseLayout, plan: BaseSplit) -> list[TopoDS_Shape]:
    """What ribs and rings leave free over these numbers."""
    return [
        cylinder(place + (base.keys.joint_mm - SPOT_MM) * out, out, LABEL_MM, ACCESS_MM)
        for joint in plan.joints
        for out, place in zip(joint.plane.normal * [[-1], [1]], joint.labels, strict=True)
    ]


def _number(base: BaseLayout, plan: BaseSplit, out: Floats, place: Floats) -> list[TopoDS_Shape]:
    """A number whose top points away from the axis."""
    at = place + base.keys.joint_mm * out
    away = at * [1.0, 1.0, 0.0]
    up = unit(away - (away @ out) * out)
    text = str(plan.piece_of(at) + 1)
    height = fitting(text, base.keys.digit_mm, LABEL_ROOM * LABEL_MM)
    axes = np.stack([np.cross(up, out), up, out])
    return relief(text, height, base.keys.relief_mm, SUNK_MM, axes, at)


def carrier_pieces(
    base: BaseLayout, plan: BaseSplit, whole: TopoDS_Solid, printer: PrinterSpec
) -> list[PlacedSolid]:
    """The pieces laid on the bed.

    Args:
        base: that is cut.
        plan: how.
        whole: the carrier with its flanges, not yet cut.
        printer: with its bed.

    Raises:
        SpecError: when a piece does not fit the bed.
        InvalidSolidError: when the kernel fails.
    """
    return [
        placed_on_bed(
            f"carrier_{n + 1}",
            _piece(base, plan, n, whole),
            downward_directions(base, planes),
            base.axes,
            printer,
        )
        for n, planes in enumerate(plan.pieces)
    ]


def _piece(base: BaseLayout, plan: BaseSplit, n: int, whole: TopoDS_Solid) -> TopoDS_Solid:
    planes, tools = plan.pieces[n], piece_holes(base, plan, n)
    expected = volume_by_cut_mesh(whole, planes, tools, FINE_MM)
    shape = cut(whole, [*(_beyond(row) for row in planes), *tools])
    seats = base.own_seats
    ends = seats.centre + seats.back[:, None] * seats.axis
    own = np.array([plan.piece_of(end) == n for end in ends])
    contacts, pads = seats.contacts[own].reshape(-1, 3), np.repeat(seats.pad[own], 3)
    return checked(f"carrier_{n + 1}", shape, expected, contacts, pads)


def piece_holes(base: BaseLayout, plan: BaseSplit, n: int) -> list[TopoDS_Shape]:
    """What is cut out of a piece at its joints, from beyond the plane."""
    found = []
    for joint in plan.joints:
        row = np.array([*joint.plane.normal, joint.plane.level])
        for side in (-1, 1):
            if (np.abs(plan.pieces[n] + side * row).max(axis=1) < 1e-12).any():
                found += _side(base, joint, side)
    return found


def _side(base: BaseLayout, joint: Joint, side: int) -> list[TopoDS_Shape]:
    """Holes of a joint above (1) or below its plane (-1): dowels, inserts, screws, their heads."""
    keys, size, out = base.keys, joint_hardware(base.keys), side * joint.plane.normal
    pin = keys.dowel_mm + (keys.dowel_slip_mm if side > 0 else keys.dowel_press_mm)
    found = [_hole(at, out, pin, size.dowel_depth) for at in joint.dowels]
    for at, head in zip(joint.screws, joint.heads.tolist(), strict=True):
        if head == side:
            start = at + (keys.joint_mm - SPOT_MM) * out
            found.append(_hole(at, out, SCREW_MM, keys.joint_mm + THROUGH_MM))
            found.append(cylinder(start, out, access_radius(size), ACCESS_MM))
        else:
            found.append(_hole(at, out, keys.insert_hole_mm, keys.insert_depth_mm))
    return found


def _hole(at: Floats, out: Floats, diameter: float, depth: float) -> TopoDS_Shape:
    return cylinder(at - THROUGH_MM * out, out, diameter / 2, depth + THROUGH_MM)
