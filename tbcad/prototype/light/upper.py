"""Two LEDs above the object's sides, on thin rods from a bar on the stage's post.

They stand where the base does not come and face the object's middle, each the other's image by the
half turn about z, across from the lamps below. They are in the light of the balls: what they hide
is left out when photographs are merged (decision 0052).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from tbcad.core.geometry.primitives import Component, Primitive, box, cylinder_between
from tbcad.core.geometry.vectors import norm, unit
from tbcad.core.optics.lamp_light import RectangularLamps, irradiance, lambertian
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.section import AUTO
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned
from tbcad.prototype.base.fasteners import m3_insert
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.keepout import min_distance
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.part import FrameLayout, Mounted, Part, Site
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.prototype.resistors import SeriesResistor, series_resistor
from tbcad.prototype.stage.crown import PLUG_MM
from tbcad.types import Floats

LED, ROD, WIRE, SET_SCREW = "STAR-3535-8", "ROD-1.2x250", "ENAMELLED-0.2", "SET-M3x8"
SUPPLY_V = 24.0
# Brightest over darkest surface, at most: the verification, which has 4, samples others.
UNEVEN = 3.8
LOWEST_DEG, STEP_DEG = -60, 10  # of surfaces that virtual cameras see at 60 degrees or less
OBJECT_OF_CAPTURE = 2 / 3  # an object that stands in its own light
ELEVATIONS_DEG = (60.0, 57.5, 55.0, 52.5, 50.0, 62.5)
LEANS_DEG = (30.0, 25.0, 20.0, 15.0, 10.0)  # of the rods, outward on their way down
FARTHEST, NEAREST, REACH_STEPS = 2.2, 1.4, 41  # from the middle, in radii of the capture sphere
CURRENTS_MA = np.geomspace(4.0, 100.0, 60)
BOARD_MM, EMITTER_MM = 1.6, 0.7  # thickness of a board, and of the LED on it
WIRES_MM = 0.3  # that the wires on a rod add to its diameter
ELBOW_MM = 1.0  # beyond the board's rim, where the rod turns down
GLUE_MM, SLOT_PLAY_MM = 0.02, 0.2  # between board and rod; of a rod in the bar's slot
BAR_MM, BAR_HALF_MM, END_MM = 12.0, 5.0, 6.0  # height, half width, length beyond the rods
BELOW_PLUG_MM = 3.0  # from the crown's plug in the post to the bar
COLLAR_MM, BORE_PLAY_MM = 8.0, 0.1  # wall round the post, and play round it
TIP_MM = 0.1  # from the set screw to the post
TOLERANCE_MM = 0.75  # of boards and rods beside their places
SAMPLES = 40
WIRE_MM = 400.0  # of an LED's wires beyond its tube: to the other LED, and down the post
THROUGH_MM = 1.0  # by which a removed body extends beyond the part
ACROSS, UP = np.eye(3)[[0, 2]]
NAMES = "upper_*"


@dataclass(frozen=True, kw_only=True)
class UpperLamps(Mounted):
    """The LEDs above; purchased are boards and rods, printed is the bar."""

    led: PurchasedPart
    rod: PurchasedPart
    places: Floats  # middles of the shining faces, mm, (2, 3)
    heads: Floats  # ends of the cylinders round LED, board and what is glued on it, mm, (2, 2, 3)
    # of each rod with its wires: on the board's back, its elbow, in the bar, mm, (2, 3, 3)
    rods: Floats
    circuit: SeriesResistor  # of both in series
    ratio: float  # of the brightest to the darkest surface, with the lamps below
    hides: float  # share of the rays from above that boards and rods stop, about

    def merit(self) -> tuple[bool, float]:
        """Better ones first: even enough, then by what they hide."""
        return self.ratio > UNEVEN, self.hides if self.ratio <= UNEVEN else self.ratio

    @property
    def candela(self) -> float:
        """Of each LED along its direction."""
        return candela(self.led, self.circuit.current_ma)

    @property
    def lux(self) -> float:
        """Light on upright surfaces in the middle, the mean over azimuths."""
        level = norm(self.places[:, :2]) / norm(self.places)
        return float((1e6 * self.candela * level / np.pi / norm(self.places) ** 2).sum())


def candela(led: PurchasedPart, current_ma: float) -> float:
    """Of a Lambertian LED along its direction, its light in proportion to its current."""
    return float(led["lumen"] * current_ma / led["rated_ma"] / np.pi)


@dataclass(frozen=True)
class _Pair:
    """Where both LEDs are: angles in degrees, distance from the middle in mm."""

    elevation: float
    distance: float
    lean: float
    bar: tuple[float, float]  # z of the bar's lower and upper face, mm
    board: float  # diameter, mm
    thickness: float  # of a rod with its wires, mm

    def places(self) -> Floats:
        """Middles of the shining faces, (2, 3)."""
        angle = math.radians(self.elevation)
        y, z = self.distance * math.cos(angle), self.distance * math.sin(angle)
        return np.array([[0.0, y, z], [0.0, -y, z]])

    def heads(self) -> Floats:
        """Ends of the cylinders round LEDs, boards and the rods on their backs, (2, 2, 3)."""
        places = self.places()
        behind = (EMITTER_MM + BOARD_MM + GLUE_MM + self.thickness) * unit(places)
        return np.stack([places, places + behind], axis=1)

    def rods(self) -> Floats:
        """Starts, elbows and lower ends of the rods, (2, 3, 3)."""
        places, out = self.places(), unit(self.places())
        slope = math.tan(math.radians(self.lean))
        down = np.sign(places[:, 1])[:, None] * [0.0, slope, 0.0] - UP
        start = places + (EMITTER_MM + BOARD_MM + GLUE_MM + self.thickness / 2) * out
        beside = unit(down - (down * out).sum(axis=1)[:, None] * out)
        elbow = start + (self.board / 2 + ELBOW_MM) * beside
        return np.stack([start, elbow, elbow + (elbow[:, 2:] - self.bar[0]) * down], axis=1)

    @property
    def length(self) -> float:
        """Of a rod, mm."""
        return float(norm(np.diff(self.rods()[0], axis=0)).sum())

    @property
    def half_bar(self) -> float:
        """Half length of the bar, mm."""
        return float(self.rods()[0, 2, 1]) + END_MM


def upper_layout(site: Site, before: FrameLayout) -> UpperLamps | None:
    """The LEDs above a prototype's object; None without, also where "auto" finds no place.

    SpecError: the spec asks for them, and they do not fit, or the light is too uneven.
    """
    wanted, lamps = site.spec.prototype.light.upper, before.find(LampLayout)
    if wanted is False:
        return None
    search = _Search(site, lamps) if lamps else None
    found = min(search.fitting(), key=UpperLamps.merit, default=None) if search else None
    if found and found.ratio <= UNEVEN:
        return found
    if wanted == AUTO:
        return None
    why = "there are no lamps below, whose light they complete"
    if lamps:
        why = "no place between what the base sweeps and the object is free for them"
    if found:
        why = f"the brightest surface gets {found.ratio:.1f} times the light of the darkest"
        why += f", more than {UNEVEN:g}"
    raise SpecError(f"prototype.light.upper: {why}: set it to auto, or to false for none")


@dataclass(frozen=True)
class _Search:
    """Where the pair has room, and how evenly it lights."""

    site: Site
    lamps: LampLayout

    def fitting(self) -> Iterator[UpperLamps]:
        """Of each elevation and lean the farthest pair that has room."""
        for elevation, lean in product(ELEVATIONS_DEG, LEANS_DEG):
            if pair := next(filter(self._fits, self._pairs(elevation, lean)), None):
                yield self._layout(pair)

    def _pairs(self, elevation: float, lean: float) -> Iterator[_Pair]:
        high = self.site.stage.sizes.joint - PLUG_MM - BELOW_PLUG_MM
        radius, parts = self.site.keep_out.capture, self.site.parts
        sizes = parts[LED]["diameter_mm"], parts[ROD]["outer_mm"] + WIRES_MM
        for distance in np.linspace(FARTHEST, NEAREST, REACH_STEPS) * radius:
            yield _Pair(elevation, float(distance), lean, (high - BAR_MM, high), *sizes)

    def _fits(self, pair: _Pair) -> bool:
        """Whether all of it keeps clear of what the base sweeps, and the bar of the light too."""
        keep_out, need = self.site.keep_out, self.site.spec.prototype.frame.clearance_mm
        if pair.length > self.site.parts[ROD]["length_mm"]:
            return False
        ends = np.concatenate([pair.heads(), pair.rods()[:, 1:]])
        share = np.linspace(0, 1, SAMPLES)[:, None, None]
        axes = (ends[:, 0] + share * (ends[:, 1] - ends[:, 0])).reshape(-1, 3)
        if keep_out.to_swept(axes).min() < need + pair.thickness / 2:
            return False  # points first: they refuse most
        bar = list(_bar(self.site, pair).added)
        heads = [cylinder_between(low, high, pair.board / 2) for low, high in pair.heads()]
        rods = [body for points in pair.rods() for body in _rod_bodies(points, pair.thickness)]
        near = min_distance(keep_out.to_swept, [*bar, *heads, *rods], need)
        return near >= need and min_distance(keep_out.to_light, bar, need) >= need

    def _layout(self, pair: _Pair) -> UpperLamps:
        """The pair with the current of both LEDs that lights most evenly."""
        parts = self.site.parts
        led, rod = parts[LED], parts[ROD]
        fields = _fields(self.lamps, pair.places(), self.site.keep_out.capture)
        circuits = [
            series_resistor(led, float(most), SUPPLY_V, parts, 2)
            for most in CURRENTS_MA[led["rated_ma"] >= CURRENTS_MA]
        ]
        ratio, circuit = min(
            ((_ratio(fields, candela(led, one.current_ma)), one) for one in circuits),
            key=lambda pair: pair[0],
        )
        heads, rods = pair.heads(), pair.rods()
        metres = math.ceil(2 * 2 * (pair.length + WIRE_MM) / 1e3)
        return UpperLamps(
            printed=(_bar(self.site, pair),),
            purchased=(
                *(_board(k, ends, led) for k, ends in enumerate(heads, 1)),
                *(_rod(k, points, pair, rod) for k, points in enumerate(rods, 1)),
            ),
            fasteners=_set_screw(self.site, pair),
            listed={LED: 2, ROD: 2, WIRE: metres} | {circuit.part.name: 1},
            led=led,
            rod=rod,
            places=pair.places(),
            heads=heads,
            rods=rods,
            circuit=circuit,
            ratio=ratio,
            hides=_hides(pair, self.site.keep_out.capture),
        )


def _hides(pair: _Pair, radius: float) -> float:
    """Share of the rays from above into the capture sphere that boards and rods stop, about.

    Through a point at a distance r from the middle of a sphere of radius R go rays of the solid
    angle 2 pi (1 - sqrt(1 - (R / r)^2)); all rays from above have 2 pi times the area pi R^2.
    """
    _, start, end = pair.rods()[0]
    end = start + (end - start) * min(1.0, (float(start[2]) + radius) / float(start[2] - end[2]))
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    along = start + share[:, None] * (end - start)
    area = float(norm(end - start)) * (pair.thickness + 2 * TOLERANCE_MM) / SAMPLES
    head = np.pi * (pair.board / 2 + TOLERANCE_MM) ** 2
    far = np.append(norm(along), pair.distance)
    seen = 1 - np.sqrt(np.maximum(1 - (radius / far) ** 2, 0))
    return float(2 * (seen @ np.append(np.full(SAMPLES, area), head)) / (np.pi * radius**2))


def _surfaces(radius: float) -> tuple[Floats, Floats]:
    """Points (n, 3) in the middle and on an object that shades itself, and normals (n, 3)."""
    tilts = np.radians(np.arange(LOWEST_DEG, 91, STEP_DEG))
    rings = [max(1, round(36 * math.cos(tilt))) for tilt in tilts]
    angle = np.concatenate([2 * np.pi * np.arange(n) / n for n in rings])
    tilt = np.repeat(tilts, rings)
    level = np.cos(tilt)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    normals = np.column_stack([level, np.sin(tilt)])
    points = np.vstack([0 * normals, OBJECT_OF_CAPTURE * radius * normals])
    return points, np.vstack([normals, normals])


def _fields(lamps: LampLayout, places: Floats, radius: float) -> tuple[Floats, Floats]:
    """Light of the lamps, and of the LEDs with a candela each, in the middle and beside it."""
    points, normals = _surfaces(radius)
    below = RectangularLamps(lamps.places, lamps.inward, *lamps.sides, lamps.lumen)
    given = irradiance(below, points, normals)
    above = lambertian(places, -unit(places), np.ones(len(places)), points, normals)
    return given.reshape(2, -1), above.reshape(2, -1)


def _ratio(fields: tuple[Floats, Floats], each: float) -> float:
    """Greatest ratio of brightest to darkest, in the middle and on the object."""
    total = fields[0] + each * fields[1]
    least = np.maximum(total.min(axis=1), 1e-9)
    return float((total.max(axis=1) / least).max())


def _bar(site: Site, pair: _Pair) -> Component:
    """A bar across the post, with a slot for each rod, and a hole for the set screw's insert."""
    (low, high), half, post = pair.bar, pair.half_bar, site.stage.sizes.post
    collar, slot = post + COLLAR_MM, (pair.thickness + SLOT_PLAY_MM) / 2
    middle = np.array([0.0, 0.0, (low + high) / 2])
    bore = np.array([0.0, 0.0, low - THROUGH_MM]), np.array([0.0, 0.0, high + THROUGH_MM])
    insert = site.base.spec.insert_hole_mm / 2
    cuts: list[Primitive] = [
        cylinder_between(bore[0], bore[1], post + BORE_PLAY_MM),
        cylinder_between(middle, middle + (collar + THROUGH_MM) * ACROSS, insert),
    ]
    for _, elbow, end in pair.rods():
        along = unit(end - elbow)
        axes = np.stack([ACROSS, along, np.cross(ACROSS, along)])
        at, deep = axes @ end, 2 * BAR_MM
        low_at, high_at = np.array([[-slot, -deep, -slot], [2 * BAR_HALF_MM, deep, slot]])
        first, last = at + low_at, at + high_at
        cuts.append(box(first, last, axes))
    return Component(
        "upper_bar",
        "bar on the stage's post that carries the rods of the LEDs above the object",
        (
            box((-BAR_HALF_MM, -half, low), (BAR_HALF_MM, half, high)),
            box((-collar, -collar, low), (collar, collar, high)),
        ),
        tuple(cuts),
        (-UP, UP),
    )


