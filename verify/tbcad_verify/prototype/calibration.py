"""What the LEDs tell of the balls: who sees them past the object, and how well that fixes centres.

The highlight of an LED in a sphere is where the way LED - sphere - pinhole is shortest (Fermat).
"""

from __future__ import annotations

import math

import numpy as np

from tbcad_verify.mesh.rays import build_scene, distances_to_planes, first_hits
from tbcad_verify.mesh.vectors import dot, norm, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, joined_meshes
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    at_least,
    at_most,
    informative,
    short_list,
    worst_offenders,
)
from tbcad_verify.types import Bools, Floats

CHECKS = {"object room": "mm^3", "leds seen": "LEDs", "calibration": "wrong figures"}
NEEDED = 2  # LEDs, for the three coordinates of a centre
ROOM_MM3 = 0.1  # of parts in the room: facets of the arms' rounding
LIFT_MM = 0.01  # of the room above the disc
ROOM_SIDES = 180
SHARE = 2e-3  # by which a figure may be off: derivatives by finite steps
STEP_MM = 1e-2
HALVINGS = 50


def checks(
    names: list[CheckName], context: PrototypeContext, fixed: list[MeasuredPart]
) -> list[Check]:
    """The room of the object is free, every mirror sees LEDs past it, and the estimate is right.

    Args:
        names: of the checks.
        context: the export.
        fixed: parts of stage and frame.
    """
    room, seen, estimate = names
    volume, inside = _volume_in_room(context, fixed)
    free = at_most(room, volume, ROOM_MM3, f"in the object's room: {short_list(inside)}")
    if not context.prototype.leds:
        return [free, informative(seen, 0, "no LEDs"), informative(estimate, 0, "no LEDs")]
    past_object = ~_hidden_by_room(context)
    counted = (past_object & ~_hidden_by_parts(context, fixed)).sum(axis=0)
    few = worst_offenders(
        tuple(context.mirror_ids), counted.astype(np.float64), "", counted < NEEDED, ".0f"
    )
    wrong = _wrong_figures(context, past_object)
    return [
        free,
        at_least(seen, int(counted.min()), NEEDED, f"seen past an object in its room: {few}"),
        at_most(estimate, len(wrong), 0, short_list(wrong)),
    ]


def _room(context: PrototypeContext) -> tuple[float, float, float]:
    """Radius, lower and upper end of the upright cylinder that the object may fill, mm."""
    stage = context.export.spec.prototype.stage
    radius = stage.object_diameter_mm / 2
    high = math.sqrt(max(context.radius**2 - radius**2, 0.0))
    return radius, stage.top_mm, high


def _volume_in_room(
    context: PrototypeContext, fixed: list[MeasuredPart]
) -> tuple[float, list[str]]:
    """Volume of parts in the room, mm^3, and which parts and LEDs are in it."""
    import manifold3d

    radius, low, high = _room(context)
    height = max(high - low - LIFT_MM, LIFT_MM)
    room = manifold3d.Manifold.cylinder(height, radius, radius, ROOM_SIDES)
    room = room.translate([0.0, 0.0, low + LIFT_MM])
    volumes = {
        part.part.name: (part.solid ^ room).volume() for part in fixed if _near(part, radius, low)
    }
    leds = [led.name for led in context.prototype.leds if np.hypot(*led.position[:2]) < radius]
    names = [name for name, volume in volumes.items() if volume > ROOM_MM3 / max(len(volumes), 1)]
    return float(sum(volumes.values())) + len(leds), names + leds


def _near(part: MeasuredPart, radius: float, low: float) -> bool:
    """Whether a part's box meets the room's."""
    points = part.placed_mesh.points
    least, most = points.min(axis=0), points.max(axis=0)
    return bool((least[:2] < radius).all() and (most[:2] > -radius).all() and most[2] > low)


def _sights(context: PrototypeContext) -> tuple[Floats, Floats]:
    """(l, 3) LEDs, and (l, 3, m) ways from them to the virtual cameras, mm."""
    mirrors = context.export.mirrors.take(context.mirror_rows)
    semi_major = math.hypot(
        context.export.semi_minor_mm, float(np.linalg.norm(context.pinhole)) / 2
    )
    cameras = 2 * semi_major * mirrors.columns("ux", 3)
    leds = np.stack([led.position for led in context.prototype.leds])
    return leds, cameras[None] - leds[:, :, None]


def _hidden_by_room(context: PrototypeContext) -> Bools:
    """(l, m) whether the way passes through the room, by the part of it within its height."""
    radius, low, high = _room(context)
    leds, sight = _sights(context)
    rise = np.where(np.abs(sight[:, 2]) < 1e-12, 1e-12, sight[:, 2])
    ends = np.stack([(level - leds[:, 2, None]) / rise for level in (low, high)])
    first, last = np.clip(np.sort(ends, axis=0), 0.0, 1.0)
    flat, across = sight[:, :2], leds[:, :2, None]
    nearest = -(flat * across).sum(axis=1) / np.maximum((flat**2).sum(axis=1), 1e-12)
    share = np.clip(nearest, first, last)
    distance = np.hypot(*np.moveaxis(across + share[:, None] * flat, 1, 0))
    return np.asarray((distance < radius) & (first < last))


