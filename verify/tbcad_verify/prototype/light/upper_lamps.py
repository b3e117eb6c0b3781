"""LEDs above the object: where they are, how evenly all is lit with them, what they hide.

Compared is the irradiance of surfaces that some virtual camera sees at 60 degrees or less: in the
middle, and on a sphere of two thirds of the target, which stands in its own light; all bodies but
the stage throw shadows, the base at some stops. Boards and rods are in the light of the balls: a
merge leaves out what they hide, so its share of the rays is limited.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from tbcad_verify.mesh.vectors import norm, unit
from tbcad_verify.prototype.assembly import Shape
from tbcad_verify.prototype.bodies import (
    AssembledBodies,
    MeasuredPrototype,
    some_angles,
    stage_bodies,
)
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.light.ball_views import pixel_rays, ray_paths, stopped_above
from tbcad_verify.prototype.light.lamp_light import irradiance
from tbcad_verify.record.prototype import GLB, Lamps, UpperLamps, UpperLed
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, informative, no_faults
from tbcad_verify.types import Bools, Floats

# Of an LED by its name: lumen of a mA, diameters of board and of what shines, mm.
LEDS = {"STAR-3535-8": (0.4, 8.0, 3.5)}
FILE = GLB
CHECKS = {
    "upper lamps": "faults",
    "light ratio of the prototype": "",
    "hidden by upper lamps": "% of the rays",
    "glare of upper lamps": "% of the rays",
}
RATIO, HIDDEN, GLARE = 4.0, 3.0, 0.5  # limits; shares in %
SEEN_DEG = 60.0  # from a surface's normal
OBJECT_OF_TARGET = 2 / 3
TILTS, AROUND = 19, 36  # surfaces
SAME_MM = 0.05  # by which facets are off the bodies that they stand for
BRIGHT = 0.02  # of a recorded light
HALF_TURN = np.array([-1.0, -1.0, 1.0])
NONE = "no LEDs are above the object"
Cylinders: TypeAlias = list[tuple[Floats, Floats, float]]  # ends and diameters, mm


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    bodies: AssembledBodies,
    measured: MeasuredPrototype,
    drawn: Mapping[str, Shape],
) -> list[Check]:
    """The LEDs are as drawn; what is seen is lit evenly; little is hidden, and less dazzles."""
    listed, ratio, hidden, glare = names
    lamps = context.prototype.lamps
    upper = lamps.upper if lamps else None
    if lamps is None or upper is None:
        asked = context.export.spec.prototype.light.upper is True
        missing = at_most(listed, float(asked), 0, "the spec has upper lamps, the record has none")
        even = (
            informative(ratio, _ratio(context, lamps, bodies), NONE)
            if lamps
            else informative(ratio, 0, "there are no lamps")
        )
        return [missing, even, informative(hidden, 0, NONE), informative(glare, 0, NONE)]
    if upper.part not in LEDS:
        raise Unknown(f"{upper.part} is no LED that is known")
    stopped, dazzled = _rays(measured, upper)
    return [
        no_faults(listed, _faults(upper, drawn)),
        at_most(ratio, _ratio(context, lamps, bodies), RATIO, "surfaces that are seen stay dark"),
        at_most(hidden, stopped, HIDDEN, "boards and rods hide too much"),
        at_most(glare, dazzled, GLARE, "balls show the camera too much of the LEDs"),
    ]


def _faults(upper: UpperLamps, drawn: Mapping[str, Shape]) -> Iterator[str]:
    """Bodies that are not drawn where the record has them, and light that is not theirs."""
    lumen, board, _ = LEDS[upper.part]
    expected = lumen * upper.current_ma / np.pi
    if abs(upper.candela / expected - 1) > BRIGHT:
        yield f"{upper.candela:.3g} cd are not those of {upper.part} at {upper.current_ma:.3g} mA"
    if abs(upper.head_diameter - board) > SAME_MM:
        yield f"a board of {board:g} mm is recorded as one of {upper.head_diameter:g} mm"
    places = np.array([led.position for led in upper.leds])
    apart = np.linalg.norm(places[:, None] - places * HALF_TURN, axis=2).min(axis=1)
    if apart.max() > SAME_MM:
        yield f"an LED is {apart.max():.2g} mm off the image of all by the half turn"
    for led in upper.leds:
        yield from _led_faults(led, upper, drawn)


def _led_faults(led: UpperLed, upper: UpperLamps, drawn: Mapping[str, Shape]) -> Iterator[str]:
    """A board or rod that is drawn elsewhere than in its cylinders, which a merge leaves out."""
    board, rod = led.names
    head: Cylinders = [(led.head[0], led.head[1], upper.head_diameter)]
    parts: Cylinders = [(*ends, upper.rod_diameter) for ends in pairwise(led.rod)]
    for name, cylinders in ((board, head), (rod, parts)):
        if name not in drawn:
            yield f"{name} is not drawn"
            return
        out = _outside(drawn[name][0], cylinders)
        if out > SAME_MM + upper.rod_diameter / 2 * (name == rod):  # of the elbow
            yield f"{name} is drawn {out:.2g} mm out of its recorded cylinders"
    if abs(_from_axis(drawn[board][0], *led.head)[0].min()) > SAME_MM:
        yield f"{board} does not shine where it is recorded"
    if np.linalg.norm(drawn[rod][0] - led.rod[2], axis=1).min() > upper.rod_diameter:
        yield f"{rod} is drawn shorter than it is recorded"
    if np.linalg.norm(led.direction + led.position / np.linalg.norm(led.position)) > 1e-6:
        yield f"{board} does not face the object's middle"
    if np.linalg.norm(led.position - led.head[0]) > 1e-6:
        yield f"{board} is not at the end of its head"


def _outside(points: Floats, cylinders: Cylinders) -> float:
    """Greatest distance of points (N, 3) from the nearest of cylinders by ends and diameter, mm."""
    beyond = []
    for start, end, diameter in cylinders:
        along, across = _from_axis(points, start, end)
        length = float(np.linalg.norm(end - start))
        beyond.append(np.max([-along, along - length, across - diameter / 2], axis=0))
    return float(np.min(beyond, axis=0).max())


def _from_axis(points: Floats, start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Of points (N, 3): place along an axis from its start, and distance from it, mm."""
    way = (end - start) / np.linalg.norm(end - start)
    offset = points - start
    along = offset @ way
    return along, np.linalg.norm(offset - along[:, None] * way, axis=1)


