"""Caps in numbers, their limits from the coverage that is set aside, and what holds all balls.

Pads fix the centre of a ball, which is all a ball needs; a cap could tilt on them, and its front's
centre with it. A spigot in the pocket of the seat's magnet takes that up.

At the rim of the part in use, e from the apex, a ray is reflected past the capture sphere's edge.
A change of the normal there by a small angle a moves it at the object, at a distance L, by 2 L a,
and coverage, which is twice its distance from the origin, by 4 L a. The margin of the mirrors is
shared equally (root sum of squares) by radius, figure, tilt and seat.
"""

from collections.abc import Iterator

import numpy as np

from tbcad.cad.drafting.sheet import A4, Sheet, TitleBlock, choose_scale
from tbcad.cad.formats.entities import Arc, Entity, Layer, Line, Point, Polyline, Text
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.reflection import roughness_nm, scattered_share
from tbcad.core.spec.design import Spec
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned, when
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.fasteners import magnet_part, seat_magnets
from tbcad.prototype.base.holding import (
    DERATING,
    GLUE_MPA,
    MIN_RATIO,
    REMANENCE_T,
    WIDER_GAP_MM,
    base_motion,
    force_needed,
    glue_force,
    pull_of_pair,
    pull_on_ball,
)
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.drive.balance import ball_masses
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.files.bom import PrintedItem
from tbcad.prototype.part import Part
from tbcad.prototype.purchased.parts import Parts
from tbcad.records.prototype import CapRecord, HeldBall, Holding

WEB_MM = 0.8  # between the flat and the pads, and round the magnet's pocket
FRONT_MM = 2.0  # minimum material before the pocket
SPIGOT_GAP_MM = 0.2  # between a spigot and the magnet or well behind it
SHOULDER_MM = 0.1  # of the flat round the spigot
SHARES = 4  # of the margin: radius, figure, tilt, seat
MIN_MARGIN_MM = 0.3
FRINGE_MM = 546.07e-6 / 2  # ISO 10110-5: half a wavelength of the green mercury line
MIN_REFLECTANCE = 0.55  # of polished steel, as the balls: without what roughness scatters
MATERIALS = {"printed": "resin", "turned": "aluminium EN AW-6061"}
FINISHES = {
    "printed": "polished and coated with aluminium as its drawing asks",
    "turned": "turned with a diamond as its drawing asks",
}
MATERIAL_TEXTS = {
    "resin": ("SLA resin, lacquered before it is coated with aluminium",),
    "aluminium EN AW-6061": (
        "EN AW-6061, of fine grain (RSA-6061) where Rq asks for it;",
        "front turned with a diamond, bare",
    ),
}
# Slope of Zernike's spherical aberration at the rim over that of a power, both from peak to valley:
# 8 against 2, over the half aperture.
SYMMETRIC = 2 / 8
# Of the optical drawing, on paper.
VIEW_MM = 95.0, 95.0  # room of the section on paper
MIDDLE_MM = 80.0, 128.0  # of the body's centre on paper
TABLE_X_MM, TOP_MM, LINE_MM = 155.0, 190.0, 5.5  # of the table's texts
HEAD_MM, TEXT_MM = 3.5, 2.8
BEYOND_MM, APART_MM = 3.0, 5.0  # of centre lines beyond the section; of texts from them
EDGE_DEG = 45.0  # where front and body meet, on the body
G_PER_KG = 1000.0
POLARITY = "north pole toward the object, as all magnets of the seats"


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
    """Radius and depth of the pocket for the own magnet of cap k, mm; zeros where there is none.

    depth is that of the body's centre behind the apex, mm.
    """
    spec, (spigot, end) = base.spec, cap_spigot(base, k)
    largest = spigot - WEB_MM
    radii = [(size + spec.magnet_play_mm) / 2 for size in spec.magnets_mm]
    fitting = [radius for radius in radii if radius <= largest]
    if spec.holds[0] == "glue" or not fitting or depth + end < spec.magnet_height_mm + FRONT_MM:
        return 0.0, 0.0
    return max(fitting), spec.magnet_height_mm


def cap_magnets(base: BaseLayout, prototype: PrototypeLayout, parts: Parts) -> list[Fastener]:
    """Magnets in the caps' own pockets; SpecError when one is in no list."""
    seats, spec, magnets = base.seats, base.spec, []
    for k in np.flatnonzero(prototype.balls.cap).tolist():
        radius, height = cap_pocket(base, k, float(prototype.balls.body_depth[k]))
        if radius:
            part = magnet_part(2 * radius - spec.magnet_play_mm, height, parts)
            place = seats.centre[k] + cap_spigot(base, k)[1] * seats.axis[k]
            magnets.append(Fastener(part, place, -seats.axis[k], (f"cap_{k + 1}",), rotates=True))
    return magnets


