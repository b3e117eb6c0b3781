"""Lamps below the horizon: LED strips on the uprights, and on posts before the camera.

Four upright lamps are images of one another in the planes x = 0 and y = 0. Where they have no
room, two level ones are each other's image by the half turn about z, on a bar across the uprights
and on one across the posts, over the camera: decision 0014.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from tbcad.cad.drafting.dimensions import upward
from tbcad.cad.drafting.sheet import A4, BESIDE_MM, Sheet, drawing_room, notes, placed, rectangle
from tbcad.cad.formats.entities import Layer, Line
from tbcad.core.geometry.primitives import Component, Primitive, enclosing_triangles
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.section import AUTO
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned, when
from tbcad.prototype.files.bom import PartsList
from tbcad.prototype.frame.camera_mount import CameraMount
from tbcad.prototype.frame.shared import EXTRUSION_MM, BearingHead
from tbcad.prototype.keepout import min_distance
from tbcad.prototype.light.lamp import (
    EDGE_MM,
    OFF_CAMERA_MM,
    POSTS,
    SHORT_STRIP,
    STRIP,
    TAIL_MM,
    LampLayout,
    Lamps,
    hidden_by_base,
    in_view,
)
from tbcad.prototype.part import FrameLayout, Part, Site
from tbcad.prototype.sheets import fitted, outer, title_block
from tbcad.types import Floats

# By how much level lamps are beside the plane y = 0: where the base hides one side, the other.
ASIDE_MM = (0.0, -5.0, 5.0, -10.0, 10.0, -15.0, 15.0)
FOOT_HEIGHT_MM = 30.0  # of the uprights' corner brackets, which holders stay above
HEAD_MM = 8.5  # of a holder's screw, which strips keep clear of
OFF_PARTS_MM = 1.0  # of level lamps and what holds them from other static parts
STEP_MM = 2.5  # between heights that are tried
MAX_MA = 1000.0  # half of the supply's; the other half is the motor's
LAMP = "drawing_lamp"
STRIP_CUT_MM = 0.5  # tolerance of a cut at its mark, to either side
BESIDE_STRIPS_MM = 8.0  # of dimension lines from the strips


def lamp_layout(site: Site, before: FrameLayout) -> LampLayout | None:
    """The lamps of a prototype; None without any, also where "auto" finds no place for them.

    The camera must not see lamps or stands, and these must not meet the static parts beside them.

    SpecError when lamps cannot be where the spec has them, or take too much current; it says what
    to change.
    """
    spec, face = site.spec.prototype, before.of(BearingHead).face
    strip, short = site.parts[STRIP], site.parts[SHORT_STRIP]
    mount = before.find(CameraMount)
    wide = _beside_posts(mount, face) if mount else 0.0
    tries = (strip, None), *product((strip, short), ASIDE_MM)
    found = [Lamps(spec, site.parts, face, *one, wide) for one in tries]
    camera = mount.purchased if mount and mount.chosen else ()
    search = _LampSearch(site, (*before.printed, *before.purchased), camera)
    section = spec.light
    if (current := found[0].layout(-1.0).current_ma) > MAX_MA:
        raise SpecError(
            f"the lamps take {current:.0f} mA, more than the {MAX_MA:.0f} that the supply has "
            "left: make prototype.light.strips or segments smaller"
        )
    if section.lamp_z_mm == AUTO:
        heights = ((lamps, search.highest(lamps)) for lamps in found)
        return next((lamps.layout(z) for lamps, z in heights if z is not None), None)
    z = float(section.lamp_z_mm)
    if z == 0:
        return None
    fitting = next((lamps for lamps in found if not search.fault(lamps, z)), None)
    if fitting is None:
        raise SpecError(
            f"prototype.light.lamp_z_mm {z:g}: {search.fault(found[0], z)}; of two level lamps, "
            f"{search.fault(found[1], z)}: set it to auto, or to 0 for no lamps"
        )
    return fitting.layout(z)


def _beside_posts(mount: CameraMount, face: float) -> float:
    """Half width of what posts stand beside, mm; face: x of the uprights' front."""
    wide = mount.chosen.half_width if mount.chosen else 0.0
    foot, posts_end = mount.brackets[0].foot, EXTRUSION_MM + OFF_CAMERA_MM - face
    return max(wide, float(foot[:, 1].max())) if foot[:, 0].min() < posts_end else wide


@dataclass(frozen=True)
class _LampSearch:
    """Where lamps have room, beside static parts."""

    site: Site
    beside: tuple[Component, ...]
    camera: tuple[Component, ...]  # bodies of a camera that is known

    def highest(self, lamps: Lamps) -> float | None:
        """The greatest height at which lamps have room, or None."""
        z = -STEP_MM
        while self.fault(lamps, z):
            z -= STEP_MM
            if _lowest(lamps, z) < lamps.spec.frame.floor_mm:
                return None
        return z

    def fault(self, lamps: Lamps, z: float) -> str:
        """The fault of lamps at a height, or an empty text."""
        keep_out, need = self.site.keep_out, lamps.spec.frame.clearance_mm
        if _lowest(lamps, z) < lamps.spec.frame.floor_mm + FOOT_HEIGHT_MM:
            return "the lamps reach down to the base plate"
        # How far level strips and a screw's head beside them reach from y = 0.
        reach = abs(lamps.aside or 0.0) + (lamps.length + HEAD_MM) / 2
        if lamps.level and reach > lamps.across:
            return "the strips are longer than there is room between the uprights' screws"
        layout = lamps.layout(z)
        bodies = _bodies(layout)
        if in_view(bodies, self.site.layout.array.camera):
            return "the camera sees a lamp or its post"
        if name := _met(bodies, self.beside if lamps.level else self.camera):
            return f"a lamp or its holder meets the {name.replace('_', ' ')}"
        for what, distance in (
            ("the light of the balls", keep_out.to_light),
            ("what the base sweeps", keep_out.to_swept),
        ):
            if min_distance(distance, bodies, need) < need:
                return f"a lamp or its holder is less than {need:g} mm from {what}"
        hidden = hidden_by_base(layout, lamps.spec.stage, keep_out)
        return "the base comes between a lamp and the object's room" if hidden else ""


