"""The coupon: one seat for each size of body at several places of the pads, to try the fit.

A seat stands on a bar that only joins it to the others, and is no thicker than on the carrier: a
wall round cup and pocket, with a cone of 45 degrees between them that prints without support.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from OCP.TopoDS import TopoDS_Shape, TopoDS_Solid

from tbcad.cad.checks import check_mesh, check_pads
from tbcad.cad.glyphs import ROWS, relief, width
from tbcad.cad.solids import cut, fused, meshed, moved, one_solid, polygon, prism, ring
from tbcad.prototype.base import seat_solids as seat
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.seats import Seats
from tbcad.prototype.printing.bed import room
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.spec.errors import SpecError
from tbcad.spec.printer import PrinterSpec
from tbcad.spec.prototype import BaseSpec
from tbcad.types import Floats

# Bars are thinner than a pocket's floor, so that they reach into no pocket.
OF_FLOOR = 0.8
BESIDE_MM = 1.5  # of a bar beside its text
GAP_MM = 3.0
SUNK_MM = 0.4
# Tolerance (mm) and angle (radians) of a mesh that is only looked at for gaps.
CLOSED = (0.2, 0.4)
# The seat's axis points down.
DOWN = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class CouponRow:
    """Seats of one size side by side on a bar, the size left of all, each offset left of its seat.

    Attributes:
        seat: number of a seat of this size.
        name: the body's diameter.
        first: width of the size's place, mm.
        cell: width of the place of one seat with its offset, mm.
        size: width and depth of the whole, mm.
    """

    seat: int
    name: str
    first: float
    cell: float
    size: tuple[float, float]


Place = tuple[CouponRow, Floats]


def coupon_plates(base: BaseLayout, printer: PrinterSpec) -> list[PlacedSolid]:
    """Plates with a seat for each size and each offset of the pads, as few as the bed allows.

    Raises:
        SpecError: when a row of seats is larger than the bed.
        InvalidSolidError: when the kernel fails.
    """
    seats = replace(base.seats, back=base.seats.bottom + base.keys.floor_mm)
    plates = _plates(coupon_rows(seats, base.keys), printer)
    return [
        PlacedSolid(name, _plate(name, seats, base.keys, rows), np.eye(3), np.zeros(3))
        for name, rows in ((f"coupon_{k}", rows) for k, rows in enumerate(plates, start=1))
    ]


def coupon_rows(seats: Seats, keys: BaseSpec) -> list[CouponRow]:
    """A row for each size, the largest first."""
    sizes, first = np.unique(np.round(seats.radius, 6), return_index=True)
    return [_row(seats, keys, int(k)) for k in first[np.argsort(-sizes)]]


def _row(seats: Seats, keys: BaseSpec, k: int) -> CouponRow:
    name = f"{2 * seats.radius[k]:.2f}".rstrip("0").rstrip(".")
    wide = 2 * float(seats.boss[k])
    signs = max(width(_sign(offset)) for offset in keys.coupon_offsets_mm)
    cell = signs * keys.digit_mm / ROWS + 2 * GAP_MM + wide
    first = width(name) * keys.digit_mm / ROWS + 2 * GAP_MM
    across = first + cell * len(keys.coupon_offsets_mm)
    return CouponRow(k, name, first, cell, (across, max(wide, _bar(keys)) + GAP_MM))


def _bar(keys: BaseSpec) -> float:
    """Width of the bars, mm."""
    return keys.digit_mm + 2 * BESIDE_MM


def _sign(offset: float) -> str:
    text = f"{offset:+.3f}".rstrip("0").rstrip(".")
    return "0" if text in ("+0", "-0") else text


def _plates(rows: Iterable[CouponRow], printer: PrinterSpec) -> Iterator[list[list[Place]]]:
    """Rows on shelves, shelves on plates, each with its left end on the shelf's middle line."""
    wide, deep = room(printer)[:2]
    shelves: list[list[Place]] = []
    y = x = depth = 0.0
    for row in rows:
        across, needed = row.size
        _check(row, printer)
        # Rows come with falling depth, so the first of a shelf decides.
        if not shelves or x + across > wide:
            y, x, depth = (y + depth if shelves else 0.0), 0.0, needed
            if y + depth > deep:
                yield shelves
                shelves, y = [], 0.0
            shelves.append([])
        shelves[-1].append((row, np.array([x, y + depth / 2])))
        x += across
    yield shelves


