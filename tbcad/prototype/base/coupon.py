"""The coupon: seats for a few sizes of body at several offsets of the pads, to try the fit.

A seat is no thicker than on the carrier: a wall round cup and pocket, with a cone between them. It
lies on the bed as the carrier's worst seat does and is printed with the same supports, so that its
pads come out as those of the carrier. It stands on a plate below it, its keel, and a bar on the bed
joins it to the others.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid
from scipy.spatial import ConvexHull

from tbcad.cad.kernel.checks import check_pads, closed_mesh, properties
from tbcad.cad.kernel.glyphs import ROWS, relief, text_width
from tbcad.cad.kernel.solids import fused, moved, one_solid, polygon, prism
from tbcad.common.reuse import kept
from tbcad.core.geometry.primitives import rectangle
from tbcad.core.spec.design import PrinterSpec
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import BaseSpec
from tbcad.prototype.base.coupon_seats import SeatPose, height, outline, seat_body, with_pads
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.seats import Seats
from tbcad.prototype.print_bed import usable_size
from tbcad.prototype.printed import PlacedSolid
from tbcad.types import Floats

# Of bars: in floors of a pocket, lower than one, so that they reach into no pocket; and at most.
BAR_HEIGHT, BAR_MAX_MM = 0.8, 1.21
BESIDE_TEXT_MM = 1.6  # of a bar
BESIDE_FOOT_MM = 1.0  # of a bar: what stood out of its edge by less than a wall would be thin
GAP_MM = 3.0  # round texts and between seats
SUNK_MM = 0.3  # of texts into their face
DECIMALS = 6  # to which sizes are the same, mm
STEPS = 65  # along each side of a seat's section


@dataclass(frozen=True)
class CouponRow:
    """Seats of one size side by side on a bar; the size left of all, offsets left of seats."""

    seat: int  # number of a seat of this size
    offsets: tuple[float, ...]  # of the pads, one for each seat, mm
    name: str  # the body's diameter
    first: float  # width of the size's place, mm
    cell: float  # width of the place of one seat with its offset, mm
    size: tuple[float, float]  # width and depth of the whole, mm
    middle: float  # y of the seats' balls from the shelf's middle line, mm


Place = tuple[CouponRow, Floats]
"""A row, and its left end on its shelf's middle line, mm, (2,)."""


@kept("coupons")
def coupon_plates(
    base: BaseLayout, printer: PrinterSpec, pose: SeatPose, mesh_mm: float
) -> list[PlacedSolid]:
    """Plates with a seat for each chosen size and each offset of the pads, few as the bed allows.

    Meshes are at most mesh_mm from the surface. SpecError when a single seat is larger than the
    bed.
    """
    seats, placed = coupon_seats(base, pose), []
    shelves = _plates(coupon_rows(seats, base.spec, printer, pose.lean), printer)
    for k, rows in enumerate(shelves, start=1):
        plate = _plate(f"coupon_{k}", seats, base.spec, rows, pose)
        mesh, own = closed_mesh(f"coupon_{k}", plate, mesh_mm), properties(plate)
        placed.append(PlacedSolid(f"coupon_{k}", plate, mesh, own, np.eye(3), np.zeros(3)))
    return placed


def coupon_seats(base: BaseLayout, pose: SeatPose) -> Seats:
    """Seats as the coupon has them: short, with their pads about the axis as in the pose."""
    seats = base.seats
    azimuth = np.full(len(seats), pose.pad_azimuth)
    return replace(seats, back=seats.bottom + base.spec.floor_mm, pad_azimuth=azimuth)


def coupon_rows(seats: Seats, spec: BaseSpec, printer: PrinterSpec, lean: float) -> list[CouponRow]:
    """A row of `coupon_seats` for each size, the largest first; several on a narrow bed."""
    width = float(usable_size(printer)[0])
    rows = []
    for k in _seats_to_try(seats, spec):
        row = _row(seats, spec, k, spec.coupon_offsets_mm, lean)
        count = max(int((width - row.first) / row.cell), 1)
        rows += [
            _row(seats, spec, k, spec.coupon_offsets_mm[start : start + count], lean)
            for start in range(0, len(spec.coupon_offsets_mm), count)
        ]
    return rows


def _seats_to_try(seats: Seats, spec: BaseSpec) -> list[int]:
    """A seat of each chosen size, from the largest to the smallest, evenly in their order."""
    sizes, first = np.unique(np.round(seats.radius, DECIMALS), return_index=True)
    chosen = np.linspace(len(sizes) - 1, 0, min(spec.coupon_sizes, len(sizes)))
    return [int(seat) for seat in first[np.round(chosen).astype(int)]]


def _row(
    seats: Seats, spec: BaseSpec, k: int, offsets: tuple[float, ...], lean: float
) -> CouponRow:
    name = _short(f"{2 * seats.radius[k]:.2f}")
    boss = 2 * float(seats.boss[k])
    cell = _offsets_width(spec) + 2 * GAP_MM + boss
    first = _text_width(name, spec) + 2 * GAP_MM
    ends = outline(seats, spec, k, lean)[:, 0]
    low, high = float(ends.min()), float(ends.max())
    size = (first + cell * len(offsets), max(high - low, _bar_width(spec)) + GAP_MM)
    return CouponRow(k, offsets, name, first, cell, size, -(low + high) / 2)


def _bar_width(spec: BaseSpec) -> float:
    return spec.digit_mm + 2 * BESIDE_TEXT_MM


