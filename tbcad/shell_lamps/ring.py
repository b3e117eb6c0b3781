"""The ring of LEDs round a lens: its place, its body, and the light that it gives.

It is clamped on the lens's barrel, its face flush with the lens's front, so that the camera cannot
see it. LEDs on round boards are glued behind windows in the face. The part's own frame has the face
at z = 0 and the lens's front toward -z, as it is printed; LED k is at an azimuth of k + 1/2 steps
from x, which is along the rows of the camera's picture.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from tbcad.core.geometry.primitives import Component, Primitive, Revolved, box, cylinder_between
from tbcad.core.geometry.rotations import even_angles
from tbcad.core.mirrors.array import MirrorArray, MirrorDesign
from tbcad.core.optics.camera import Camera
from tbcad.core.optics.mirror_light import (
    REFLECTED,
    Lamps,
    direct_light,
    light_by_mirrors,
    lit_mirrors,
)
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.section import AUTO
from tbcad.prototype.frame.chosen_camera import chosen_camera
from tbcad.prototype.purchased.parts import Parts, PurchasedPart
from tbcad.prototype.resistors import SeriesResistor, series_resistor
from tbcad.types import Floats

LED, SET_SCREW, INSERT = "STAR-3535", "SET-M3x8", "INSERT-M3"
UNEVEN = 4.0  # brightest over darkest surface, at most
# Of smaller machines more than 0.5 % of the pixels may see an LED past the object.
LEAST_CAPTURE_MM = 40.0
NUMBER = 6  # of LEDs, if nothing else is asked for: one string of them on 24 V
SUPPLY_V = 24.0
BORE_MM, FRONT_MM = 60.0, 10.0  # where no camera is known
PLAY_MM = 0.5  # of the barrel in the bore, on the diameter
COLLAR_MM, COLLAR_WALL_MM = 14.0, 7.5  # height and wall round the barrel: inserts are 5.7 mm long
FACE_MM = 1.6  # thickness of the face: LEDs on their boards are 2 mm high
RIM_MM, RIM_WALL_MM = 6.0, 1.6  # height and wall of the outer rim
BOARD_PLAY_MM = 0.5  # beside a board
WINDOW_MM = 4.0  # radius of a window
SCREWS, SCREW_Z_MM = 3, 9.0  # set screws, and their height over the face
INSERT_HOLE_MM = 4.0  # diameter
FLAT_MM, FLAT_HALF_MM = 0.8, 3.0  # depth and half width of flats at the ends of their holes
NOTCH_MM = 6.0  # width of the cable's way through the rim
VIEW_SHARE = 0.9  # of the bore that the camera's view may fill
APART_MM = 2.0  # between rings, and from the shell
UP = np.array([0.0, 0.0, 1.0])
# Directions of surfaces on an object of two thirds of the capture sphere: steps in elevation.
STEP_DEG = 15.0
OBJECT_OF_CAPTURE = 2 / 3


@dataclass(frozen=True)
class LampRing:
    """A ring of LEDs for a lens."""

    led: PurchasedPart  # from the lists
    number: int  # of LEDs
    bore: float  # diameter of the lens's barrel, mm
    front: float  # from the pinhole to the face, along the optical axis, mm
    resistor: SeriesResistor  # of the ring's string
    # least, mean and greatest light of both rings on surfaces that face all ways, lux
    lux: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def even(self) -> bool:
        """Whether surfaces get like amounts of light."""
        least, _, greatest = self.lux
        return greatest <= UNEVEN * least

    @property
    def circle(self) -> float:
        """Radius of the circle of LEDs, mm; more where more boards than fit are asked for."""
        board = self.led["diameter_mm"] + BOARD_PLAY_MM
        beside = self.bore / 2 + COLLAR_WALL_MM + board / 2
        return max(beside, board / 2 / math.sin(math.pi / self.number))

    @property
    def outer(self) -> float:
        """Radius of the ring, mm."""
        return self.circle + self.led["diameter_mm"] / 2 + BOARD_PLAY_MM + RIM_WALL_MM

    @property
    def candela(self) -> float:
        """Of one LED along its axis: a Lambertian one sends pi times that."""
        share = self.resistor.current_ma / self.led["rated_ma"]
        return float(self.led["lumen"] * share / math.pi)

    @property
    def watt(self) -> float:
        """Power of one ring, its resistor included."""
        return SUPPLY_V * self.resistor.current_ma / 1e3

    @property
    def angles(self) -> Floats:
        """Azimuths of the LEDs (n,), rad."""
        return np.asarray(even_angles(self.number) + math.pi / self.number)

    def component(self) -> Component:
        """The printed ring, in its own frame."""
        inner, collar = (self.bore + PLAY_MM) / 2, self.bore / 2 + COLLAR_WALL_MM
        rim = self.outer - RIM_WALL_MM
        profile = [
            *((0.0, inner), (0.0, self.outer), (RIM_MM, self.outer), (RIM_MM, rim)),
            *((FACE_MM, rim), (FACE_MM, collar), (COLLAR_MM, collar), (COLLAR_MM, inner)),
        ]
        holes = [
            cylinder_between(at - UP, at + (FACE_MM + 1) * UP, WINDOW_MM)
            for at in self._round(self.angles, self.circle)
        ]
        return Component(
            "lamp_ring",
            "ring of LEDs round a camera's lens",
            (Revolved(np.array(profile)),),
            (*holes, *self._screws(inner, collar), self._notch()),
            (-UP,),
        )

    def _round(self, angles: Floats, radius: float) -> Floats:
        """Points (n, 3) on a circle in the face, mm."""
        return np.asarray(radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1))

    def _screws(self, inner: float, collar: float) -> list[Primitive]:
        """Holes of the inserts through the collar, between flats; the first is opposite x."""
        removed: list[Primitive] = []
        for way in self._round(even_angles(SCREWS) + math.pi, 1.0):
            axes = np.stack([way, np.cross(UP, way), UP])
            for near, far in ((inner - 1, inner + FLAT_MM), (collar - FLAT_MM, collar + 1)):
                low = near, -FLAT_HALF_MM, SCREW_Z_MM - FLAT_HALF_MM
                removed.append(box(low, (far, FLAT_HALF_MM, COLLAR_MM + 1), axes))
            start, end = ((radius * way + SCREW_Z_MM * UP) for radius in (inner, collar))
            removed.append(cylinder_between(start, end, INSERT_HOLE_MM / 2))
        return removed

    def _notch(self) -> Primitive:
        low = (self.outer - 2 * RIM_WALL_MM, -NOTCH_MM / 2, FACE_MM + 1)
        return box(low, (self.outer + 1, NOTCH_MM / 2, RIM_MM + 1))

    def places(self, camera: Camera) -> Floats:
        """Middles of the LEDs in a camera's ring, (n, 3), mm."""
        down = np.cross(camera.forward, camera.right)
        x, y, _ = self._round(self.angles, self.circle).T
        face = camera.pinhole + self.front * camera.forward
        return np.asarray(face + x[:, None] * camera.right + y[:, None] * down)

    def lamps(self, design: MirrorDesign) -> Lamps:
        """The LEDs of both rings."""
        cameras = [array.camera for array in design.arrays]
        places = np.concatenate([self.places(camera) for camera in cameras])
        forward = np.repeat([camera.forward for camera in cameras], self.number, axis=0)
        return Lamps(places, forward, np.full(len(places), self.candela))


