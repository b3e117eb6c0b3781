"""The sheets of caps: section, and what ISO 10110 asks to be said of front, material and body."""

from collections.abc import Iterator

import numpy as np

from tbcad.cad.drafting.sheet import A4, Sheet, TitleBlock, choose_scale, sheet_frame
from tbcad.cad.formats.entities import Arc, Entity, Layer, Line, Point, Polyline, Text
from tbcad.core.optics.reflection import scattered_share
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.caps import cap_edge, cap_pocket, cap_spigot, flat_depth
from tbcad.prototype.base.layout import BaseLayout
from tbcad.records.prototype import CapRecord

VIEW_MM = 95.0, 95.0  # room of the section on paper
MIDDLE_MM = 80.0, 128.0  # of the body's centre on paper
TABLE_X_MM, TOP_MM, LINE_MM = 155.0, 190.0, 5.5  # of the table's texts
HEAD_MM, TEXT_MM = 3.5, 2.8
BEYOND_MM, APART_MM = 3.0, 5.0  # of centre lines beyond the section; of texts from them
EDGE_DEG = 45.0  # where front and body meet, on the body


def cap_sheet(design: str, base: BaseLayout, prototype: PrototypeLayout, one: CapRecord) -> Sheet:
    """The optical drawing of a cap by its limits; the design is for the title block."""
    k = one.ball - 1
    body = 2 * float(prototype.balls.body_radius[k])
    scale = choose_scale((body, _thickness(prototype, one)), VIEW_MM)
    name = f"cap {one.ball}"
    block = TitleBlock(
        title=f"Optical drawing of {name} (ISO 10110)",
        design=design,
        item=name,
        quantity=1,
        material=one.material,
        view="section through the axis",
    )
    entities = [
        *sheet_frame(A4, scale, block),
        *_section(base, prototype, one, scale),
        *_table(one, float(prototype.balls.radius[k]), body),
    ]
    file = one.pdf.removesuffix(".pdf")
    return Sheet(file, block.title, name, A4, scale, MIDDLE_MM, tuple(entities))


def _thickness(prototype: PrototypeLayout, one: CapRecord) -> float:
    """From the apex to the end of the spigot, mm."""
    return float(prototype.balls.body_depth[one.ball - 1]) + one.spigot_end_mm


def _section(
    base: BaseLayout, prototype: PrototypeLayout, one: CapRecord, scale: float
) -> Iterator[Entity]:
    """The section, its front up, its axis, and the diameter in use."""
    (x, y), k, balls = MIDDLE_MM, one.ball - 1, prototype.balls
    body, radius = float(balls.body_radius[k]), float(balls.radius[k])
    depth, flat = float(balls.body_depth[k]), flat_depth(base, k)

    def at(across: float, behind: float) -> Point:
        return x + scale * across, y - scale * behind

    whole = radius <= body  # a ball to its apex
    if not whole:
        front = float(np.degrees(np.arcsin(cap_edge(prototype, k) / radius)))
        middle = at(0.0, radius - depth)
        yield Arc(Layer.CUT, middle, scale * radius, 90.0 - front, 90.0 + front)
    low = -float(np.degrees(np.arcsin(flat / body)))
    high = 90.0 if whole else EDGE_DEG
    yield Arc(Layer.CUT, at(0.0, 0.0), scale * body, low, high)
    yield Arc(Layer.CUT, at(0.0, 0.0), scale * body, 180.0 - high, 180.0 - low)
    yield Polyline(Layer.CUT, tuple(at(*corner) for corner in _back(base, k, depth)), closed=False)
    below = one.spigot_end_mm + BEYOND_MM / scale
    yield Line(Layer.CENTRE, at(0.0, -depth - BEYOND_MM / scale), at(0.0, below))
    for side in (1, -1):
        rim = at(side * one.aperture_mm / 2, -depth)
        yield Line(Layer.DIMENSIONS, rim, (rim[0], rim[1] + BEYOND_MM))
    _, top = at(0.0, -depth)
    used = f"effective diameter {one.aperture_mm:.1f}"
    yield Text(Layer.DIMENSIONS, (x, top + APART_MM), TEXT_MM, used, "centre")
    _, bottom = at(0.0, below)
    length = f"length over all {_thickness(prototype, one):.2f}"
    yield Text(Layer.DIMENSIONS, (x, bottom - APART_MM), TEXT_MM, length, "centre")


def _back(base: BaseLayout, k: int, depth: float) -> list[Point]:
    """Flat, spigot and pocket from one side to the other, across and behind the body's centre."""
    flat, (spigot, end) = flat_depth(base, k), cap_spigot(base, k)
    pocket, deep = cap_pocket(base, k, depth)
    rim = float(np.sqrt(base.seats.radius[k] ** 2 - flat**2))
    half = [(rim, flat), (spigot, flat), (spigot, end)]
    if pocket:
        half += [(pocket, end), (pocket, end - deep)]
    return [*half, *((-across, behind) for across, behind in reversed(half))]


def _table(one: CapRecord, radius: float, body: float) -> Iterator[Entity]:
    """Texts beside the section, a head and lines for front, material and body."""
    y = TOP_MM
    for head, *texts in _blocks(one, radius, body):
        yield Text(Layer.DIMENSIONS, (TABLE_X_MM, y), HEAD_MM, head)
        for text in texts:
            y -= LINE_MM
            yield Text(Layer.DIMENSIONS, (TABLE_X_MM, y), TEXT_MM, text)
        y -= 2 * LINE_MM


def _blocks(one: CapRecord, radius: float, diameter: float) -> tuple[tuple[str, ...], ...]:
    finish, scattered = one.roughness_rq_nm, scattered_share(one.roughness_rq_nm)
    front = (
        "Front",
        f"R {radius:.1f} +-{one.radius_tolerance_mm:.2f} CX",
        f"effective diameter {one.aperture_mm:.1f}",
        f"3/ -({one.irregularity_fringes:.1f}), fringes of 546 nm over it",
        f"4/ centre of R within {one.centre_shift_mm:.2f} of the spigot's axis",
        f"Rq {finish:.1f} nm or better: scatters {scattered:.0%} at 550 nm",
        f"coat: reflects {one.reflectance_min:.0%} or more unscattered, 400 to 700 nm at "
        f"{one.incidence_deg:.0f} degrees",
    )
    material = (
        "Material",
        "SLA resin, lacquered before it is coated with aluminium,",
        "or aluminium EN AW-6082, turned and polished",
        "magnet in the spigot: north pole toward the front",
    )
    body = (
        "Body and spigot",
        f"sphere {diameter:.3f} +-{one.body_tolerance_mm:.2f}, lies on three pads: no coat there",
        f"spigot {one.spigot_mm:.2f} in a pocket of {one.socket_mm:.2f}: fit it,",
        f"play lets the cap tilt by {one.tilt_deg:.2f} degrees at most",
    )
    return front, material, body