def _check(row: CouponRow, printer: PrinterSpec) -> None:
    across, depth = row.size
    if (np.array(row.size) > room(printer)[:2]).any():
        raise SpecError(
            f"the coupon's seats for {row.name} mm take {across:.0f} x {depth:.0f} mm: make "
            "printer.bed_mm larger or prototype.base.coupon_offsets_mm shorter"
        )


def _plate(name: str, seats: Seats, keys: BaseSpec, shelves: list[list[Place]]) -> TopoDS_Solid:
    bodies = _bars(keys, shelves)
    contacts, pads = [], []
    for row, left in (place for shelf in shelves for place in shelf):
        bodies += _texts(row, keys, left)
        for n, offset in enumerate(keys.coupon_offsets_mm):
            at = np.array([*_middle(row, left, n, seats), float(seats.back[row.seat])])
            bodies.append(moved(_seat(seats, keys, row.seat, offset), DOWN, at))
            away = seats.radius[row.seat] + offset
            contacts.append(at - away * seats.local_normals[row.seat] @ DOWN)
            pads.append(seats.pad[row.seat])
    solid = one_solid(name, fused(bodies))
    check_mesh(name, meshed(solid, *CLOSED))
    check_pads(name, solid, np.concatenate(contacts), np.repeat(pads, 3))
    return solid


def _bars(keys: BaseSpec, shelves: list[list[Place]]) -> list[TopoDS_Shape]:
    """A bar under each shelf, and one at the left that joins them."""
    half, ends = _bar(keys) / 2, [shelf[-1][1][0] + shelf[-1][0].size[0] for shelf in shelves]
    middles = [float(shelf[0][1][1]) for shelf in shelves]
    low, high = middles[0] - half, middles[-1] + half
    bars = [
        _slab((0.0, y - half), (float(end) - GAP_MM, y + half), keys)
        for y, end in zip(middles, ends, strict=True)
    ]
    return [*bars, _slab((0.0, low), (_bar(keys), high), keys)]


def _slab(low: tuple[float, float], high: tuple[float, float], keys: BaseSpec) -> TopoDS_Shape:
    (a, b), (c, d) = low, high
    corners = np.array([[a, b, 0], [c, b, 0], [c, d, 0], [a, d, 0]], dtype=float)
    return prism(polygon(corners), np.array([0, 0, OF_FLOOR * keys.floor_mm]))


def _middle(row: CouponRow, left: Floats, n: int, seats: Seats) -> Floats:
    """Where the axis of a row's n-th seat stands, (2,)."""
    right = row.first + (n + 1) * row.cell - GAP_MM
    middle: Floats = left + np.array([right - float(seats.boss[row.seat]), 0.0])
    return middle


def _seat(seats: Seats, keys: BaseSpec, k: int, offset: float) -> TopoDS_Shape:
    """A seat in its own frame."""
    return cut(ring(_wall(seats, keys, k), 0.0, 2 * np.pi), [seat.seat_hollow(seats, k, offset)])


def _wall(seats: Seats, keys: BaseSpec, k: int) -> Floats:
    """Half section (z, r) of what a hollow is cut out of, (n, 2)."""
    front, back, boss = float(seats.front[k]), float(seats.back[k]), float(seats.boss[k])
    # On the cone, tangent to the sphere round the cup, z + r is this.
    cone = np.sqrt(2) * float(seats.cup[k] + keys.cup_wall_mm)
    foot = max(cone - back, float(seats.pocket[k]) + keys.cup_wall_mm)
    slope = [[cone - boss, boss], [cone - foot, foot]] if foot < boss else [[back, boss]]
    end = [[back, foot]] if cone - foot < back - 1e-6 and foot < boss else []
    return np.array([[front, 0.0], [front, boss], *slope, *end, [back, 0.0]])


def _texts(row: CouponRow, keys: BaseSpec, left: Floats) -> list[TopoDS_Shape]:
    """The size at the left end, each offset left of its seat."""
    at = left + np.array([row.first / 2, 0.0])
    found = _text(row.name, keys, at)
    wide = max(width(_sign(offset)) for offset in keys.coupon_offsets_mm) * keys.digit_mm / ROWS
    for n, offset in enumerate(keys.coupon_offsets_mm):
        found += _text(
            _sign(offset), keys, left + np.array([row.first + n * row.cell + wide / 2, 0.0])
        )
    return found


def _text(text: str, keys: BaseSpec, at: Floats) -> list[TopoDS_Shape]:
    place = np.array([*at, OF_FLOOR * keys.floor_mm])
    return relief(text, keys.digit_mm, keys.relief_mm, SUNK_MM, np.eye(3), place)