def facing(step_deg: float) -> Floats:
    """Unit vectors (k, 3) of all directions, so many degrees apart or somewhat more."""
    rows = []
    for elevation in np.radians(np.arange(-90 + step_deg / 2, 90, step_deg)):
        count = max(1, round(360 / step_deg * np.cos(elevation)))
        level = np.cos(elevation)
        angle = even_angles(count)
        height = np.full(count, np.sin(elevation))
        rows.append(np.stack([level * np.cos(angle), level * np.sin(angle), height], axis=1))
    return np.concatenate(rows)


def lamp_ring(design: MirrorDesign, parts: Parts) -> LampRing | None:
    """The ring of LEDs for a shell's cameras; None without.

    Also where "auto" finds no room, or where rings would light unevenly or dazzle.

    SpecError: there is no room for what is asked for; it says what to change.
    """
    section, array = design.spec.shell.lamps, design.arrays[0]
    if section.leds == 0:
        return None
    number = NUMBER if section.leds == AUTO else int(section.leds)
    bore, front = _lens(design, array)
    resistor = series_resistor(parts[LED], parts[LED]["rated_ma"], SUPPLY_V, parts, number)
    ring = LampRing(parts[LED], number, bore, front, resistor)
    auto = section.leds == AUTO
    fault = _fault(ring, design)
    if fault and not auto:
        raise SpecError(f"shell.lamps: {fault}: set shell.lamps.leds to auto, or to 0 for none")
    if fault or (auto and design.spec.optics.capture_diameter_mm < LEAST_CAPTURE_MM):
        return None
    lit = replace(ring, lux=_light(ring, design))
    return lit if lit.even or not auto else None


