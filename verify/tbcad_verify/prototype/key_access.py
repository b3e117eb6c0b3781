"""Every screw can be reached by its key in the step of assembly that mounts it.

A key's long arm is a straight cylinder along the screw's axis, as wide as the key's corners. Or
its short arm is in the screw, and the long one, square to it, has 60 degrees to turn in. One of
both must be free of all bodies that are mounted by then and joined to the screw's own by screws,
of what no screw holds, and of what the same step mounts. Screws of one step may be in its way
where an order lets each be reached. Bodies that turn with the base are met at every base angle
that the base is driven to, once base and frame are together: one free angle is enough, since the
base is turned by hand then. Order and places are the record's, shapes those of the assembly's GLB.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import Any

import numpy as np

from tbcad_verify.prototype.assembly import Shape, closed_solid
from tbcad_verify.prototype.bodies import turning
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import RECORD, PlacedFastener
from tbcad_verify.report.checks import Check, CheckName, no_faults, short_list
from tbcad_verify.types import Floats

FILE = RECORD
CHECKS = {"key access": "screws"}
# Width across flats by nominal thread: of heads (ISO 4762; 1/4-20 UNC has 3/16 in, and the next ISO
# key is taken) and of set screws (ISO 4026).
HEAD_KEYS_MM = {2.0: 1.5, 3.0: 2.5, 4.0: 3.0, 5.0: 4.0, 6.0: 5.0, 6.35: 5.0}
SET_KEYS_MM = {3.0: 1.5, 4.0: 2.0, 5.0: 2.5, 6.0: 3.0}
# Largest width across corners, and lengths of both arms, by width across flats (ISO 2936).
KEYS_MM = {1.5: (1.68, 46.5, 15.5), 2.0: (2.25, 52.0, 18.0), 2.5: (2.82, 58.5, 20.5)}
KEYS_MM |= {3.0: (3.39, 66.0, 23.0), 4.0: (4.53, 74.0, 29.0), 5.0: (5.67, 85.0, 33.0)}
# Where a turn by one side of the hexagon may begin, and the places of the long arm during it.
FIRST_DEG, TURN_DEG = tuple(range(0, 360, 15)), (0, 15, 30, 45, 60)
SCREW = re.compile(r"(?P<set>SET-)?(?:M|UNC(?P<inch>1/4-20))(?P<thread>\d+(?:\.\d+)?)?x[\d.]+")
INCH_THREAD_MM = 6.35
SEGMENTS = 24
OFF_HEAD_MM = 0.05
# Bodies overlap by the error of facets where they touch.
TOUCH_MM3 = 1.0
ANGLE_STEP_DEG = 5.0
# What is in its place once base and frame are together: of a base on a shaft, on a motor's shaft
# (which is screwed on before), and on a rotary stage.
SHAFT, COUPLING, MOTOR, DISC = "shaft", "coupling", "motor", "zero_disc"
FRAME = "plate"


@dataclass(frozen=True)
class Key:
    """A key on a screw."""

    start: Floats  # (3,) middle of the screw's outer face, mm
    out: Floats  # (3,) unit, from it along the key
    radius: float  # of the key's corners, mm
    length: float  # of its long arm, mm
    short: float  # length of its short arm, mm

    @property
    def solid(self) -> Any:
        """Its long arm in the screw, as a manifold3d solid."""
        return _rod(self.start + OFF_HEAD_MM * self.out, self.out, self.radius, self.length)

    def ways(self) -> Iterator[Any]:
        """Room of the key in the screw: by its long arm, then by the short one, turned."""
        import manifold3d

        yield self.solid
        bend = self.start + (self.short - self.radius) * self.out
        short = _rod(self.start + OFF_HEAD_MM * self.out, self.out, self.radius, self.short)
        across = np.linalg.svd(self.out[None])[2][1:]
        for first in FIRST_DEG:
            turns = np.radians(np.add(first, TURN_DEG))
            directions = np.column_stack([np.cos(turns), np.sin(turns)]) @ across
            arms = [_rod(bend, one, self.radius, self.length) for one in directions]
            yield manifold3d.Manifold.batch_boolean([short, *arms], manifold3d.OpType.Add)


def _rod(start: Floats, along: Floats, radius: float, length: float) -> Any:
    """A cylinder round a circle's polygon, from a point (3,) along a unit vector (3,), mm."""
    import manifold3d

    axes = np.linalg.svd(along[None])[2]  # the first row is parallel, the others are across
    across = axes[1:] if np.linalg.det([*axes[1:], along]) > 0 else axes[:0:-1]
    outer = radius / np.cos(np.pi / SEGMENTS)
    rod = manifold3d.Manifold.cylinder(length, outer, outer, SEGMENTS)
    return rod.transform(np.column_stack([*across, along, start]))


def key_of(one: PlacedFastener) -> Key | None:
    """The key on a screw; None on what no key turns."""
    match = SCREW.fullmatch(one.part)
    if not match:
        return None
    thread = INCH_THREAD_MM if match["inch"] else float(match["thread"])
    flats = (SET_KEYS_MM if match["set"] else HEAD_KEYS_MM)[thread]
    corners, length, short = KEYS_MM[flats]
    out = -np.asarray(one.along)
    height = 0.0 if match["set"] else thread  # of a head by ISO 4762
    return Key(np.asarray(one.position) + height * out, out, corners / 2, length, short)


