"""The lamps' light on the object, the base in the way at its stops.

Each face is Lambertian and is cut into tiles. The object's room is sampled by points on its wall
and axis, each with surfaces that face all ways. Compared is what falls on a surface of the object
before and after the half turn about z, at all of some stops. What is inside the capture sphere (the
stage) is part of the scene and throws its own shadow.

A lamp below the horizon is seen by the mirrors opposite, past the object, where no object hides it.
Lamps that light the object alike before and after its half turn cannot be anywhere else.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype.bodies import AssembledBodies, Bodies, some_angles, stage_bodies
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import GLB, Lamps
from tbcad_verify.report.checks import Check, CheckName, Unknown, at_most, informative, no_faults
from tbcad_verify.step.solids_text import TextSolid
from tbcad_verify.types import Bools, Floats

# Of each strip: width, mm, and lumen of a mm.
STRIPS = {"STRIP-COB-24V": (8.0, 0.9), "STRIP-240-24V": (10.0, 1.8)}
TILES = (2, 5)  # across and along a face
SIDES, LEVELS, FACINGS = 8, 3, 12  # points round the room, their heights, surfaces round each
TILTS_DEG = (-60.0, -30.0, 0.0, 30.0, 60.0)  # of the surfaces, upward
UPWARD_DEG = 30.0
LEAST_SHARE = 0.1  # of the greatest irradiance: what is less lit is dark
CHANGE = 5.0  # %
PLACE_MM = 1e-6
FACET_MM = 0.1  # by which facets of the assembly may be off the faces that they stand for
PAIR_MM = 1e-3  # between an LED and the image of another
HALF_TURN = np.array([-1.0, -1.0, 1.0])
FILE = GLB
CHECKS = {
    "lamps": "faults",
    "light before and after": "%",
    "light in the stage's shadow": "% of the surfaces",
    "light of the lamps": "lx",
    "light from above": "% of upright surfaces'",
}


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    bodies: AssembledBodies,
    solids: Mapping[str, TextSolid],
) -> list[Check]:
    """The lamps are as drawn, and light the object alike before and after its turn."""
    listed, same, shadow, light, above = names
    lamps = context.prototype.lamps
    if lamps is None:
        asked = context.export.spec.prototype.light.lamp_z_mm != 0
        missing = at_most(listed, float(asked), 0, "the spec has lamps, the record has none")
        return [missing, *(informative(name, 0, "there are no lamps") for name in names[1:])]
    if lamps.strip not in STRIPS:
        raise Unknown(f"{lamps.strip} is no strip that is known")
    own = {lamp.name for lamp in lamps.places}
    own |= {name for led in (lamps.upper.leds if lamps.upper else []) for name in led.names[:1]}
    in_the_way = bodies.without(stage_bodies(context) | own)
    points, normals = _surfaces(context)
    fields = np.stack(
        [
            irradiance(lamps, points * turn, normals * turn, in_the_way, angle)
            for angle in some_angles(context).tolist()
            for turn in (np.ones(3), HALF_TURN)
        ]
    )
    greatest, least = fields.max(axis=0), fields.min(axis=0)
    lit = greatest > LEAST_SHARE * greatest.max()
    change = 100 * float(((greatest - least)[lit] / greatest[lit]).max())
    tilt = np.degrees(np.arcsin(normals[:, 2]))
    upright, upward = (float(fields[:, np.abs(tilt - of) < 1].mean()) for of in (0.0, UPWARD_DEG))
    shadowed = _shadowed(context, lamps, bodies.without(own), points, normals)
    facing = f"on surfaces that face {UPWARD_DEG:g} deg upward"
    return [
        no_faults(listed, _faults(lamps, solids)),
        at_most(same, change, CHANGE, "the object is lit otherwise after its half turn"),
        _shadow_check(shadow, context, shadowed),
        informative(light, upright, "on upright surfaces in the object's room, on average"),
        informative(above, 100 * upward / upright, facing),
    ]


def _shadow_check(name: CheckName, context: PrototypeContext, share: float) -> Check:
    """None where the LEDs are images of one another by the half turn, as tbcad places them."""
    detail = "lit otherwise after the turn, when crown and LEDs throw their shadows"
    places = np.array([led.position for led in context.prototype.leds]).reshape(-1, 3)
    apart = np.linalg.norm(places[:, None] - places * HALF_TURN, axis=2)
    if apart.size and apart.min(axis=1).max() > PAIR_MM:
        return informative(name, share, detail)
    return at_most(name, share, 0, detail)


def _shadowed(
    context: PrototypeContext, lamps: Lamps, bodies: Bodies, points: Floats, normals: Floats
) -> float:
    """Share of lit surfaces whose light the turn changes by more than the limit, %."""
    angles = some_angles(context)
    angle = float(angles[len(angles) // 2])
    edges = EdgedBodies(bodies, True), EdgedBodies(bodies, False)
    before, after = (
        np.stack([irradiance(lamps, points * turn, normals * turn, one, angle) for one in edges])
        for turn in (np.ones(3), HALF_TURN)
    )
    greatest = np.maximum(before[1], after[1])
    lit = greatest > LEAST_SHARE * greatest.max()
    # What the facets leave open may be either way: a change is what they do not explain.
    change = np.maximum(before[0] - after[1], after[0] - before[1])[lit] / greatest[lit]
    return 100 * float((100 * change > CHANGE).mean())


@dataclass(frozen=True)
class EdgedBodies:
    """Bodies whose facets are as far from their true faces as the assembly's may be.

    A ray that passes an edge within that may be stopped or not: `grazing` says which is taken.
    """

    bodies: Bodies
    grazing: bool

    def blocked(self, starts: Floats, ends: Floats, angle: float) -> Bools:
        """(N,) whether something lies between points (N, 3) at a base angle, rad."""
        along = unit((ends - starts).T).T
        across = unit(np.cross(along, [0.0, 0.0, 1.0]).T).T
        upward = np.cross(across, along)
        rays = [
            self.bodies.blocked(starts + FACET_MM * to, ends + FACET_MM * to, angle)
            for to in (across, -across, upward, -upward)
        ]
        return np.asarray(np.any(rays, axis=0) if self.grazing else np.all(rays, axis=0))


def _faults(lamps: Lamps, solids: Mapping[str, TextSolid]) -> Iterator[str]:
    """Lamps whose boxes do not have their shining face where the record has it, across x."""
    for lamp in lamps.places:
        if lamp.name not in solids:
            yield f"{lamp.name} is not drawn"
            continue
        ends = solids[lamp.name].corners.min(axis=0), solids[lamp.name].corners.max(axis=0)
        middle = np.mean(ends, axis=0)
        middle[0] = ends[int(lamp.direction[0] > 0)][0]
        errors = [*(middle - lamp.position), *(np.subtract(*ends)[1:] + _sides(lamps))]
        errors += [abs(lamp.direction[0]) - 1, *lamp.direction[1:]]
        if np.abs(errors).max() >= PLACE_MM or lamp.direction[0] * lamp.position[0] >= 0:
            yield f"{lamp.name} is drawn elsewhere"


def _sides(lamps: Lamps) -> tuple[float, float]:
    """Of a shining face, along y and along z, mm."""
    return (lamps.length, lamps.width) if lamps.level else (lamps.width, lamps.length)


def _surfaces(context: PrototypeContext) -> tuple[Floats, Floats]:
    """Points (n, 3) on wall and axis of the object's room, and unit normals (n, 3)."""
    stage = context.export.spec.prototype.stage
    radius = float(stage.object_diameter_mm) / 2
    top = np.sqrt(max(context.radius**2 - radius**2, 0.0))
    heights = np.linspace(float(stage.top_mm), top, LEVELS)
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    ring = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    level = np.vstack([ring, np.zeros((1, 2))])
    points = np.array([[*one, z] for z in heights for one in level])
    way = 2 * np.pi * np.arange(FACINGS) / FACINGS
    normals = np.array(
        [
            [np.cos(t) * np.cos(a), np.cos(t) * np.sin(a), np.sin(t)]
            for t in np.radians(TILTS_DEG)
            for a in way
        ]
    )
    return np.repeat(points, len(normals), axis=0), np.tile(normals, (len(points), 1))