def _bar_height(spec: BaseSpec) -> float:
    return min(BAR_HEIGHT * spec.floor_mm, BAR_MAX_MM)


def _text_width(text: str, spec: BaseSpec) -> float:
    return text_width(text) * spec.digit_mm / ROWS


def _offset_texts(offsets: tuple[float, ...]) -> list[str]:
    texts = [_short(f"{offset:+.3f}") for offset in offsets]
    return ["0" if text in ("+0", "-0") else text for text in texts]


def _offsets_width(spec: BaseSpec) -> float:
    """Width of the widest offset, mm."""
    return max(_text_width(text, spec) for text in _offset_texts(spec.coupon_offsets_mm))


def _short(number: str) -> str:
    """A number without zeros at its end."""
    return number.rstrip("0").rstrip(".")


def _plates(rows: Iterable[CouponRow], printer: PrinterSpec) -> Iterator[list[list[Place]]]:
    """Rows on shelves, shelves on plates, each with its left end on the shelf's middle line."""
    bed_width, bed_depth = usable_size(printer)[:2]
    shelves: list[list[Place]] = []
    y = x = depth = 0.0
    for row in rows:
        row_width, row_depth = row.size
        if row_width > bed_width or row_depth > bed_depth:
            raise SpecError(
                f"the coupon's seat for {row.name} mm takes {row_width:.0f} x {row_depth:.0f} mm: "
                "make printer.bed_mm larger or prototype.largest_ball_mm smaller"
            )
        # Rows come with falling depth, so the first of a shelf decides.
        if not shelves or x + row_width > bed_width:
            y, x, depth = (y + depth if shelves else 0.0), 0.0, row_depth
            if y + depth > bed_depth:
                yield shelves
                shelves, y = [], 0.0
            shelves.append([])
        shelves[-1].append((row, np.array([x, y + depth / 2])))
        x += row_width
    yield shelves


def _plate(
    name: str, seats: Seats, spec: BaseSpec, shelves: list[list[Place]], pose: SeatPose
) -> TopoDS_Solid:
    bodies, contacts, pads = _bars(seats, spec, shelves, pose), [], []
    for row, corner in (place for shelf in shelves for place in shelf):
        k = row.seat
        bodies += _texts(row, spec, corner)
        body = seat_body(seats, spec, k, pose, -row.middle)
        for n, offset in enumerate(row.offsets):
            right = row.first + (n + 1) * row.cell - GAP_MM
            middle = corner + np.array([right - float(seats.boss[k]), row.middle])
            at = np.array([*middle, height(seats, spec, k, pose)])
            bodies.append(moved(with_pads(body, seats, k, offset, pose), np.eye(3), at))
            contacts.append(at - (seats.radius[k] + offset) * seats.local_normals[k] @ pose.axes)
            pads.append(seats.pad[k])
    solid = one_solid(name, fused(bodies))
    check_pads(name, solid, np.concatenate(contacts), np.repeat(pads, 3))
    return solid


def _bars(
    seats: Seats, spec: BaseSpec, shelves: list[list[Place]], pose: SeatPose
) -> list[TopoDS_Shape]:
    """A bar under each shelf, as wide as texts and feet, and one that joins them, on the bed."""
    half, up = _bar_width(spec) / 2, np.array([0, 0, _bar_height(spec)])
    middles = [float(corner[1]) for ((_, corner), *_) in shelves]
    corners = []
    for y, shelf in zip(middles, shelves, strict=True):
        feet = [_foot(seats, spec, row, pose) for row, _ in shelf]
        low, high = min(-half, *(one[0] for one in feet)), max(half, *(one[1] for one in feet))
        row, last = shelf[-1]
        corners.append(((0.0, y + low), (float(last[0] + row.size[0]) - GAP_MM, y + high)))
    corners.append(((0.0, middles[0] - half), (_bar_width(spec), middles[-1] + half)))
    flat = (np.column_stack([rectangle(low, high), np.zeros(4)]) for low, high in corners)
    return [prism(polygon(one), up) for one in flat]


def _foot(seats: Seats, spec: BaseSpec, row: CouponRow, pose: SeatPose) -> tuple[float, float]:
    """Ends of what a row's seats have below the bar's upper face, and beside it, from y, mm."""
    section = outline(seats, spec, row.seat, pose.lean)
    ring = section[ConvexHull(section).vertices]
    along = (
        ring[:, None] + np.linspace(0, 1, STEPS)[:, None] * (np.roll(ring, -1, 0) - ring)[:, None]
    )
    up = along[..., 1] + height(seats, spec, row.seat, pose)
    y = along[..., 0][up <= _bar_height(spec)] + row.middle
    return y.min(initial=0.0) - BESIDE_FOOT_MM, y.max(initial=0.0) + BESIDE_FOOT_MM


def _texts(row: CouponRow, spec: BaseSpec, corner: Floats) -> list[TopoDS_Shape]:
    """The size at the left end, each offset left of its seat."""
    half = _offsets_width(spec) / 2
    texts = [(row.name, row.first / 2)]
    texts += [
        (text, row.first + n * row.cell + half) for n, text in enumerate(_offset_texts(row.offsets))
    ]
    solids: list[TopoDS_Shape] = []
    for text, x in texts:
        place = np.array([*(corner + np.array([x, 0.0])), _bar_height(spec)])
        solids += relief(text, spec.digit_mm, spec.relief_mm, SUNK_MM, np.eye(3), place)
    return solids