def checks(
    names: list[CheckName], context: PrototypeContext, drawn: Mapping[str, Shape]
) -> list[Check]:
    """Screws that no key reaches, or that are mounted before what they hold."""
    steps = enumerate(context.prototype.assembly_steps)
    step_of = {name: number for number, step in steps for name in step.mounts}
    faults = [*_order_faults(context, step_of), *_unreached(context, drawn, step_of)]
    return [no_faults(names[0], faults)]


def _order_faults(context: PrototypeContext, steps: Mapping[str, int]) -> Iterator[str]:
    for one in context.prototype.fasteners:
        if one.name not in steps:
            yield f"{one.name} is in no step"
            continue
        later = [name for name in one.through if steps.get(name, -1) > steps[one.name]]
        if later:
            yield f"{one.name} is mounted before {short_list(later)}"


def _unreached(
    context: PrototypeContext, drawn: Mapping[str, Shape], steps: Mapping[str, int]
) -> Iterator[str]:
    swung = turning(context, drawn)
    solids = {name: closed_solid(name, drawn) for name in drawn if name in steps}
    placed = [one for one in context.prototype.fasteners if one.name in steps]
    keys = {one.name: key for one in placed if (key := key_of(one))}
    after: dict[str, list[str]] = {}
    for one in placed:
        if one.name not in keys:
            continue
        key, step = keys[one.name], steps[one.name]
        beside = [name for name in keys if steps[name] == step and name != one.name]
        after[one.name] = list(_met(key.solid, solids, beside))
        there = _there(context, one, steps, swung)
        before = [name for name in solids if name in there.difference(beside)]
        along = [name for name in before if (name in swung) == one.turns]
        across = [name for name in before if (name in swung) != one.turns]
        if met := _in_the_way(context, one, key, solids, (along, across)):
            yield f"{one.name} behind {met}"
    yield from without_order(after)


def _there(
    context: PrototypeContext, one: PlacedFastener, steps: Mapping[str, int], swung: set[str]
) -> set[str]:
    """Names of what is round a screw when it is put in, but for the screw."""
    step = steps[one.name]
    mounted = {name for name in steps if steps[name] <= step}
    joints = [
        {other.name, *other.through}
        for other in context.prototype.fasteners
        if other.name in mounted
    ]
    if step >= _together(steps):
        joints.append({FRAME} | swung)
    group = {one.name}
    while more := [joint for joint in joints if joint & group and joint - group]:
        group = group.union(*more)
    alone = mounted.difference(*joints)
    same = {name for name in mounted if steps[name] == step}
    return (mounted & (group | alone | same)) - {one.name}


def _together(steps: Mapping[str, int]) -> int:
    """The step from which on base and frame are together."""
    if SHAFT in steps:
        return steps[SHAFT]
    if COUPLING in steps:
        return steps.get(MOTOR, 0) + 1
    return steps.get(DISC, 0)


def without_order(after: Mapping[str, list[str]]) -> Iterator[str]:
    """Screws of one step that are in the way of each other's keys, whichever comes first."""
    try:
        TopologicalSorter(after).prepare()
    except CycleError as error:
        yield f"{short_list(error.args[1][1:])} behind each other"


def _in_the_way(
    context: PrototypeContext,
    one: PlacedFastener,
    key: Key,
    solids: Mapping[str, Any],
    names: tuple[list[str], list[str]],
) -> str:
    """A body in the way of the first way to hold a key; empty when there is a free way.

    Names are of bodies on the screw's own side of the base's bearing, and on the other.
    """
    first, (along, across) = "", names
    for way in key.ways():
        met = next(_met(way, solids, along), "")
        met = met or _met_at_all_angles(context, one, way, solids, across)
        if not met:
            return ""
        first = first or met
    return first


def _met_at_all_angles(
    context: PrototypeContext,
    one: PlacedFastener,
    way: Any,
    solids: Mapping[str, Any],
    names: list[str],
) -> str:
    """A body on the other side of the base's bearing that is in the way at every base angle."""
    low, high = context.prototype.swing
    angles = np.radians([0.0, *np.arange(low, high, ANGLE_STEP_DEG)])
    met = ""
    # Seen from the bodies that turn, the key of a screw that does not turns back.
    for turned in context.base_rotation(angles if one.turns else -angles).as_matrix():
        solid = way.transform(np.column_stack([turned, np.zeros(3)]))
        met = next(_met(solid, solids, names), "")
        if not met:
            return ""
    return f"{met} at every base angle"


def _met(key: Any, solids: Mapping[str, Any], names: list[str]) -> Iterator[str]:
    """Bodies that share room with a key."""
    own = key.bounding_box()
    for name in names:
        box = solids[name].bounding_box()
        apart = any(box[k] > own[k + 3] or box[k + 3] < own[k] for k in range(3))
        if not apart and (key ^ solids[name]).volume() > TOUCH_MM3:
            yield name
