"""The carrier as a solid: wall, ribs, rings, hub and bosses in one fuse, all holes in one cut.

Built about z with azimuth zero along x, then moved into the frame of the shell. The wall has plane
facets round cones about the axis: a plane meets bosses, cups and paths in circles and ellipses;
where a cone meets them the kernel fits splines, which took half of the time of the carrier.
"""

from collections.abc import Callable

import numpy as np
from manifold3d import Manifold
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.cad.kernel.checks import COARSE_MM, SolidProperties, checked
from tbcad.cad.kernel.glyphs import fitting_height, relief
from tbcad.cad.kernel.mesh import Mesh
from tbcad.cad.kernel.meshing import as_manifold, mesh_difference, mesh_of, moved_mesh
from tbcad.cad.kernel.solids import (
    cut,
    cylinder,
    fused,
    moved,
    polygon,
    polyhedron,
    prism,
    revolved_polygon,
)
from tbcad.common.reuse import kept
from tbcad.core.geometry.rotations import unit_circle
from tbcad.core.spec.design import PrinterSpec
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.base.gaps import rib_gaps, ring_arcs
from tbcad.prototype.base.hub import (
    KEY_DEPTH_MM,
    KEY_HOLE_MM,
    SCREW_MM,
    SET_SCREW_AZIMUTHS,
    SLIT_MM,
    Hub,
)
from tbcad.prototype.base.layout import FACETS_OUT_MM, BaseLayout
from tbcad.prototype.base.profile import meridian
from tbcad.prototype.base.seat_solids import (
    boss_solid,
    column_behind_boss,
    insertion_path,
    seat_hollow,
    seat_hollow_mesh,
)
from tbcad.prototype.base.seats import Seats
from tbcad.prototype.base.split import UNCUT, BaseSplit, downward_directions
from tbcad.prototype.base.split_solids import (
    carrier_pieces,
    flange_solids,
    label_windows,
    number_solids,
)
from tbcad.prototype.printed import PlacedSolid, placed_on_bed
from tbcad.types import Floats

UP = np.array([0.0, 0.0, 1.0])
THROUGH_MM = 1.0  # tools stick out this far, so that no faces coincide
SUNK_MM = 0.4  # of numbers into their face
# Distances (mm) within which points are the same to the kernel, tried in turn; at 1e-6 meshes have
# gaps of some nanometres more often than not.
SAME_MM = (1e-5, 1e-6, 1e-4)
COLUMN_MM = 80.0  # length of the space that is kept free behind a boss
RIB_ROOT = 0.6  # of the hub's radius, to where ribs go in it
HEAD_MM = 7.0  # diameter of the flat for an M3 screw's head
LABEL_ROOM = 0.85  # of a boss's end
MIN_DIGIT_MM = 6.0  # whose strokes, a fifth of it, FDM prints
RIB_MIDDLE = -0.5  # of a rib beside its azimuth, in its thicknesses


def hub_bodies(hub: Hub) -> list[TopoDS_Shape]:
    """Disc and boss."""
    disc = cylinder(hub.back * UP, UP, hub.disc, hub.front - hub.back)
    if not hub.boss:
        return [disc]
    return [disc, cylinder(hub.face * UP, UP, hub.boss, hub.back - hub.face + THROUGH_MM)]


def hub_holes(hub: Hub, spec: BaseSpec) -> list[TopoDS_Shape]:
    """Bore, the drive's holes, the key's, and those of the lock."""
    start, through = hub.face - THROUGH_MM, hub.front - hub.face + 2 * THROUGH_MM
    blind = hub.depth < hub.front - hub.face
    holes = [cylinder(start * UP, UP, hub.bore, through)]
    key = np.array([*hub.key, start])
    holes.append(cylinder(key, UP, KEY_HOLE_MM / 2, KEY_DEPTH_MM + THROUGH_MM))
    for place in hub.holes:
        length = hub.depth + THROUGH_MM if blind else through
        holes.append(cylinder(np.array([*place, start]), UP, hub.hole / 2, length))
        if hub.head[0]:
            top = np.array([*place, hub.front + THROUGH_MM])
            holes.append(cylinder(top, -UP, hub.head[0] / 2, hub.head[1] + THROUGH_MM))
    locks = {"set-screws": _set_screw_holes, "clamp": _clamp_cuts}
    return holes + (locks[hub.lock](hub, spec) if hub.lock else [])


