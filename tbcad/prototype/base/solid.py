"""The carrier as a solid: wall, ribs, rings, hub and bosses in one fuse, all holes in one cut.

Built about z with azimuth zero along x, then moved into the frame of the shell.
"""

import numpy as np
from manifold3d import Manifold
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.brep import InvalidSolidError
from tbcad.cad.checks import COARSE_MM, checked
from tbcad.cad.glyphs import fitting_height, relief
from tbcad.cad.measures import SolidProperties
from tbcad.cad.mesh import Mesh
from tbcad.cad.meshing import as_manifold, volume_by_meshes
from tbcad.cad.primitive_meshes import moved_mesh
from tbcad.cad.solids import cut, fused, polygon, polyhedron, prism, revolved_polygon
from tbcad.prototype.base import hub_solids, seat_solids
from tbcad.prototype.base.gaps import rib_gaps, ring_arcs
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.profile import meridian
from tbcad.prototype.base.seats import Seats
from tbcad.prototype.base.split import UNCUT, BaseSplit, downward_directions
from tbcad.prototype.base.split_solids import (
    carrier_pieces,
    flange_solids,
    label_windows,
    number_solids,
)
from tbcad.prototype.base.wall import wall_facets
from tbcad.prototype.printing.placing import PlacedSolid, placed_on_bed
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Floats

SUNK_MM = 0.4  # of numbers into their face
# Distances (mm) within which points are the same to the kernel, tried in turn; at 1e-6 meshes have
# gaps of some nanometres more often than not.
SAME_MM = (1e-5, 1e-6, 1e-4)
COLUMN_MM = 80.0  # length of the space that is kept free behind a boss
RIB_ROOT = 0.6  # of the hub's radius, to where ribs go in it
LABEL_ROOM = 0.85  # of a boss's end
RIB_MIDDLE = -0.5  # of a rib beside its azimuth, in its thicknesses


def carrier_parts(
    base: BaseLayout, split: BaseSplit, printer: PrinterSpec, mesh_mm: float
) -> list[PlacedSolid]:
    """The carrier placed on the bed: in one piece or as it is split.

    Args:
        base: in numbers.
        split: how it is cut.
        printer: with its bed.
        mesh_mm: largest distance of meshes from the surface.

    Raises:
        SpecError: when a piece does not fit; it says how large the bed must be.
        InvalidSolidError: when the kernel fails.
    """
    solid, mesh, properties = carrier_solid(base, mesh_mm, split)
    if split.joints:
        return carrier_pieces(base, split, solid, printer, mesh_mm)
    directions = downward_directions(base, split.pieces[0])
    pads = base.local_seats.pad_normals.reshape(-1, 3)
    return [placed_on_bed("carrier", solid, mesh, properties, directions, base.axes, printer, pads)]


def carrier_solid(
    base: BaseLayout, mesh_mm: float, split: BaseSplit = UNCUT
) -> tuple[TopoDS_Solid, Mesh, SolidProperties]:
    """The carrier before it is cut up, about z, with the flanges of its joints; mesh, properties.

    Raises:
        InvalidSolidError: when the kernel fails at every distance of SAME_MM.
    """
    seats = base.local_seats
    added, removed = added_solids(base, seats, split), removed_solids(base, seats)
    hollows = [_hollow_mesh(seats, k) for k in range(len(seats))]
    bodies, others = (
        [as_manifold(one, COARSE_MM) for one in some] for some in (added, removed[len(seats) :])
    )
    expected = volume_by_meshes(bodies, [*hollows, *others])
    contacts, pads = seats.contacts.reshape(-1, 3), np.repeat(seats.pad, 3)
    errors = []
    for same in SAME_MM:
        try:
            shape = cut(fused(added, same), removed, same)
            return checked("carrier", shape, expected, contacts, pads, mesh_mm)
        except InvalidSolidError as error:
            errors.append(error)
    raise errors[0]


def added_solids(base: BaseLayout, seats: Seats, split: BaseSplit = UNCUT) -> list[TopoDS_Shape]:
    """Solids whose union is the carrier before anything is cut out."""
    labels = number_solids(base, split)
    labels += [solid for k in range(len(seats)) for solid in _number(base, seats, k)]
    bosses = _at_seats(seats, [seat_solids.boss_solid(seats, k) for k in range(len(seats))])
    return [
        polyhedron(wall_facets(base)),
        *_struts(base, split),
        *hub_solids.hub_bodies(base.hub),
        *bosses,
        *labels,
    ]


