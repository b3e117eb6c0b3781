"""The lamps as data: strips, places, bodies, and what holds them."""

import math
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import Component, Primitive, Prism, box
from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.prototype import PrototypeSpec, StageSpec
from tbcad.prototype.frame.shared import (
    CLEARANCE_HOLE_MM,
    EXTRUSION_MM,
    THROUGH_MM,
    drilled_holes,
    on_uprights,
)
from tbcad.prototype.keepout import KeepOut
from tbcad.prototype.part import Bracket, Mounted
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.types import Floats

STRIP, SHORT_STRIP = "STRIP-COB-24V", "STRIP-240-24V"
EDGE_MM = 2.0  # of a plate beyond the strips
ROOM_SIDES = 12
EDGE_POINTS = 9
MARCHES, NEAR_MM = 48, 0.5  # steps along a line of light, and how near to the base it may come
HOLDER_MM = 8.0  # thickness behind the strips
COLUMN_MM = 14.0  # depth of a stand's column behind its holder's face
COLUMN_OUT_MM = 6.0  # by which columns stand farther out than upright lamps, away from the camera
# A stand's foot, from the column's middle: to either side along x, inward and outward along y, and
# to its two screws.
OFF_CAMERA_MM = 3.0  # from columns and feet to the camera
FOOT_HALF_MM, FOOT_IN_MM, FOOT_OUT_MM = 18.0, 10.0, 34.0
SCREW_SIDE_MM, SCREW_OUT_MM = 10.0, 25.0
OUT_MM = 12.0  # by which upright lamps are farther out than the uprights' middles
TAIL_MM = 34.0  # of a holder on an upright below the strips, for its two screws
TAIL_SCREWS_MM = (9.0, 25.0)  # below the strips
SCREW_MM = 5.0  # thread
LEVEL, ACROSS, UP = np.eye(3)
SIGNS = np.array([[1.0, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]])  # lamp 1 and its images
HALF_TURN = np.array([[1.0, 1, 1], [-1, -1, 1]])  # of two lamps


@dataclass(frozen=True, kw_only=True)
class LampLayout(Mounted):
    """The lamps: strips as purchased bodies, stands as brackets, holders on the uprights."""

    strip: PurchasedPart  # that they are made of, from the lists
    strips: int  # number of strips on each, side by side
    length: float  # of a strip, mm
    level: bool  # whether strips lie level, along y; else they are upright
    places: Floats  # middles of the shining faces, mm, (l, 3)
    inward: Floats  # unit directions that they shine in, (l, 3)
    # heights (z) of the holders' screws on each upright, the upper first, mm
    screws: tuple[float, ...]
    column: float  # y of the middles of the stands' columns, at either side, mm

    @property
    def width(self) -> float:
        """Of all strips of a lamp, side by side, mm."""
        return self.strips * self.strip["width_mm"]

    @property
    def sides(self) -> tuple[float, float]:
        """Of a shining face, along y and along z, mm."""
        return (self.length, self.width) if self.level else (self.width, self.length)

    @property
    def metres(self) -> float:
        """Length of all strips, m."""
        return len(self.places) * self.strips * self.length / 1e3

    @property
    def watt(self) -> float:
        """Power of all lamps."""
        return self.metres * self.strip["watt_m"]

    @property
    def current_ma(self) -> float:
        """Of all lamps, at the strip's voltage."""
        return 1e3 * self.watt / self.strip["supply_v"]

    @property
    def lumen(self) -> float:
        """Light of one lamp."""
        return self.strips * self.length / 1e3 * self.strip["lumen_m"]

    @property
    def lux(self) -> float:
        """Light on upright surfaces in the middle, the mean over azimuths, no shadows cast."""
        away = norm(self.places)
        leaves = -np.sum(self.places * self.inward, axis=1) / away
        across = norm(self.places[:, :2]) / away / np.pi  # mean of a cosine that is not below 0
        return float((1e6 * self.lumen / np.pi * leaves * across / away**2).sum())

    def outlines(self) -> Floats:
        """Corners of all shining faces and the middles of their upright edges, mm, (l, 6, 3)."""
        y, z = np.array(self.sides) / 2
        around = [side * y * ACROSS + high * UP for side in (-1, 1) for high in (-z, 0.0, z)]
        return np.asarray(self.places[:, None] + np.array(around))


def in_view(bodies: list[Primitive], camera: Camera) -> bool:
    """Whether the camera sees the upper edges of bodies, which are the nearest to its view."""
    edges = np.vstack([_upper_edges(body) for body in bodies])
    right, down, depth = ((edges - camera.pinhole) @ camera.axes.T).T
    half = camera.half_sizes
    return bool(((np.abs(right) < half[0] * depth) & (np.abs(down) < half[1] * depth)).any())