def _set_screw_holes(hub: Hub, spec: BaseSpec) -> list[TopoDS_Shape]:
    return [
        hole
        for azimuth in SET_SCREW_AZIMUTHS.tolist()
        for hole in _screw_with_insert(hub.lock_z * UP, meridian(azimuth)[0], hub.boss, spec)
    ]


def _screw_with_insert(
    start: Floats, out: Floats, length: float, spec: BaseSpec
) -> list[TopoDS_Shape]:
    """A screw's hole from a point outward, and the insert's hole at its end."""
    end = start + (length + THROUGH_MM) * out
    return [
        cylinder(start, out, SCREW_MM / 2, length + THROUGH_MM),
        cylinder(end, -out, spec.insert_hole_mm / 2, spec.insert_depth_mm + THROUGH_MM),
    ]


def _clamp_cuts(hub: Hub, spec: BaseSpec) -> list[TopoDS_Shape]:
    """A slit away from the ribs, and a screw across it."""
    far, bottom, top = -hub.boss - THROUGH_MM, hub.face - THROUGH_MM, hub.back - SLIT_MM
    slit = _block(far, SLIT_MM / 2, bottom, top)
    # Above the slit a cut half round the bore, or the disc would hold the jaws apart.
    relief = _block(far, hub.boss + THROUGH_MM, top - SLIT_MM, top)
    across = np.array([0.0, 1.0, 0.0])
    middle = np.array([-(hub.bore + hub.boss) / 2, 0.0, hub.lock_z])
    half = float(np.sqrt(hub.boss**2 - middle[0] ** 2))
    head_side = cylinder(middle, -across, SCREW_MM / 2, half + THROUGH_MM)
    # The boss is round: without a flat its head would be half in it.
    flat = cylinder(middle - half * across, -across, HEAD_MM / 2, hub.boss)
    return [slit, relief, head_side, flat, *_screw_with_insert(middle, across, half, spec)]


def _block(far: float, half: float, low: float, high: float) -> TopoDS_Shape:
    """A block from the axis to x = far, to half a width on both sides, between two z."""
    corners = [[0, half, low], [far, half, low], [far, -half, low], [0, -half, low]]
    return prism(polygon(np.array(corners)), (high - low) * UP)


def wall_facets(base: BaseLayout) -> list[Floats]:
    """All facets (n, 3) of the wall about z, azimuth zero along x, between its sector's azimuths.

    Their middles are on the cones of the meridian section, their edges outside by FACETS_OUT_MM at
    most.
    """
    low, high = base.sector
    z, r = wall_section(base).T
    count = facet_count(float(r.max()), high - low)
    out = unit_circle(np.linspace(low, high, count + 1)) / np.cos((high - low) / (2 * count))
    corners = np.stack(np.broadcast_arrays(*(r * out[:, :1], r * out[:, 1:], z)), axis=-1)
    after = np.roll(corners, -1, axis=1)
    facets = np.stack([corners[:-1], corners[1:], after[1:], after[:-1]], axis=2)
    return [*facets.reshape(-1, 4, 3), corners[0], corners[-1]]


def wall_section(base: BaseLayout) -> Floats:
    """The meridian section of the cones (z, r), mm, (n, 2)."""
    return np.vstack([base.inner, base.outer[::-1]])


def facet_count(radius: float, angle: float) -> int:
    """How many facets about a circle (mm) over an angle (radians) leave it by FACETS_OUT_MM."""
    return int(np.ceil(angle / (2 * np.arccos(radius / (radius + FACETS_OUT_MM)))))