def removed_solids(base: BaseLayout, seats: Seats) -> list[TopoDS_Shape]:
    """What is cut out of that union: first the hollows of all seats, then paths and holes."""
    cups = [seat_solids.seat_hollow(seats, k, seats.pad_offset) for k in range(len(seats))]
    paths = [seat_solids.insertion_path(seats, k) for k in range(len(seats))]
    holes = hub_solids.hub_holes(base.hub, base.spec)
    return [*_at_seats(seats, cups), *_at_seats(seats, paths), *holes]


def _hollow_mesh(seats: Seats, k: int) -> Manifold:
    mesh = seat_solids.seat_hollow_mesh(seats, k, seats.pad_offset)
    return moved_mesh(mesh, seats.axes[k], seats.centre[k])


def _at_seats(seats: Seats, shapes: list[TopoDS_Shape]) -> list[TopoDS_Shape]:
    """Shapes, one in the own frame of each seat, moved to their places."""
    return [seat_solids.moved_to_seat(shape, seats, k) for k, shape in enumerate(shapes)]


def _struts(base: BaseLayout, split: BaseSplit) -> list[TopoDS_Shape]:
    """Ribs, rings and flanges, left out where numbers are read."""
    low, high = base.sector
    # Their ends are within the ribs at the edges, not in a plane with other faces.
    inside = base.spec.rib_mm / 2 / float(base.inner[:, 1].max())
    rings = [
        revolved_polygon(section, start, end - start)
        for section in base.rings
        for start, end in ring_arcs(base, section, low + inside, high - inside)
    ]
    struts, flanges = [*_ribs(base), *rings], flange_solids(base, split)
    if not flanges:
        return struts
    return [cut(fused([*struts, *flanges]), [*_columns(base), *label_windows(base, split)])]


def _columns(base: BaseLayout) -> list[TopoDS_Shape]:
    """The space that is kept free behind all bosses."""
    seats = base.local_seats
    columns = [seat_solids.column_behind_boss(seats, k, COLUMN_MM) for k in range(len(seats))]
    return _at_seats(seats, columns)


def _ribs(base: BaseLayout) -> list[TopoDS_Shape]:
    """Plates along meridians; those at the edges end with the wall."""
    section, thickness = _rib_section(base), base.spec.rib_mm
    sides = np.full(len(base.ribs), RIB_MIDDLE)
    sides[0], sides[-1] = 0.0, -1.0
    # Gaps are cut by plates of twice the thickness about the same middle.
    return [
        cut(
            _plate(section, azimuth, thickness, side),
            [
                _plate(gap, azimuth, 2 * thickness, (side + RIB_MIDDLE) / 2)
                for gap in rib_gaps(base, azimuth, side)
            ],
        )
        for azimuth, side in zip(base.ribs.tolist(), sides.tolist(), strict=True)
    ]


def _rib_section(base: BaseLayout) -> Floats:
    """Polygon (n, 2) of (z, r): from the middle of the wall to the ribs' outline."""
    radius = RIB_ROOT * (base.hub.boss or base.hub.disc)
    # Where ribs meet, their faces are in one plane across the axis, or not nearly so.
    root = [[base.middle[0, 0], radius], [base.outline[0, 0], radius]]
    return np.vstack([root, base.outline, base.middle[::-1]])


def _plate(section: Floats, azimuth: float, thickness: float, side: float) -> TopoDS_Shape:
    """A polygon (z, r) at an azimuth as a plate that begins beside it, in thicknesses."""
    z, r = section.T
    out, across = meridian(azimuth)
    corners = r[:, None] * out + side * thickness * across
    corners[:, 2] = z
    return prism(polygon(corners), thickness * across)


def _number(base: BaseLayout, seats: Seats, k: int) -> list[TopoDS_Shape]:
    """The ball's number, from 1, on the end of its boss; its top is toward the camera."""
    text, spec = str(k + 1), base.spec
    up, _, out = seats.axes[k]
    height = fitting_height(text, spec.digit_mm, LABEL_ROOM * float(seats.boss[k]))
    axes = np.stack([np.cross(up, out), up, out])
    at = seats.centre[k] + seats.back[k] * out
    return relief(text, height, spec.relief_mm, SUNK_MM, axes, at)
