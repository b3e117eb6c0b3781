"""The lamps as data: strips, places, bodies, and what holds them."""

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from tbcad.core.geometry.primitives import Component, Primitive, Prism, box
from tbcad.core.geometry.rotations import even_angles, unit_circle
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.prototype import PrototypeSpec, StageSpec
from tbcad.prototype.frame.corner import CORNER, StandingBar
from tbcad.prototype.frame.shared import (
    CLEARANCE_HOLE_MM,
    EXTRUSION_MM,
    THROUGH_MM,
    UPRIGHTS,
    drilled_holes,
    on_uprights,
)
from tbcad.prototype.keepout import KeepOut
from tbcad.prototype.part import Mounted
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, choose_part
from tbcad.types import Floats

STRIP, SHORT_STRIP = "STRIP-COB-24V", "STRIP-240-24V"
EDGE_MM = 2.0  # of a plate beyond the strips
ROOM_SIDES = 12
EDGE_POINTS = 9
MARCHES, NEAR_MM = 48, 0.5  # steps along a line of light, and how near to the base it may come
HOLDER_MM = 8.0  # thickness behind the strips
POST_OUT_MM = 6.0  # by which posts with holders stand farther out than upright lamps
OFF_CAMERA_MM = 3.0  # from posts to the camera and its mount
POSTS = "lamp_post_left", "lamp_post_right"  # before the camera, at positive y and at negative
OUT_MM = 12.0  # by which upright lamps are farther out than the uprights' middles
TAIL_MM = 34.0  # of a holder on an upright below the strips, for its two screws
TAIL_SCREWS_MM = (9.0, 25.0)  # below the strips
SCREW_MM = 5.0  # thread
LEVEL, ACROSS, UP = np.eye(3)
SIGNS = np.array([[1.0, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]])  # lamp 1 and its images
HALF_TURN = np.array([[1.0, 1, 1], [-1, -1, 1]])  # of two lamps


@dataclass(frozen=True, kw_only=True)
class LampLayout(Mounted):
    """The lamps: strips and posts as purchased bodies, holders on uprights or posts."""

    strip: PurchasedPart  # that they are made of, from the lists
    strips: int  # number of strips on each, side by side
    length: float  # of a strip, mm
    level: bool  # whether strips lie level, along y; else they are upright
    places: Floats  # middles of the shining faces, mm, (l, 3)
    inward: Floats  # unit directions that they shine in, (l, 3)
    # heights (z) of the holders' screws on each upright, the upper first, mm
    screws: tuple[float, ...]
    column: float  # y of the middles of the posts, at either side, mm

    @property
    def bodies(self) -> tuple[Component, ...]:
        """Those of the strips, in the order of their places."""
        return self.purchased[-len(self.places) :]

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
    camera: float = 0.0  # half width of what posts stand beside: the camera, or its mount

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
    def on_posts(self) -> bool:
        """Whether lamps before the camera stick on the posts themselves, without holders."""
        inner = self.across + OUT_MM - EXTRUSION_MM / 2
        narrow = self.half <= EXTRUSION_MM / 2 and self.camera + OFF_CAMERA_MM <= inner
        return not self.level and narrow

    @property
    def column(self) -> float:
        """Y of the posts' middles, at either side."""
        usual = self.across + OUT_MM
        if self.on_posts:
            return usual
        return max(usual + POST_OUT_MM, self.camera + OFF_CAMERA_MM + EXTRUSION_MM / 2)

    def post_face(self, place: Floats) -> float:
        """X of the posts' faces toward the object."""
        strips = float(place[0]) + self.strip["thickness_mm"]
        return strips if self.on_posts else strips + HOLDER_MM

    def screws(self, place: Floats) -> list[Floats]:
        """Places of a holder's screws on the faces of uprights or posts, the upper first."""
        front = place[0] > 0
        x, y = (self.post_face(place), self.column) if front else (self.face, self.across)
        if self.level:
            return [np.array([x, side * y, place[2]]) for side in (1, -1)]
        end = float(place[2]) - self.sides[1] / 2
        return [np.array([x, np.sign(place[1]) * y, end - down]) for down in TAIL_SCREWS_MM]

    def holder(self, number: int, place: Floats) -> Component:
        """A bar across two uprights or posts, or a plate on one with its screws below the strips.

        A plate lies flat on its printed face; turned over, one of the right side is one of the
        left.
        """
        screws, half = self.screws(place), EXTRUSION_MM / 2
        across, what = abs(float(screws[0][1])), "uprights" if place[0] < 0 else "posts"
        y = np.array([-1, 1]) * (across + half)
        if not self.level:
            lamp = abs(float(place[1]))
            ends = min(across - half, lamp - self.half), max(across + half, lamp + self.half)
            y = np.sort(np.sign(place[1]) * np.array(ends))
        plate = self._plate(place, y, self._heights(place, TAIL_MM))
        outward = np.sign(place[0]) * LEVEL
        holes = drilled_holes(screws, -HOLDER_MM * outward, CLEARANCE_HOLE_MM[SCREW_MM])
        what = (
            f"holder of lamp {number} on both {what}"
            if self.level
            else (f"holder of lamp {number} on one of the {what}")
        )
        return Component(f"lamp_holder_{number}", what, (plate,), tuple(holes), (outward,))

    def posts(self, place: Floats) -> list[StandingBar]:
        """Both posts before the camera, up to the upper end of what they carry."""
        low, high = self.spec.frame.floor_mm, self._heights(place, EDGE_MM)[1]
        hint = "make prototype.frame.floor_mm greater, or add a longer one"
        key = "prototype.frame.floor_mm"
        part = choose_part(self.parts, "extrusions", key, hint, length_mm=high - low)
        x = self.post_face(place) + EXTRUSION_MM / 2
        middles = (np.array([x, side * self.column]) for side in (1, -1))
        bars = zip(POSTS, middles, strict=True)
        return [
            StandingBar(name, part, at, (low, high), np.eye(3), self.parts) for name, at in bars
        ]

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
        held = [one for one in numbered if one[1][0] < 0 or not self.on_posts]
        strips, posts = self.spec.light.strips, self.posts(places[0])
        brackets = [
            one
            for post, side in zip(posts, (1, -1), strict=True)
            for one in post.brackets(((-1, 0), (0, side)))
        ]
        listed = Counter({CORNER: len(brackets), posts[0].part.name: len(posts)})
        listed[self.strip.name] = math.ceil(len(places) * strips * self.length / 1e3)
        return LampLayout(
            brackets=tuple(brackets),
            printed=tuple(self.holder(number, place) for number, place in held),
            purchased=(
                *(post.component for post in posts),
                *(
                    self.strips(number, place, f"{strips} of {self.length:g} mm")
                    for number, place in numbered
                ),
            ),
            fasteners=tuple(
                fastener
                for number, place in held
                for fastener in on_uprights(
                    f"lamp_holder_{number}",
                    self.screws(place),
                    np.sign(place[0]) * LEVEL,
                    HOLDER_MM,
                    self.parts,
                    POSTS if place[0] > 0 else UPRIGHTS,
                )
            ),
            listed=listed,
            strip=self.strip,
            strips=strips,
            length=self.length,
            level=self.level,
            places=places,
            inward=-np.sign(places[:, :1]) * LEVEL,
            screws=tuple(dict.fromkeys(float(at[2]) for at in self.screws(places[-1]))),
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