def hidden_by_base(layout: LampLayout, stage: StageSpec, keep_out: KeepOut) -> bool:
    """Whether the base comes between a lamp and the object's room at or between the stops."""
    room = _room(stage, keep_out.capture)
    faces = layout.outlines().reshape(-1, 3)
    starts, ends = np.tile(room, (len(faces), 1)), np.repeat(faces, len(room), axis=0)
    return not _reaches(keep_out.at_stops or keep_out, starts, ends)


def _upper_edges(body: Primitive) -> Floats:
    """Points (n, 3) along the edges of an upright box's upper face."""
    assert isinstance(body, Prism)
    corners = np.vstack([body.corners, body.corners + body.along])
    top = corners[corners[:, 2] > corners[:, 2].max() - THROUGH_MM]
    pairs = (
        top[:, None, None]
        + np.linspace(0, 1, EDGE_POINTS)[:, None] * (top - top[:, None])[:, :, None]
    )
    return np.asarray(pairs.reshape(-1, 3))


def _room(stage: StageSpec, capture: float) -> Floats:
    """Points (p, 3) round the object's room, from the disc to the capture sphere, mm."""
    radius = float(stage.object_diameter_mm) / 2
    top = math.sqrt(max(capture**2 - radius**2, 0.0))
    circle = radius * unit_circle(even_angles(ROOM_SIDES))
    heights = (float(stage.top_mm), 0.0, top)
    return np.vstack([np.column_stack([circle, np.full(len(circle), z)]) for z in heights])


def _reaches(keep_out: KeepOut, starts: Floats, ends: Floats) -> bool:
    """Whether all segments (n, 3) miss what the base sweeps.

    Each is followed in steps of the distance to it, which cannot jump over anything.
    """
    length = norm(ends - starts)
    along, at = (ends - starts) / length[:, None], np.zeros(len(starts))
    for _ in range(MARCHES):
        distance = keep_out.to_swept(starts + at[:, None] * along)
        if distance.min() < NEAR_MM:
            return False
        at = at + distance
        inside = at < length
        if not inside.any():
            return True
        starts, along, at, length = starts[inside], along[inside], at[inside], length[inside]
    return False