def irradiance(
    lamps: Lamps, points: Floats, normals: Floats, bodies: Bodies | EdgedBodies, angle: float
) -> Floats:
    """Irradiance (n,) of surfaces at points (n, 3) with normals (n, 3) at a base angle (rad), lx.

    A tile of luminous exitance M and area A gives M A / pi cos cos' / r^2.
    """
    places, index = np.unique(points, axis=0, return_inverse=True)
    index = index.reshape(-1)
    total = np.zeros(len(points))
    wide, lumen = STRIPS[lamps.strip]
    exitance = lumen / wide
    area = lamps.width * lamps.length / (TILES[0] * TILES[1])
    for lamp in lamps.places:
        for tile in _tiles(lamps, lamp.position, lamp.direction):
            way = tile - places
            distance = np.linalg.norm(way, axis=1)
            way /= distance[:, None]
            leaves = np.maximum(-way @ lamp.direction, 0)
            free = ~bodies.blocked(np.broadcast_to(tile, places.shape), places, angle)
            flux = 1e6 * exitance * area / np.pi * leaves / distance**2 * free
            total += flux[index] * np.maximum((normals * way[index]).sum(axis=1), 0)
    upper = lamps.upper
    for led in upper.leds if upper else []:
        way = led.position - places
        distance = np.linalg.norm(way, axis=1)
        way /= distance[:, None]
        leaves = np.maximum(-way @ led.direction, 0)
        free = ~bodies.blocked(np.broadcast_to(led.position, places.shape), places, angle)
        flux = 1e6 * (upper.candela if upper else 0.0) * leaves / distance**2 * free
        total += flux[index] * np.maximum((normals * way[index]).sum(axis=1), 0)
    return total


def _tiles(lamps: Lamps, position: Floats, direction: Floats) -> Iterator[Floats]:
    """Middles (3,) of a face's tiles."""
    up, (wide, high) = np.array([0.0, 0.0, 1.0]), _sides(lamps)
    across = np.cross(up, direction)
    for i, j in np.ndindex(TILES):
        x, z = ((i + 0.5) / TILES[0] - 0.5) * wide, ((j + 0.5) / TILES[1] - 0.5) * high
        yield position + x * across + z * up