def _light(ring: LampRing, design: MirrorDesign) -> tuple[float, float, float]:
    """Least, mean and greatest light on a sphere of two thirds of the capture sphere, lux.

    On surfaces that face all ways; the object stands in its own light.
    """
    radius = OBJECT_OF_CAPTURE * design.spec.optics.capture_diameter_mm / 2
    normals, lamps = facing(STEP_DEG), ring.lamps(design)
    total = direct_light(lamps, radius * normals, normals)
    for array, side in zip(design.arrays, (1.0, -1.0), strict=True):
        mirrors = lit_mirrors(array.mirrors, side, array.foot)
        by_mirrors = light_by_mirrors(lamps, mirrors, radius * normals, normals, radius)
        total = total + REFLECTED * by_mirrors
    return float(total.min()), float(total.mean()), float(total.max())


def _lens(design: MirrorDesign, array: MirrorArray) -> tuple[float, float]:
    """Diameter of the lens's barrel, and how far its front is before the pinhole, mm."""
    section, chosen = design.spec.shell.lamps, None
    if AUTO in (section.lens_mm, section.front_mm):
        try:
            chosen = chosen_camera(design.spec, array)
        except SpecError:
            chosen = None  # the prototype says so
    bore, front = (2 * chosen.lens_radius, -chosen.front) if chosen else (BORE_MM, FRONT_MM)
    bore = bore if section.lens_mm == AUTO else float(section.lens_mm)
    if section.front_mm != AUTO:
        return bore, float(section.front_mm)
    return bore, min(front, VIEW_SHARE * bore / 2 / _diagonal(array.camera))


def _diagonal(camera: Camera) -> float:
    """Tangent of half the camera's view from corner to corner."""
    across = math.tan(camera.hfov / 2)
    return across * math.hypot(1.0, camera.height_px / camera.width_px)


def _fault(ring: LampRing, design: MirrorDesign) -> str:
    """Why rings cannot be where they are, or nothing."""
    array = design.arrays[0]
    camera = array.camera
    if np.isnan(array.mirrors.radius).any():
        return "planar mirrors light an object in spots"
    if ring.front * _diagonal(camera) > ring.bore / 2:
        return f"at {ring.front:g} mm before the pinhole the camera sees the ring"
    middle = camera.pinhole + ring.front * camera.forward
    reach = ring.outer * np.sqrt(1 - camera.forward**2)
    if middle[0] - reach[0] < APART_MM / 2:
        return "the rings of both cameras meet"
    if middle[2] + reach[2] > array.foot - design.spec.shell.foot_flange.thickness_mm - APART_MM:
        return "the ring meets the shell"
    return ""
