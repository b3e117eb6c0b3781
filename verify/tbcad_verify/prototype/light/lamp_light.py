"""The lamps' light on the object: integrated over their faces, the base in the way at its stops.

Each face is Lambertian and is cut into tiles. The object's room is sampled by points on its wall
and axis, each with surfaces that face all ways. Compared is what falls on a surface of the object
before and after the half turn about z, at all of some stops. What is inside the capture sphere (the
stage) is part of the scene and throws its own shadow.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype.bodies import AssembledBodies, Bodies, some_angles, stage_bodies
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype_sections import Lamps
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    informative,
    short_list,
)
from tbcad_verify.step.solids_text import TextSolid
from tbcad_verify.types import Bools, Floats

# Of each strip: width, length that is cut off, lumen of a mm.
STRIPS = {"STRIP-COB-24V": (8.0, 50.0, 0.9), "STRIP-240-24V": (10.0, 25.0, 1.8)}
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
IMAGES = np.array([[1.0, 1, 1], [1, -1, 1], [-1, 1, 1], [-1, -1, 1]])
IMAGES_BY_COUNT = {2: np.stack([np.ones(3), HALF_TURN]), 4: IMAGES}
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
    assembly: AssembledBodies,
    solids: Mapping[str, TextSolid],
) -> list[Check]:
    """The lamps are as listed and drawn, and light the object alike before and after its turn."""
    listed, same, shadow, light, above = names
    lamps = context.prototype.lamps
    if lamps is None:
        asked = context.export.spec.prototype.light.lamp_z_mm != 0
        missing = at_most(listed, float(asked), 0, "the spec has lamps, the record has none")
        return [missing, *(informative(name, 0, "there are no lamps") for name in names[1:])]
    if lamps.strip not in STRIPS:
        raise Unknown(f"{lamps.strip} is no strip that is known")
    faults = [*_faults(context, lamps, solids)]
    own = {lamp.name for lamp in lamps.places}
    bodies = assembly.without(stage_bodies(context) | own)
    points, normals = _surfaces(context)
    fields = np.stack([*_fields(context, lamps, bodies, points, normals)])
    greatest, least = fields.max(axis=0), fields.min(axis=0)
    lit = greatest > LEAST_SHARE * greatest.max()
    change = 100 * float(((greatest - least)[lit] / greatest[lit]).max())
    tilt = np.degrees(np.arcsin(normals[:, 2]))
    upright, upward = (float(fields[:, np.abs(tilt - of) < 1].mean()) for of in (0.0, UPWARD_DEG))
    return [
        at_most(listed, len(faults), 0, short_list(faults)),
        at_most(same, change, CHANGE, "the object is lit otherwise after its half turn"),
        _shadow_check(
            shadow,
            context,
            _shadowed(context, lamps, assembly.without(own), points, normals),
        ),
        informative(light, upright, "on upright surfaces in the object's room, on average"),
        informative(
            above, 100 * upward / upright, f"on surfaces that face {UPWARD_DEG:g} deg upward"
        ),
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
    before, after = (
        np.stack(
            [
                irradiance(lamps, points * turn, normals * turn, edges, angle)
                for edges in (EdgedBodies(bodies, grazing) for grazing in (True, False))
            ]
        )
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
        sides = (across, -across, upward, -upward)
        rays = np.stack(
            [
                self.bodies.blocked(starts + FACET_MM * to, ends + FACET_MM * to, angle)
                for to in sides
            ]
        )
        return np.asarray(rays.any(axis=0) if self.grazing else rays.all(axis=0))


def _faults(
    context: PrototypeContext, lamps: Lamps, solids: Mapping[str, TextSolid]
) -> Iterator[str]:
    """What is wrong with the lamps' figures, places and bodies."""
    spec = context.export.spec.prototype.light
    if lamps.strips != spec.strips:
        yield f"{lamps.strips} strips on each, the spec has {spec.strips}"
    strip_mm, cut_mm, _ = STRIPS[lamps.strip]
    sides = spec.segments * cut_mm, spec.strips * strip_mm
    if np.abs(np.subtract((lamps.length, lamps.width), sides)).max() > PLACE_MM:
        yield f"a lamp is {lamps.length:g} x {lamps.width:g} mm, not {sides[0]:g} x {sides[1]:g}"
    places = np.array([lamp.position for lamp in lamps.places])
    images = IMAGES_BY_COUNT.get(len(places), IMAGES)
    if places.shape != images.shape or np.abs(places - places[0] * images).max() > PLACE_MM:
        yield "the lamps are no images of one another"
    if abs(places[0, 2] - float(spec.lamp_z_mm)) > PLACE_MM:
        yield f"the lamps are at z = {places[0, 2]:g}, the spec has {spec.lamp_z_mm:g}"
    for lamp in lamps.places:
        solid = solids.get(lamp.name)
        if solid is None or not _is_body(solid, lamp.position, lamp.direction, _sides(lamps)):
            yield f"{lamp.name} is drawn elsewhere"


def _sides(lamps: Lamps) -> tuple[float, float]:
    """Of a shining face, along y and along z, mm."""
    return (lamps.length, lamps.width) if lamps.level else (lamps.width, lamps.length)


def _is_body(
    solid: TextSolid, position: Floats, direction: Floats, sides_mm: tuple[float, float]
) -> bool:
    """Whether a box has its shining face where the record has it, across x."""
    low, high = solid.corners.min(axis=0), solid.corners.max(axis=0)
    face = high[0] if direction[0] > 0 else low[0]
    middle = np.array([face, *(low + high)[1:] / 2])
    sides = np.abs((high - low)[1:] - sides_mm).max()
    facing = abs(abs(direction[0]) - 1) + np.abs(direction[1:]).max()
    toward = direction[0] * position[0] < 0
    return bool(np.abs(middle - position).max() < PLACE_MM and sides < PLACE_MM) and bool(
        facing < PLACE_MM and toward
    )


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


def _fields(
    context: PrototypeContext, lamps: Lamps, bodies: Bodies, points: Floats, normals: Floats
) -> Iterator[Floats]:
    """Irradiance (n,) of the object's surfaces before and after the turn, stop by stop, lx."""
    for angle in some_angles(context).tolist():
        for turn in (np.ones(3), HALF_TURN):
            yield irradiance(lamps, points * turn, normals * turn, bodies, angle)


def irradiance(
    lamps: Lamps, points: Floats, normals: Floats, bodies: Bodies | EdgedBodies, angle: float
) -> Floats:
    """Irradiance (n,) of surfaces at points (n, 3) with normals (n, 3) at a base angle (rad), lx.

    A tile of luminous exitance M and area A gives M A / pi cos cos' / r^2.
    """
    places, index = np.unique(points, axis=0, return_inverse=True)
    index = index.reshape(-1)
    total = np.zeros(len(points))
    wide, _, lumen = STRIPS[lamps.strip]
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
    return total


def _tiles(lamps: Lamps, position: Floats, direction: Floats) -> Iterator[Floats]:
    """Middles (3,) of a face's tiles."""
    up, (wide, high) = np.array([0.0, 0.0, 1.0]), _sides(lamps)
    across = np.cross(up, direction)
    for i in range(TILES[0]):
        for j in range(TILES[1]):
            x, z = ((i + 0.5) / TILES[0] - 0.5) * wide, ((j + 0.5) / TILES[1] - 0.5) * high
            yield position + x * across + z * up
