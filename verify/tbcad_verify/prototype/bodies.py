"""All bodies as rays meet them, and the balls where their pads put them.

Of the base at any angle, and of the others. Shapes of what is bought are those of the assembly's
GLB, whose bodies are compared with the parts' own files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from tbcad_verify.mesh.mesh import Mesh, indexed_mesh, join_meshes
from tbcad_verify.mesh.rays import RayScene, build_scene, distances_to_planes, first_hits
from tbcad_verify.mesh.vectors import unit
from tbcad_verify.prototype.assembly import VIEWS, Shape
from tbcad_verify.prototype.caps import MeasuredCap
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.prototype.seats import MeasuredSeat
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Bools, Floats, Ints

OWN = ("camera", "camera_lens")  # bodies that its own rays start in
SWUNG, STILL = ("base", "cap"), ("stage", "frame")  # roles of parts that turn with the base or not
POST = "stage_post"  # bought, and a part of the stage
LEAST_ANGLES = 7
LIFT_MM = 1e-3


@dataclass(frozen=True)
class BodyScene:
    """Bodies that rays meet."""

    scene: RayScene | None  # all of them; None without any
    owner: Ints  # (F + 1,) number of each facet's body; -1 at the end, for no facet
    names: tuple[str, ...]  # of the bodies

    def first(self, origin: Floats, along: Floats) -> tuple[Ints, Floats]:
        """Number of the body that rays (3, N) meet first, -1 for none, and its distance, mm."""
        distance = np.full(along.shape[1], np.inf)
        if self.scene is None:
            return np.full(distance.size, -1), distance
        facet = first_hits(self.scene, origin, along)
        hit = np.flatnonzero(facet >= 0)
        distance[hit] = distances_to_planes(self.scene, facet[hit], origin[:, hit], along[:, hit])
        return self.owner[facet], distance


def body_scene(meshes: Mapping[str, Mesh]) -> BodyScene:
    """Bodies by name, prepared for rays."""
    if not meshes:
        return BodyScene(None, np.full(1, -1), ())
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes.values()])
    scene = build_scene(join_meshes([*meshes.values()]))
    return BodyScene(scene, np.append(owner, -1), tuple(meshes))


def placed_meshes(parts: list[MeasuredPart]) -> dict[str, Mesh]:
    """Meshes of parts in their places, by name. Unknown: one could not be measured."""
    return {part.part.name: part.placed_mesh for part in parts}


def _meshes(drawn: Mapping[str, Shape], names: Iterable[str]) -> dict[str, Mesh]:
    return {name: indexed_mesh(drawn[name][0], drawn[name][1].astype(np.int32)) for name in names}


@dataclass(frozen=True)
class AssembledBodies:
    """The bodies of an assembly."""

    context: PrototypeContext  # the record
    drawn: Mapping[str, Shape]  # their shapes, by name
    _scenes: dict[frozenset[str], BodyScene] = field(default_factory=dict, init=False, repr=False)

    def without(self, names: Iterable[str]) -> Bodies:
        """All but some that are named."""
        bodies, swung = self.drawn.keys() - VIEWS - set(names), turning(self.context, self.drawn)
        return Bodies(self.context, self._scene(bodies & swung), self._scene(bodies - swung))

    def _scene(self, names: set[str]) -> BodyScene:
        """Some of the bodies, prepared for rays once: most checks trace the same ones."""
        key = frozenset(names)
        if key not in self._scenes:
            self._scenes[key] = body_scene(_meshes(self.drawn, sorted(names)))
        return self._scenes[key]


def turning(context: PrototypeContext, names: Iterable[str]) -> set[str]:
    """Names of the bodies that turn with the base."""
    record = context.prototype
    swung = {part.name for part in record.parts if part.role in SWUNG}
    swung |= {one.name for one in record.bought if one.turns}
    swung |= {one.name for one in record.fasteners if one.turns}
    return swung | {name for name in names if name.startswith("ball_")}


@dataclass(frozen=True)
class Bodies:
    """Bodies that turn with the base, and bodies that do not."""

    context: PrototypeContext  # the record
    turning: BodyScene
    still: BodyScene

    def count_first(self, origin: Floats, along: Floats, angle: float) -> dict[str, int]:
        """How many rays (N, 3) meet each body first at a base angle, rad; empty for nothing."""
        back = self._back(angle)
        one, near = self.turning.first((origin @ back).T, (along @ back).T)
        two, far = self.still.first(origin.T, along.T)
        other = np.where(two < 0, -1, two + len(self.turning.names))
        names = ("", *self.turning.names, *self.still.names)
        counts = np.bincount(np.where(near < far, one, other) + 1, minlength=len(names))
        return {name: count for name, count in zip(names, counts.tolist(), strict=True) if count}

    def blocked(self, starts: Floats, ends: Floats, angle: float) -> Bools:
        """(N,) whether something lies between points (N, 3) at a base angle, rad."""
        along, back = unit((ends - starts).T).T, self._back(angle)
        length = np.linalg.norm(ends - starts, axis=1)
        near = self.turning.first((starts @ back).T, (along @ back).T)[1]
        far = self.still.first((starts + LIFT_MM * along).T, along.T)[1]
        return np.asarray(np.minimum(near, far) < length - LIFT_MM)

    def _back(self, angle: float) -> Floats:
        """(3, 3) that rows are multiplied by, from the ground to the base."""
        return np.asarray(self.context.base_rotation(np.array([-angle])).as_matrix()[0].T)


def stage_bodies(context: PrototypeContext) -> frozenset[str]:
    """Names of the stage's parts and of the fasteners in them."""
    parts = {part.name for part in context.prototype.parts if part.role == "stage"} | {POST}
    some = context.prototype.fasteners
    return frozenset(parts | {one.name for one in some if one.through[0] in parts})


