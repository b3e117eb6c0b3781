"""Lamps below the horizon: LED strips on the uprights, and on stands before the camera.

Four upright lamps are images of one another in the planes x = 0 and y = 0. Where they have no
room, two level ones are each other's image by the half turn about z, on a bar across the uprights
and on a bridge over the camera: decision 0014.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tbcad.core.geometry.primitives import Component, Primitive, enclosing_triangles
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.core.spec.section import AUTO
from tbcad.prototype.frame.purchased import on_uprights
from tbcad.prototype.keepout import KeepOut, min_distance
from tbcad.prototype.light.lamp import (
    HOLDER_MM,
    OUT_MM,
    SHORT_STRIP,
    STRIP,
    TAIL_MM,
    LampLayout,
    LampMounts,
    hidden_by_base,
    in_view,
)
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.types import Floats

SIGNS = np.array([[1.0, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]])  # lamp 1 and its images
HALF_TURN = np.array([[1.0, 1, 1], [-1, -1, 1]])  # of two lamps
# By how much level lamps are beside the plane y = 0: where the base hides one side, the other.
ASIDE_MM = (0.0, -5.0, 5.0, -10.0, 10.0, -15.0, 15.0)
FOOT_HEIGHT_MM = 50.0  # of the uprights' feet, which holders stay above
HEAD_MM = 8.5  # of a holder's screw, which strips keep clear of
BESIDE_MM = 1.0  # of level lamps and what holds them from other static parts
STEP_MM = 2.5  # between heights that are tried
MAX_MA = 1000.0  # half of the supply's; the other half is the motor's
LEVEL = np.array([1.0, 0.0, 0.0])


def lamp_layout(
    spec: PrototypeSpec,
    face: float,
    camera: Camera,
    keep_out: KeepOut,
    parts: Parts,
    beside: Sequence[Component] = (),
) -> LampLayout | None:
    """The lamps of a prototype; None without any, also where "auto" finds no place for them.

    The face is x of the uprights' front, mm. The camera must not see lamps or stands, and these
    must not meet the static parts beside them.

    SpecError when lamps cannot be where the spec has them, or take too much current; it says what
    to change.
    """
    section = spec.light
    strip, short = parts[STRIP], parts[SHORT_STRIP]
    upright = _LampSearch(spec, face, camera, keep_out, beside, parts, strip, aside=None)
    level = [replace(upright, strip=one, aside=at) for one in (strip, short) for at in ASIDE_MM]
    found = [upright, *level]
    if (current := found[0].layout(-1.0).current_ma) > MAX_MA:
        raise SpecError(
            f"the lamps take {current:.0f} mA, more than the {MAX_MA:.0f} that the supply has "
            "left: make prototype.light.strips or segments smaller"
        )
    if section.lamp_z_mm == AUTO:
        heights = ((places, places.highest()) for places in found)
        return next((places.layout(z) for places, z in heights if z is not None), None)
    z = float(section.lamp_z_mm)
    if z == 0:
        return None
    fitting = next((places for places in found if not places.fault(z)), None)
    if fitting is None:
        raise SpecError(
            f"prototype.light.lamp_z_mm {z:g}: {found[0].fault(z)}; of two level lamps, "
            f"{found[1].fault(z)}: set it to auto, or to 0 for no lamps"
        )
    return fitting.layout(z)


@dataclass(frozen=True)
class _LampSearch:
    """Places of four upright lamps, or of two level ones beside the plane y = 0 (mm).

    What decides where lamps can be has the names of the arguments of `lamp_layout`.
    """

    spec: PrototypeSpec
    face: float
    camera: Camera
    keep_out: KeepOut
    beside: Sequence[Component]
    parts: Parts
    strip: PurchasedPart
    aside: float | None

    @property
    def level(self) -> bool:
        return self.aside is not None

    @property
    def length(self) -> float:
        """Of a strip, mm."""
        return self.spec.light.segments * self.strip["cut_mm"]

    @cached_property
    def mounts(self) -> LampMounts:
        width = self.spec.light.strips * self.strip["width_mm"]
        sides = (self.length, width) if self.level else (width, self.length)
        return LampMounts(self.spec.frame, self.strip, self.face, sides, self.level)

    def places(self, z: float) -> Floats:
        """Middles of the shining faces (l, 3), at a height."""
        x = -self.face - HOLDER_MM - self.strip["thickness_mm"]
        if self.aside is not None:
            return np.asarray(HALF_TURN * [x, self.aside, z]) + 0.0
        return np.asarray(SIGNS * [x, self.mounts.across + OUT_MM, z])

    def highest(self) -> float | None:
        """The greatest height at which lamps have room, or None."""
        z = -STEP_MM
        while self.fault(z):
            z -= STEP_MM
            if self._lowest(z) < self.spec.frame.floor_mm:
                return None
        return z

    def _lowest(self, z: float) -> float:
        """Lower end of what is on the uprights."""
        if self.level:
            return z - self.mounts.half_height
        return z - self.length / 2 - TAIL_MM

    def fault(self, z: float) -> str:
        """What is wrong with lamps at a height, or nothing."""
        if self._lowest(z) < self.spec.frame.floor_mm + FOOT_HEIGHT_MM:
            return "the lamps reach down to the base plate"
        # How far level strips and a screw's head beside them reach from y = 0.
        reach = abs(self.aside or 0.0) + (self.length + HEAD_MM) / 2
        if self.level and reach > self.mounts.across:
            return "the strips are longer than there is room between the uprights' screws"
        layout = self.layout(z)
        need, bodies = self.spec.frame.clearance_mm, _bodies(layout)
        if in_view(bodies, self.camera):
            return "the camera sees a lamp or its stand"
        if self.level and (name := _met(bodies, self.beside)):
            return f"a lamp or its holder meets the {name.replace('_', ' ')}"
        for what, distance in (
            ("the light of the balls", self.keep_out.to_light),
            ("what the base sweeps", self.keep_out.to_swept),
        ):
            if min_distance(distance, bodies, need) < need:
                return f"a lamp or its holder is less than {need:g} mm from {what}"
        hidden = hidden_by_base(layout, self.spec.stage, self.keep_out)
        return "the base comes between a lamp and the object's room" if hidden else ""

    def layout(self, z: float) -> LampLayout:
        """The lamps at a height."""
        mounts, places = self.mounts, self.places(z)
        numbered = list(enumerate(places, 1))
        before = [one for one in numbered if one[1][0] > 0]
        behind = [one for one in numbered if one[1][0] < 0]
        return LampLayout(
            strip=self.strip,
            strips=self.spec.light.strips,
            length=self.length,
            level=self.level,
            places=places,
            inward=-np.sign(places[:, :1]) * LEVEL,
            stands=tuple(mounts.stand(number, place) for number, place in before),
            holders=tuple(mounts.holder(number, place) for number, place in behind),
            screws=tuple(dict.fromkeys(float(at[2]) for at in mounts.screws(behind[0][1]))),
            fasteners=tuple(
                fastener
                for number, place in behind
                for fastener in on_uprights(
                    f"lamp_holder_{number}", mounts.screws(place), -LEVEL, HOLDER_MM, self.parts
                )
            ),
            bodies=tuple(
                mounts.strips(number, place, f"{self.spec.light.strips} of {self.length:g} mm")
                for number, place in numbered
            ),
        )


def _bodies(layout: LampLayout) -> list[Primitive]:
    """Bodies of lamps and of what holds them."""
    parts = [*(stand.component for stand in layout.stands), *layout.holders, *layout.bodies]
    return [body for part in parts for body in part.added]


def _met(bodies: Sequence[Primitive], others: Sequence[Component]) -> str:
    """Name of a part in whose way bodies are, by the upright boxes round all bodies, or ""."""
    own = [_box(body) for body in bodies]
    for other in others:
        for low, high in map(_box, other.added):
            near = ((low - BESIDE_MM < top) & (bottom < high + BESIDE_MM) for bottom, top in own)
            if any(axes.all() for axes in near):
                return other.name
    return ""


def _box(body: Primitive) -> tuple[Floats, Floats]:
    points = enclosing_triangles(body).reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)