def cap_limits(spec: Spec, base: BaseLayout, prototype: PrototypeLayout) -> tuple[CapRecord, ...]:
    """Key and limits of all caps by the number of their ball; tolerances are to either side."""
    caps = np.flatnonzero(prototype.balls.cap).tolist()
    return tuple(_limits(spec, base, prototype, k) for k in caps)


def cap_item(
    prototype: PrototypeLayout, j: int, volume: float, estimate: tuple[float, float]
) -> PrintedItem:
    """A cap of a volume (mm^3), by the number of its ball from 0: no two are alike."""
    balls, spec = prototype.balls, prototype.spec
    front, body = balls.radius[j], 2 * balls.body_radius[j]
    making = spec.prototype.caps
    finish = FINISHES[making]
    what = f"front of radius {front:.1f} mm on a ball of {body:.3f} mm, {finish}"
    return PrintedItem(
        *(f"cap {j + 1}", what, volume, estimate, MATERIALS[making]),
        density=spec.cap_density_g_cm3,
        finish=f"finish of a {making} cap",
        turned=making == "turned",
    )


def cap_edge(prototype: PrototypeLayout, k: int) -> float:
    """Radius of the circle in which a cap's front and body meet, mm."""
    balls = prototype.balls
    return float(min(balls.body_radius[k] / np.sqrt(2), balls.radius[k]))


def _limits(spec: Spec, base: BaseLayout, prototype: PrototypeLayout, k: int) -> CapRecord:
    balls, apex = prototype.balls, prototype.apices()[k]
    radius, depth = float(balls.radius[k]), float(balls.body_depth[k])
    used = cap_edge(prototype, k) - spec.prototype.cap_rim_mm
    distance = float(norm(apex))
    share = max(spec.mirrors.margin_mm, MIN_MARGIN_MM) / np.sqrt(SHARES)
    slope, making = share / (4 * distance), spec.prototype.caps
    fringes = slope * used / 2 / FRINGE_MM
    (spigot, end), tilt = cap_spigot(base, k), cap_tilt(base, k)
    to_camera = prototype.array.camera.pinhole - apex
    # Object and pinhole are seen from an apex at the same angle from its normal.
    between = float(-apex @ to_camera / distance / norm(to_camera))
    drawing = f"drawing_cap_{k + 1}"
    return CapRecord(
        ball=k + 1,
        spigot_mm=2 * spigot,
        socket_mm=2 * float(base.seats.pocket[k]),
        spigot_end_mm=end,
        tilt_deg=float(np.degrees(tilt)),
        centre_shift_mm=abs(radius - depth) * float(np.sin(tilt)),
        aperture_mm=2 * used,
        radius_tolerance_mm=slope * radius**2 / used,
        body_tolerance_mm=2 * (slope * radius * float(np.cos(base.seats.tilt))),
        power_fringes=fringes,
        irregularity_fringes=fringes,
        symmetric_fringes=SYMMETRIC * fringes,
        roughness_rq_nm=roughness_nm(),
        incidence_deg=float(np.degrees(np.arccos(between))) / 2,
        reflectance_min=MIN_REFLECTANCE,
        material=MATERIALS[making],
        finish=FINISHES[making],
        polarity=POLARITY,
        pdf=f"{drawing}.pdf",
        dxf=f"{drawing}.dxf",
    )


def holding(base: BaseLayout, prototype: PrototypeLayout, parts: Parts) -> Holding:
    """Holding force of each ball in its seat, with the pads as they are turned, and assumptions."""
    seats, motion = base.seats, base_motion(prototype.spec)
    masses = ball_masses(prototype)
    needed = force_needed(
        seats.pad_normals, seats.axis, seats.centre, masses.mass_g, base.frame, motion
    ).tolist()
    held = (_forces(base, prototype, k) for k in range(len(seats)))
    rows = zip(needed, held, seat_magnets(base, parts), strict=True)
    return Holding(
        min_ratio=MIN_RATIO,
        remanence_t=REMANENCE_T,
        derating=DERATING,
        glue_mpa=GLUE_MPA,
        wider_gap_mm=WIDER_GAP_MM,
        balls=tuple(
            HeldBall(
                ball=number,
                by="glue" if wider is None else "magnet",
                magnet=magnet.name if magnet else None,
                force_needed_n=least,
                force_available_n=force,
                ratio=force / least,
                wider_gap_n=force if wider is None else wider,
            )
            for number, (least, (force, wider), magnet) in enumerate(rows, 1)
        ),
    )