def _lowest(lamps: Lamps, z: float) -> float:
    """Lower end of what is on the uprights."""
    return z - (lamps.half_height if lamps.level else lamps.length / 2 + TAIL_MM)


def _bodies(layout: LampLayout) -> list[Primitive]:
    """Bodies of lamps and of what holds them."""
    corners = (corner.component for corner in layout.brackets)
    parts = (*corners, *layout.printed, *layout.purchased)
    return [body for part in parts for body in part.added]


def _met(bodies: Sequence[Primitive], others: Sequence[Component]) -> str:
    """Name of a part in whose way bodies are, by the upright boxes round all bodies, or ""."""
    own = [_box(body) for body in bodies]
    for other in others:
        for low, high in map(_box, other.added):
            around = low - OFF_PARTS_MM, high + OFF_PARTS_MM
            near = ((around[0] < top) & (bottom < around[1]) for bottom, top in own)
            if any(axes.all() for axes in near):
                return other.name
    return ""


def _box(body: Primitive) -> tuple[Floats, Floats]:
    points = enclosing_triangles(body).reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


@planned("Lamps", "lamp_*", loose=("strips",), near=("plate",))
def lamps_step(machine: AssembledMachine) -> Values:
    """Posts, holders and strips."""
    light = machine.record.lamps
    assert light is not None
    drawing = machine.record.drawing_of(light.strip)
    post = next(one for one in machine.record.bought if one.name == POSTS[0])
    held = machine.has("lamp_holder_1")  # the lamps on the posts too, not stuck on these
    return {
        "light": light,
        "count": len(light.places),
        "post": machine.ref(post.part or ""),
        "cut": post.what.rpartition(", ")[2],
        "strip": machine.ref(light.strip),
        "drawing": when(drawing, f" ({drawing})"),
        "on_posts": when(held, ", and on the posts, flush with their upper ends"),
        "themselves": when(not held, " and on the posts themselves"),
    }


def lamp_sheet(lamps: LampLayout, bill: PartsList) -> Sheet:
    """The strips of a lamp side by side, lying; the origin is their lower left corner."""
    part, paper = lamps.strip, A4
    left, low, right, high = drawing_room(paper)
    middle = low + (high - low) / 2
    size, pieces = (lamps.length, lamps.width), lamps.strips * len(lamps.places)
    scale, origin = fitted(size, (left, middle, right, high))
    wide = part["width_mm"]
    strips = [
        rectangle((0.0, k * wide, lamps.length, (k + 1) * wide), Layer.CUT)
        for k in range(lamps.strips)
    ]
    steps = part["cut_mm"] * np.arange(1, round(lamps.length / part["cut_mm"]))
    uncut = [Line(Layer.CENTRE, (x, 0.0), (x, lamps.width)) for x in steps.tolist()]
    drawn = placed([*strips, *uncut], origin, scale)
    x, y = origin[0] + lamps.length * scale, origin[1]  # beside it, the width of a strip
    of_one = upward((x, y), (x, y + wide * scale), x + BESIDE_STRIPS_MM, f"{wide:g}")
    text = (
        f"Cut {pieces} pieces of {lamps.length:g} \u00b1 {STRIP_CUT_MM:g}, {lamps.strips} for each "
        f"of {len(lamps.places)} lamps, at marks every {part['cut_mm']:g}, through the copper "
        "pads.",
        _place_note(lamps),
        "Solder a cable to the pads of one end, plus to plus, before sticking; insulate the pads.",
        f"{part['supply_v']:g} V, {part['watt_m'] * lamps.length / part['supply_v']:.0f} "
        "mA for each piece; all pieces in parallel.",
    )
    block = title_block(bill, "strips of a lamp", part, "on the shining face")
    entities = [
        *drawn,
        *outer(origin, (size[0] * scale, size[1] * scale), size),
        *([of_one] if lamps.strips > 1 else []),
        *notes((left + BESIDE_MM, middle), right - left - 2 * BESIDE_MM, text),
    ]
    return Sheet.framed((LAMP, part.name), block, paper, scale, origin, entities)


def _place_note(lamps: LampLayout) -> str:
    """Where the strips stick on the printed plates."""
    if not lamps.level:
        half = max(lamps.width / 2 + EDGE_MM, EXTRUSION_MM / 2)
        return (
            f"Stick them upright, side by side, {EDGE_MM:g} below the upper end of post or holder: "
            f"in the middle of a post, their middle {half:g} from the outer edge of a holder."
        )
    aside = abs(float(lamps.places[0, 1]))
    middle = (
        f"their middle {aside:g} beside the middle of both bars, on opposite sides"
        if aside
        else "in the middle of both bars"
    )
    return (
        f"Stick them level on the printed face, one above the other, at half its height, {middle}."
    )


def _sheets(_: Site, frame: FrameLayout, bill: PartsList) -> tuple[Sheet, ...]:
    lamps = frame.find(LampLayout)
    return (lamp_sheet(lamps, bill),) if lamps else ()


LAMPS = Part((lamps_step,), lamp_layout, _sheets)