def _board(number: int, ends: Floats, led: PurchasedPart) -> Component:
    out = unit(ends[1] - ends[0])
    back = ends[0] + (EMITTER_MM + BOARD_MM) * out
    package = cylinder_between(ends[0], back, led["emitter_mm"] / 2)
    board = cylinder_between(ends[0] + EMITTER_MM * out, back, led["diameter_mm"] / 2)
    return Component(f"upper_board_{number}", led.what, (board, package), part=led.name)


def _rod(number: int, points: Floats, pair: _Pair, rod: PurchasedPart) -> Component:
    what = f"{rod.what}, cut to {pair.length:.1f} mm, with its wires"
    bodies = _rod_bodies(points, pair.thickness)
    return Component(f"upper_rod_{number}", what, bodies, part=rod.name)


def _rod_bodies(points: Floats, thickness: float) -> tuple[Primitive, ...]:
    """Both straight parts of a rod (3, 3); they overlap at the elbow."""
    start, elbow, end = points
    beyond = elbow + thickness / 2 * unit(elbow - start)
    return (
        cylinder_between(start, beyond, thickness / 2),
        cylinder_between(elbow, end, thickness / 2),
    )


def _set_screw(site: Site, pair: _Pair) -> tuple[Fastener, ...]:
    """Insert and set screw that hold the bar on the post."""
    post, (low, high) = site.stage.sizes.post, pair.bar
    insert, screw = m3_insert(site.base.spec, site.parts), site.parts[SET_SCREW]
    along = np.array([-1.0, 0.0, 0.0])
    middle = np.array([0.0, 0.0, (low + high) / 2])
    face, end = post + COLLAR_MM, post + TIP_MM + screw["length_mm"]
    return (
        Fastener(insert, middle - face * along, along, ("upper_bar",)),
        Fastener(screw, middle - end * along, along, ("upper_bar",)),
    )


@planned("Upper lamps", NAMES, near=("stage_post",))
def upper_step(machine: AssembledMachine) -> Values:
    """Bar, rods and LEDs above the object."""
    lamps = machine.record.lamps
    assert lamps is not None
    assert lamps.upper is not None
    upper = lamps.upper
    rod = np.array(upper.leds[0].rod_mm)
    lengths = norm(np.diff(rod, axis=0))
    cosine = float(unit(rod[1] - rod[0]) @ unit(rod[2] - rod[1]))
    return {
        "led": machine.ref(upper.part),
        "rod": machine.ref(ROD),
        "length": float(lengths.sum()),
        "end": float(lengths[0]),
        "bend": math.degrees(math.acos(min(cosine, 1.0))),
        "aside": abs(upper.leds[0].position_mm[1]),
        "height": upper.leds[0].position_mm[2],
        "tolerance": upper.tolerance_mm,
        "current": upper.current_ma,
    }


UPPER = Part(
    (upper_step,),
    upper_layout,
    remedies={NAMES: "prototype.light.upper false"},
)