def _forces(base: BaseLayout, prototype: PrototypeLayout, k: int) -> tuple[float, float | None]:
    """Force with the gap as drawn and with a wider one, N; None with glue."""
    seats, gap = base.seats, base.spec.magnet_gap_mm
    magnet, height = float(seats.magnet[k]) / 2, float(seats.magnet_height[k])
    gaps, radius = (0.0, WIDER_GAP_MM), float(seats.radius[k])
    if magnet and not prototype.balls.cap[k]:
        drawn, wider = (pull_on_ball(radius, gap + more, magnet, height) for more in gaps)
        return drawn, wider
    own, own_height = cap_pocket(base, k, float(prototype.balls.body_depth[k]))
    own -= base.spec.magnet_play_mm / 2
    if magnet and own > 0:
        between, heights = radius + gap - cap_spigot(base, k)[1], (own_height, height)
        drawn, wider = (pull_of_pair(own, magnet, between + more, heights) for more in gaps)
        return drawn, wider
    return float(glue_force(seats.pocket[k])), None


@planned("Caps", "cap_*")
def caps_step(machine: AssembledMachine) -> Values:
    """Mirrors that are made."""
    caps = machine.record.caps
    return {
        "drawings": ", ".join(str(one.pdf) for one in caps),
        "ask": "asks" if len(caps) == 1 else "ask",
        "printed": caps[0].material == MATERIALS["printed"],
        "turned": caps[0].material == MATERIALS["turned"],
        "caps": [{"cap": one, "magnet": _magnet_of(machine, one)} for one in caps],
    }


def _magnet_of(machine: AssembledMachine, cap: CapRecord) -> str:
    """What its spigot has for a magnet, as text; empty where it has none."""
    body = (f"cap_{cap.ball}",)
    held = [machine.ref(one.part) for one in machine.fasteners if one.through == body]
    return when(held, f" {', '.join(held)} in it;")


@planned("Balls into their seats", "ball_*", near=("carrier",))
def balls_step(machine: AssembledMachine) -> Values:
    """Balls in their seats, by what holds them."""
    held = [one for one in machine.record.holding.balls if one.ball in machine.sizes]
    magnets = [one for one in held if one.by == "magnet"]
    strongest = max(magnets, default=None, key=lambda one: one.force_available_n)
    named = ((one.ball, machine.ref(f"ball {machine.sizes[one.ball]}")) for one in held)
    return {
        "caps": machine.record.caps,
        "strongest": strongest,
        "glue": strongest is None,
        "balls": [{"name": name.capitalize(), "number": number} for number, name in named],
        "kg": machine.record.drive.mass_g / G_PER_KG,
    }


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
        *_section(base, prototype, one, scale),
        *_table(one, float(prototype.balls.radius[k]), body),
    ]
    names = one.pdf.removesuffix(".pdf"), name
    return Sheet.framed(names, block, A4, scale, MIDDLE_MM, entities)


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
        f"R {radius:.1f} CX, within +-{one.radius_tolerance_mm:.2f} by 3/",
        f"effective diameter {one.aperture_mm:.1f}",
        f"3/ {one.power_fringes:.1f}({one.irregularity_fringes:.1f}/{one.symmetric_fringes:.1f}), "
        "fringes of 546 nm over it (ISO 10110-5)",
        f"4/ centre of R within {one.centre_shift_mm:.2f} of the spigot's axis",
        f"Rq {finish:.1f} nm or better: scatters {scattered:.0%} at 550 nm",
        f"coat: reflects {one.reflectance_min:.0%} or more unscattered, 400 to 700 nm at "
        f"{one.incidence_deg:.0f} degrees",
    )
    material = (
        "Material",
        *MATERIAL_TEXTS[one.material],
        "magnet in the spigot: north pole toward the front",
    )
    body = (
        "Body and spigot",
        f"sphere {diameter:.3f} +-{one.body_tolerance_mm:.2f}, lies on three pads: no coat there",
        f"spigot {one.spigot_mm:.2f} in a pocket of {one.socket_mm:.2f}: fit it,",
        f"play lets the cap tilt by {one.tilt_deg:.2f} degrees at most",
    )
    return front, material, body


CAPS, BALLS = Part((caps_step,)), Part((balls_step,))