@kept("carrier")
def carrier_parts(
    base: BaseLayout, split: BaseSplit, printer: PrinterSpec, mesh_mm: float
) -> list[PlacedSolid]:
    """The carrier placed on the bed, in one piece or as it is split, meshes within mesh_mm.

    SpecError when a piece does not fit says how large the bed must be.
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

    InvalidSolidError when the kernel fails at every distance of SAME_MM.
    """
    seats = base.local_seats
    added, removed = added_solids(base, seats, split), removed_solids(base, seats)
    expected = mesh_difference(*_meshes(seats, added, removed[len(seats) :])).volume()
    contacts, pads = seats.contacts.reshape(-1, 3), np.repeat(seats.pad, 3)
    errors = []
    for same in SAME_MM:
        try:
            shape = cut(fused(added, same), removed, same)
            return checked("carrier", shape, expected, contacts, pads, mesh_mm)
        except InvalidSolidError as error:
            errors.append(error)
    raise errors[0]


@kept("carrier")
def carrier_mesh(base: BaseLayout, split: BaseSplit = UNCUT) -> Mesh:
    """The carrier in the frame of the shell by booleans of meshes, before its solid is built."""
    seats = base.local_seats
    added, others = added_solids(base, seats, split), _paths_and_holes(base, seats)
    net = mesh_of(mesh_difference(*_meshes(seats, added, others)))
    return Mesh(net.vertices @ base.axes, net.triangles)


def _meshes(
    seats: Seats, added: list[TopoDS_Shape], others: list[TopoDS_Shape]
) -> tuple[list[Manifold], list[Manifold]]:
    """Meshes of what is added, and of what is cut out: the hollows of the seats and others."""
    hollows = [
        moved_mesh(seat_hollow_mesh(seats, k), seats.axes[k], seats.centre[k])
        for k in range(len(seats))
    ]
    bodies, tools = ([as_manifold(one, COARSE_MM) for one in some] for some in (added, others))
    return bodies, [*hollows, *tools]


def added_solids(base: BaseLayout, seats: Seats, split: BaseSplit = UNCUT) -> list[TopoDS_Shape]:
    """Solids whose union is the carrier before anything is cut out."""
    numbers = [solid for k in range(len(seats)) for solid in _number(base, seats, k)]
    return [
        polyhedron(wall_facets(base)),
        *_struts(base, split),
        *hub_bodies(base.hub),
        *_at_seats(seats, boss_solid),
        *number_solids(base, split),
        *numbers,
    ]


def removed_solids(base: BaseLayout, seats: Seats) -> list[TopoDS_Shape]:
    """Solids cut out of that union: first the hollows of all seats, then paths and holes."""
    return [*_at_seats(seats, seat_hollow), *_paths_and_holes(base, seats)]


def _paths_and_holes(base: BaseLayout, seats: Seats) -> list[TopoDS_Shape]:
    return [*_at_seats(seats, insertion_path), *hub_holes(base.hub, base.spec)]


def _at_seats(seats: Seats, solid: Callable[[Seats, int], TopoDS_Shape]) -> list[TopoDS_Shape]:
    """A solid in the own frame of each seat, moved to its place."""
    numbers = range(len(seats))
    return [moved(solid(seats, k), seats.axes[k], seats.centre[k]) for k in numbers]


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
    # Behind all bosses space is kept free.
    columns = _at_seats(base.local_seats, lambda s, k: column_behind_boss(s, k, COLUMN_MM))
    return [cut(fused([*struts, *flanges]), [*columns, *label_windows(base, split)])]


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
    """The ball's number, from 1, on the end of its boss; its top is toward the camera.

    Of a number whose strokes would be too thin to print the last digit, which parts neighbours; of
    a boss too small for that nothing.
    """
    spec, room = base.spec, LABEL_ROOM * float(seats.boss[k])
    up, _, out = seats.axes[k]
    for text in (str(k + 1), str(k + 1)[-1]):
        if (height := fitting_height(text, spec.digit_mm, room)) >= MIN_DIGIT_MM:
            break
    else:
        return []
    axes = np.stack([np.cross(up, out), up, out])
    at = seats.centre[k] + seats.back[k] * out
    return relief(text, height, spec.relief_mm, SUNK_MM, axes, at)