def _hidden_by_parts(context: PrototypeContext, fixed: list[MeasuredPart]) -> Bools:
    """(l, m) whether a facet of a part is on the way to the mirror; beyond it is no light."""
    mesh, _ = joined_meshes(fixed)
    apex = context.export.mirrors.take(context.mirror_rows).columns("px", 3)
    scene, (leds, sight) = build_scene(mesh), _sights(context)
    hidden = np.zeros((len(leds), sight.shape[2]), dtype=np.bool_)
    for k, place in enumerate(leds):
        start, d = np.repeat(place[:, None], sight.shape[2], axis=1), unit(sight[k])
        facet = first_hits(scene, start, d)
        hit = np.flatnonzero(facet >= 0)
        reach = distances_to_planes(scene, facet[hit], start[:, hit], d[:, hit])
        hidden[k, hit] = reach < norm(apex[:, hit] - place[:, None])
    return hidden


def _wrong_figures(context: PrototypeContext, seen: Bools) -> list[str]:
    record = context.prototype.calibration
    if record is None:
        return ["calibration is missing"]
    expected = _estimate(context, seen, record.noise_px)
    return [
        f"{name} {getattr(record, name):.5g}, not {value:.5g}"
        for name, value in expected.items()
        if not abs(getattr(record, name) - value) <= SHARE * abs(value)
    ]


def _estimate(context: PrototypeContext, seen: Bools, noise: float) -> dict[str, float]:
    """Standard deviations of centres with known radii, from one photograph of each LED, um."""
    mirrors = context.export.mirrors.take(context.mirror_rows)
    use = np.flatnonzero(~mirrors.flat & (seen.sum(axis=0) >= NEEDED))
    centre, radius = mirrors.columns("cx", 3)[:, use], mirrors.radius_mm[use]
    information = np.zeros((use.size, 3, 3))
    for led, sees in zip(context.prototype.leds, seen[:, use], strict=True):
        moved = np.stack(
            [_derivative(context, centre, radius, led.position, axis) for axis in np.eye(3)]
        )
        information += sees[:, None, None] * np.einsum("aim,bim->mab", moved, moved)
    covariance = noise**2 * np.linalg.inv(information)
    sight = unit(centre - context.pinhole[:, None])
    along = np.einsum("am,mab,bm->m", sight, covariance, sight)
    across = np.sqrt((np.trace(covariance, axis1=1, axis2=2) - along) / 2)
    worst = np.sqrt(np.linalg.eigvalsh(covariance)[:, -1])
    return {
        "leds_seen_min": float(seen.sum(axis=0).min()),
        "centre_um_median": 1000 * float(np.median(worst)),
        "centre_um_95": 1000 * float(np.percentile(worst, 95)),
        "across_um_median": 1000 * float(np.median(across)),
    }


def _derivative(
    context: PrototypeContext, centre: Floats, radius: Floats, led: Floats, axis: Floats
) -> Floats:
    """(2, m) pixels by which highlights move for each mm of their spheres' centres."""
    step = STEP_MM * axis[:, None]
    ends = [
        _image(context, highlights(context.pinhole, centre + s, radius, led)) for s in (-step, step)
    ]
    return np.asarray((ends[1] - ends[0]) / (2 * STEP_MM))


def _image(context: PrototypeContext, points: Floats) -> Floats:
    """(2, m) column and row of points (3, m) from the picture's middle."""
    camera = context.camera
    ray = points - context.pinhole[:, None]
    depth = dot(camera.forward[:, None], ray) * camera.pitch
    return np.stack([dot(axis[:, None], ray) / depth for axis in (camera.right, camera.down)])


def highlights(pinhole: Floats, centre: Floats, radius: Floats, led: Floats) -> Floats:
    """(3, m) points of spheres by which the way from a light (3,) to the pinhole is shortest.

    They lie in the plane of centre, light and pinhole, between both, where the way's slope is zero.
    """
    to_led, to_pinhole = led[:, None] - centre, pinhole[:, None] - centre
    first, between = unit(to_led), dot(to_led, to_pinhole) / (norm(to_led) * norm(to_pinhole))
    second = unit(to_pinhole - dot(to_pinhole, first) * first)
    low, high = np.zeros(radius.size), np.arccos(np.clip(between, -1, 1))

    def point(angle: Floats) -> Floats:
        return np.asarray(radius * (np.cos(angle) * first + np.sin(angle) * second))

    def slope(angle: Floats) -> Floats:
        along = -np.sin(angle) * first + np.cos(angle) * second
        return dot(along, unit(point(angle) - to_led) + unit(point(angle) - to_pinhole))

    for _ in range(HALVINGS):
        middle = (low + high) / 2
        falls = slope(middle) < 0
        low, high = np.where(falls, middle, low), np.where(falls, high, middle)
    return np.asarray(centre + point((low + high) / 2))