def upper_bodies(context: PrototypeContext) -> frozenset[str]:
    """Names of boards and rods of the LEDs above the object."""
    lamps = context.prototype.lamps
    leds = lamps.upper.leds if lamps and lamps.upper else []
    return frozenset(name for led in leds for name in led.names)


def some_angles(context: PrototypeContext) -> Floats:
    """(s,) base angles of some of the stops, evenly, the outermost included, rad."""
    angles = np.unique(context.angle)
    which = np.linspace(0, len(angles) - 1, min(LEAST_ANGLES, len(angles))).round()
    return np.asarray(angles[which.astype(np.int64)])


@dataclass(frozen=True)
class MeasuredPrototype:
    """The prototype as its files define it, seen from its base at angle zero, without weight."""

    context: PrototypeContext  # the record
    centre: Floats  # (3, K) of the reflecting spheres, mm
    radius: Floats  # (K,) of them, mm
    # (3, K) centres of the spheres that lie on the pads, and as weight has them on the mean over
    # their pictures by the record, mm
    seated: Floats
    body: Floats
    body_radius: Floats  # (K,) mm
    rotating: BodyScene  # base, caps, and what is fastened to them
    fixed: BodyScene  # all else
    # boards and rods of LEDs above the object, which are in the light and may hide some of it
    above: BodyScene = field(default_factory=lambda: body_scene({}))


def measure_prototype(
    context: PrototypeContext,
    seats: list[MeasuredSeat],
    caps: list[MeasuredCap],
    parts: list[MeasuredPart],
    drawn: Mapping[str, Shape],
) -> MeasuredPrototype:
    """Put balls on their pads, and caps as they were measured; what is bought is as drawn.

    Unknown: a centre, a cap or a mesh is not known.
    """
    balls = context.prototype.balls
    if missing := [seat.reason for seat in seats if seat.reason]:
        raise Unknown(missing[0])
    seated, radius = np.array([seat.centre for seat in seats]).T.copy(), balls.radius_mm.copy()
    centre, body_radius = seated.copy(), balls.body_radius_mm.copy()
    without = {*np.flatnonzero(balls.cap).tolist()} - {cap.ball for cap in caps}
    if without:
        raise Unknown(f"no part is the cap of ball {min(without) + 1}")
    for cap in caps:
        # The cap's body lies on the pads, wherever the cap's own file has it.
        centre[:, cap.ball] += cap.front.centre - cap.body.centre
        radius[cap.ball], body_radius[cap.ball] = cap.front.radius, cap.body.radius
    bought = drawn.keys() - {*VIEWS, *OWN, *(part.part.name for part in parts)}
    bought = {name for name in bought if not name.startswith("ball_")}
    swung, above = turning(context, ()), upper_bodies(context)
    still = placed_meshes(of_roles(parts, *STILL)) | _meshes(drawn, sorted(bought - swung))
    turned = placed_meshes(of_roles(parts, *SWUNG)) | _meshes(drawn, sorted(bought & swung))
    return MeasuredPrototype(
        context,
        centre,
        radius,
        seated,
        seated + balls.sag,
        body_radius,
        body_scene(turned),
        body_scene({name: mesh for name, mesh in still.items() if name not in above}),
        body_scene({name: mesh for name, mesh in still.items() if name in above}),
    )


def rigid_motions(arm: Floats) -> Floats:
    """(3 N, 6) what a shift and a turn about the origin do at (N, 3)."""
    turns = np.cross(np.eye(3), arm[:, None]).transpose(0, 2, 1)
    shifts = np.broadcast_to(np.eye(3), turns.shape)
    return np.concatenate([shifts, turns], axis=2).reshape(-1, 6)