def _ratio(context: PrototypeContext, lamps: Lamps, bodies: AssembledBodies) -> float:
    """Brightest over darkest surface, in the middle and on the object, at the worst stop."""
    own = {lamp.name for lamp in lamps.places}
    for led in lamps.upper.leds if lamps.upper else []:
        own.add(led.names[0])
    in_the_way = bodies.without(stage_bodies(context) | own)  # the stage is part of the scene
    normals, worst = _seen_normals(context), 0.0
    for size in (0.0, OBJECT_OF_TARGET * context.radius):
        points = size * normals
        for angle in some_angles(context).tolist():
            light = irradiance(lamps, points, normals, in_the_way, angle)
            worst = max(worst, float(light.max() / max(light.min(), 1e-3)))
    return worst


def _seen_normals(context: PrototypeContext) -> Floats:
    """(n, 3) unit normals of surfaces that a virtual camera sees at 60 degrees or less."""
    mirrors = context.export.mirrors
    towards = unit(mirrors.columns("px", 3)).T
    normals = []
    for tilt in np.linspace(-np.pi / 2, np.pi / 2, TILTS):
        for way in np.linspace(0, 2 * np.pi, AROUND, endpoint=False):
            level = np.cos(tilt) * np.array([np.cos(way), np.sin(way)])
            normals.append([*level, np.sin(tilt)])
    every = np.array(normals)
    seen = (every @ towards.T).max(axis=1) >= np.cos(np.radians(SEEN_DEG))
    return np.asarray(every[seen])


def _rays(measured: MeasuredPrototype, upper: UpperLamps) -> tuple[float, float]:
    """Shares of the pixels' rays that boards and rods stop, and that end on an LED's light, %."""
    pixel = pixel_rays(measured)
    paths, stopped = ray_paths(measured, pixel), stopped_above(measured, pixel)
    met = [_meets_face(led, upper, paths.point, paths.after) for led in upper.leds]
    dazzled = np.any(met, axis=0)
    weight = pixel.weight / pixel.weight.sum()
    return 100 * float(weight @ stopped), 100 * float(weight @ (dazzled & ~stopped))


def _meets_face(led: UpperLed, upper: UpperLamps, point: Floats, along: Floats) -> Bools:
    """Which rays (N, 3) meet the front of what shines."""
    toward = -(along @ led.direction)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = ((led.position - point) @ led.direction) / -toward
        beside = norm((point + reach[:, None] * along - led.position).T)
    return np.asarray((toward > 0) & (reach > 0) & (beside <= LEDS[upper.part][2] / 2))