@dataclass(frozen=True)
class Lamps:
    """Four upright lamps, or two level ones beside the plane y = 0, at any height."""

    spec: PrototypeSpec  # of the prototype
    parts: Parts  # lists of purchased parts
    face: float  # x of the uprights' front, mm
    strip: PurchasedPart  # part
    aside: float | None  # y of level lamps, mm; None: they are upright
    camera: float = 0.0  # half width of the camera, which columns stand beside

    @property
    def level(self) -> bool:
        """Whether strips lie level, along y; else they are upright."""
        return self.aside is not None

    @property
    def length(self) -> float:
        """Of a strip, mm."""
        return self.spec.light.segments * self.strip["cut_mm"]

    @property
    def sides(self) -> tuple[float, float]:
        """Of a shining face, along y and along z, mm."""
        width = self.spec.light.strips * self.strip["width_mm"]
        return (self.length, width) if self.level else (width, self.length)

    @property
    def half(self) -> float:
        """Half width of an upright lamp's plate, mm."""
        return max(self.sides[0] / 2 + EDGE_MM, EXTRUSION_MM / 2)

    @property
    def half_height(self) -> float:
        """Half height of a level lamp's plate, mm."""
        return max(self.sides[1] / 2 + EDGE_MM, EXTRUSION_MM / 2)

    @property
    def across(self) -> float:
        """Y of the uprights' middles."""
        return self.spec.frame.uprights_mm / 2

    @property
    def column(self) -> float:
        """Y of the columns' middles, at either side."""
        return self.across + OUT_MM + COLUMN_OUT_MM + self.aside_camera

    @property
    def aside_camera(self) -> float:
        """How much farther out columns are for a wide camera."""
        usual = self.across + OUT_MM + COLUMN_OUT_MM
        return max(self.camera + FOOT_IN_MM + OFF_CAMERA_MM - usual, 0.0)

    def screws(self, place: Floats) -> list[Floats]:
        """Places of a holder's screws on the uprights' faces, the upper first."""
        if self.level:
            return [np.array([self.face, side * self.across, place[2]]) for side in (1, -1)]
        y, end = np.sign(place[1]) * self.across, float(place[2]) - self.sides[1] / 2
        return [np.array([self.face, y, end - down]) for down in TAIL_SCREWS_MM]

    def holder(self, number: int, place: Floats) -> Component:
        """A bar across both uprights, or a plate on one with its screws below the strips."""
        where, y = "both uprights", np.array([-1, 1]) * (self.across + EXTRUSION_MM / 2)
        if not self.level:
            ends = self.across - EXTRUSION_MM / 2, abs(float(place[1])) + self.half
            where, y = "an upright", np.sort(np.sign(place[1]) * np.array(ends))
        plate = self._plate(place, y, self._heights(place, TAIL_MM))
        holes = drilled_holes(self.screws(place), HOLDER_MM * LEVEL, CLEARANCE_HOLE_MM[SCREW_MM])
        what = f"holder of lamp {number} on {where}"
        return Component(f"lamp_holder_{number}", what, (plate,), tuple(holes), (-LEVEL,))

    def stand(self, number: int, place: Floats) -> Bracket:
        """A bridge on two columns past the camera, or a plate on one; a foot has two screws."""
        what, sides = f"bridge of lamp {number} over the camera", [1.0, -1.0]
        y, heights = np.array([-self.column, self.column]), self._heights(place, EDGE_MM)
        if not self.level:
            side, end = float(np.sign(place[1])), abs(float(place[1]))
            what, sides = f"stand of lamp {number}", [side]
            y = np.sort(side * np.array([end - self.half, end + self.half + self.aside_camera]))
        x = float(place[0]) + self.strip["thickness_mm"] + COLUMN_MM / 2
        floor, flange = self.spec.frame.floor_mm, self.spec.frame.flange_mm
        feet, holes, added = list[Floats](), list[Floats](), list[Primitive]()
        half, beside = np.array([COLUMN_MM / 2, FOOT_IN_MM]), np.array([[-1, 0], [1, 0]])
        for side in sides:
            middle = np.array([x, side * self.column])
            out = np.sort(middle[1] + side * np.array([-FOOT_IN_MM, FOOT_OUT_MM]))
            foot = np.array([[x - FOOT_HALF_MM, out[0]], [x + FOOT_HALF_MM, out[1]]])
            column = (middle - half, middle + half)
            for (low, high), top in ((foot, floor + flange), (column, heights[1])):
                added.append(box((*low, floor), (*high, top)))
            feet.append(foot)
            holes.append(middle + SCREW_SIDE_MM * beside + [0.0, side * SCREW_OUT_MM])
        places = np.vstack(holes)
        starts = [np.array([*hole, floor]) for hole in places]
        component = Component(
            f"lamp_stand_{number}",
            what,
            (*added, self._plate(place, y, heights)),
            tuple(drilled_holes(starts, flange * UP, CLEARANCE_HOLE_MM[SCREW_MM])),
            (LEVEL, -UP),
        )
        return Bracket(component, places, np.vstack(feet))

    def strips(self, number: int, place: Floats, cut: str) -> Component:
        """The strips of a lamp, as one body."""
        half_y, half_z = np.array(self.sides) / 2
        x = np.sort(place[0] + np.sign(place[0]) * np.array([0.0, self.strip["thickness_mm"]]))
        y, z = place[1] + np.array([-half_y, half_y]), place[2] + np.array([-half_z, half_z])
        low, high = np.array([x, y, z]).T
        what = f"{self.strip.what}, cut to {cut}"
        return Component(f"lamp_{number}", what, (box(low, high),), part=self.strip.name)

    def places(self, z: float) -> Floats:
        """Middles of the shining faces (l, 3), at a height."""
        x = -self.face - HOLDER_MM - self.strip["thickness_mm"]
        if self.aside is not None:
            return np.asarray(HALF_TURN * [x, self.aside, z]) + 0.0
        return np.asarray(SIGNS * [x, self.across + OUT_MM, z])

    def layout(self, z: float) -> LampLayout:
        """The lamps at a height."""
        places = self.places(z)
        numbered = list(enumerate(places, 1))
        before = [one for one in numbered if one[1][0] > 0]
        behind = [one for one in numbered if one[1][0] < 0]
        strips = self.spec.light.strips
        return LampLayout(
            brackets=tuple(self.stand(number, place) for number, place in before),
            printed=tuple(self.holder(number, place) for number, place in behind),
            purchased=tuple(
                self.strips(number, place, f"{strips} of {self.length:g} mm")
                for number, place in numbered
            ),
            fasteners=tuple(
                fastener
                for number, place in behind
                for fastener in on_uprights(
                    f"lamp_holder_{number}", self.screws(place), -LEVEL, HOLDER_MM, self.parts
                )
            ),
            listed={self.strip.name: math.ceil(len(places) * strips * self.length / 1e3)},
            strip=self.strip,
            strips=strips,
            length=self.length,
            level=self.level,
            places=places,
            inward=-np.sign(places[:, :1]) * LEVEL,
            screws=tuple(dict.fromkeys(float(at[2]) for at in self.screws(behind[0][1]))),
            column=self.column,
        )

    def _heights(self, place: Floats, below: float) -> tuple[float, float]:
        """Of a plate: alike about level strips, else so far below upright ones."""
        z, half = float(place[2]), self.half_height
        if self.level:
            return z - half, z + half
        return z - self.sides[1] / 2 - below, z + self.sides[1] / 2 + EDGE_MM

    def _plate(self, place: Floats, y: Floats, z: tuple[float, float]) -> Prism:
        """The plate behind the strips, between two places across and two heights."""
        near = abs(float(place[0])) + self.strip["thickness_mm"]
        x = np.sort(np.sign(place[0]) * np.array([near, near + HOLDER_MM]))
        return box((x[0], y[0], z[0]), (x[1], y[1], z[1]))
