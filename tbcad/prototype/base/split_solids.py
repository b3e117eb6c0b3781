"""The base cut to fit the bed: flanges, holes and numbers of its joints, and the pieces.

All is built in the carrier's own frame: z the axis, x azimuth zero.
"""

import numpy as np
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.kernel.checks import SolidProperties, checked
from tbcad.cad.kernel.glyphs import fitting_height, relief
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.meshing import volume_by_cut_mesh
from tbcad.cad.kernel.solids import common, cut, cylinder, polygon, prism, revolved_polygon
from tbcad.core.geometry.vectors import perpendicular_axes, unit
from tbcad.core.spec.design import PrinterSpec
from tbcad.prototype.base.hub import SCREW_MM
from tbcad.prototype.base.joints import ACCESS_MM, LABEL_MM, Joint, flange_profile, joint_hardware
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.split import BaseSplit, downward_directions
from tbcad.prototype.printed import PlacedSolid, placed_on_bed
from tbcad.types import Bools, Floats

FAR_MM = 2000.0  # larger than any base
CHORD_MM = 0.02  # error of meshes that volumes are taken from
THROUGH_MM = 1.0  # tools stick out this far
RECESS_MM = 0.2  # that the space over heads and numbers reaches into their flange
SUNK_MM = 0.4  # of numbers into their face
LABEL_ROOM = 0.95  # of a number's place
FLANGE_END = 0.7  # of a rib's thickness, by which flanges end inside the ribs at the edges
SAME_PLANE = 1e-12


def flange_solids(base: BaseLayout, split: BaseSplit) -> list[TopoDS_Shape]:
    """Both flanges of each joint in one solid."""
    (low, high), thickness, flanges = base.sector, base.spec.joint_mm, []
    inside = FLANGE_END * base.spec.rib_mm / float(base.inner[:, 1].max())
    for joint in split.joints:
        normal = joint.plane.normal
        band = revolved_polygon(flange_profile(base), low + inside, high - low - 2 * inside)
        slab = prism(_square(normal, joint.plane.level - thickness), 2 * thickness * normal)
        flanges.append(cut(common(band, slab), [_beyond(row) for row in joint.region]))
    return flanges


def _square(normal: Floats, level: float) -> TopoDS_Shape:
    """A square across a unit normal, larger than any base."""
    one, two = -perpendicular_axes(normal)
    corners = np.stack([-one - two, one - two, one + two, two - one]) * FAR_MM / 2
    return polygon(level * normal + corners)


def _beyond(row: Floats) -> TopoDS_Shape:
    """All that is above a plane, given as unit normal and level."""
    return prism(_square(row[:3], float(row[3])), FAR_MM * row[:3])


def number_solids(base: BaseLayout, split: BaseSplit) -> list[TopoDS_Shape]:
    """The number of the piece, from 1, on the outer face of each of its flanges."""
    return [
        solid
        for joint in split.joints
        for out, place in _labels(joint)
        for solid in _number(base, split, out, place)
    ]


def label_windows(base: BaseLayout, split: BaseSplit) -> list[TopoDS_Shape]:
    """Windows that ribs and rings leave over these numbers."""
    return [
        cylinder(place + (base.spec.joint_mm - RECESS_MM) * out, out, LABEL_MM, ACCESS_MM)
        for joint in split.joints
        for out, place in _labels(joint)
    ]


def _labels(joint: Joint) -> list[tuple[Floats, Floats]]:
    """Direction out of the flange and place on the joint's plane of both numbers."""
    normal = joint.plane.normal
    return list(zip((-normal, normal), joint.labels, strict=True))


def _number(base: BaseLayout, split: BaseSplit, out: Floats, place: Floats) -> list[TopoDS_Shape]:
    """A number whose top points away from the axis."""
    at = place + base.spec.joint_mm * out
    from_axis = at * [1.0, 1.0, 0.0]
    up = unit(from_axis - (from_axis @ out) * out)
    text = str(split.piece_of(at) + 1)
    height = fitting_height(text, base.spec.digit_mm, LABEL_ROOM * LABEL_MM)
    axes = np.stack([np.cross(up, out), up, out])
    return relief(text, height, base.spec.relief_mm, SUNK_MM, axes, at)


def carrier_pieces(
    base: BaseLayout, split: BaseSplit, whole: TopoDS_Solid, printer: PrinterSpec, mesh_mm: float
) -> list[PlacedSolid]:
    """The pieces of a whole carrier with flanges, placed on the bed; meshes within mesh_mm.

    SpecError when a piece does not fit, InvalidSolidError when the kernel fails.
    """
    seats = base.local_seats
    return [
        placed_on_bed(
            f"carrier_{n + 1}",
            *_piece(base, split, n, whole, mesh_mm),
            downward_directions(base, piece),
            base.axes,
            printer,
            seats.pad_normals[_seats_in(base, split, n)].reshape(-1, 3),
        )
        for n, piece in enumerate(split.pieces)
    ]


def _piece(
    base: BaseLayout, split: BaseSplit, n: int, whole: TopoDS_Solid, mesh_mm: float
) -> tuple[TopoDS_Solid, Mesh, SolidProperties]:
    piece, holes, seats = split.pieces[n], piece_holes(base, split, n), base.local_seats
    expected = volume_by_cut_mesh(whole, piece, holes, CHORD_MM)
    shape = cut(whole, [*(_beyond(row) for row in piece), *holes])
    in_piece = _seats_in(base, split, n)
    contacts, pads = seats.contacts[in_piece].reshape(-1, 3), np.repeat(seats.pad[in_piece], 3)
    return checked(f"carrier_{n + 1}", shape, expected, contacts, pads, mesh_mm)


def _seats_in(base: BaseLayout, split: BaseSplit, n: int) -> Bools:
    seats = base.local_seats
    return np.array([split.piece_of(end) == n for end in seats.at_depth(seats.back)])


def piece_holes(base: BaseLayout, split: BaseSplit, n: int) -> list[TopoDS_Shape]:
    """Holes of a piece at its joints, cut from beyond the plane."""
    return [
        hole
        for joint in split.joints
        for side in (-1, 1)
        if (np.abs(split.pieces[n] + side * joint.plane.row).max(axis=1) < SAME_PLANE).any()
        for hole in _side_holes(base, joint, side)
    ]


def _side_holes(base: BaseLayout, joint: Joint, side: int) -> list[TopoDS_Shape]:
    """Holes of a joint above (1) or below its plane (-1): dowels, inserts, screws, their heads."""
    spec, hardware, out = base.spec, joint_hardware(base.spec), side * joint.plane.normal
    dowel = spec.dowel_mm + (spec.dowel_slip_mm if side > 0 else spec.dowel_press_mm)
    holes = [_hole(at, out, dowel, hardware.dowel_depth) for at in joint.dowels]
    for at, head in zip(joint.screws, joint.heads.tolist(), strict=True):
        if head == side:
            start = at + (spec.joint_mm - RECESS_MM) * out
            holes.append(_hole(at, out, SCREW_MM, spec.joint_mm + THROUGH_MM))
            holes.append(cylinder(start, out, hardware.access_radius, ACCESS_MM))
        else:
            holes.append(_hole(at, out, spec.insert_hole_mm, spec.insert_depth_mm))
    return holes


def _hole(at: Floats, out: Floats, diameter: float, depth: float) -> TopoDS_Shape:
    return cylinder(at - THROUGH_MM * out, out, diameter / 2, depth + THROUGH_MM)
