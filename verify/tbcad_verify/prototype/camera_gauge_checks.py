"""The gauge for the camera's place: its marks, whether they are seen, and what they tell.

Marks are looked for in the mesh. The base with the gauge is rotated to the angles of the pictures;
rays beside each mark must pass the near arm and meet the far one, and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from tbcad_verify.mesh.rays import build_scene, distances_to_planes, first_hits
from tbcad_verify.mesh.vectors import distances_to_segments, unit
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, joined_meshes, of_roles
from tbcad_verify.record.prototype_sections import CameraPlace, MarkPicture
from tbcad_verify.report.checks import (
    Check,
    CheckName,
    Unknown,
    at_most,
    each_at_most,
    informative,
    short_list,
)
from tbcad_verify.shell.needed_lens import Lens, needed_lens
from tbcad_verify.types import Floats

GAUGE = "camera_gauge"
PLACE_MM, PAPER_MM = 0.2, 100 * math.sqrt(2)  # allowed where the pinhole is so far from the origin
MARK_MM = 0.02  # of a corner from the recorded mark, and of the pinhole from a line through marks
BESIDE_MM = 0.3  # of the rays from a near mark
BEFORE_MM = 3.0  # of a hit from the mark it belongs to
PRESSED_MM3 = 5.0  # that the plug may share with the hub
CLEAR_MM, STEP_DEG = 1.0, 15.0
# Errors: of a reading, of an edge as a share of its blur, of a length by a caliper.
READING_PX, READING_RAD, OF_BLUR, CALIPER_MM = 0.5, 5e-4, 0.05, 0.03
STEP_MM = 1e-4  # of displacements
SIDES = {"positive": 0, "negative": 1}
MIN_TURN_DEG = 75.0
CHECKS = {"camera gauge": "faults", "camera place": "mm"}


def checks(
    names: list[CheckName], context: PrototypeContext, parts: list[MeasuredPart]
) -> list[Check]:
    """Marks, sight and clearance of the gauge; errors of the pinhole that it leaves.

    Raises:
        Unknown: there is no mesh of it.
    """
    gauge_name, place_name = names
    place, camera = context.prototype.camera_place, context.camera
    if context.export.spec.prototype.camera_diameter_mm == 0:
        return [informative(name, 0, "no camera") for name in names]
    if place is None:
        raise Unknown("there is no camera_place")
    gauge = next((part for part in parts if part.part.name == GAUGE), None)
    if gauge is None:
        raise Unknown(f"there is no {GAUGE}")
    lens = needed_lens(context.export, camera)
    faults = [
        *_mark_faults(context, place, gauge),
        *_picture_faults(context, place),
        *_sight_faults(context, place, gauge, parts),
        *_room_faults(context, place, gauge, parts),
    ]
    errors = place_errors(context, place, lens)
    limit = PLACE_MM * max(1.0, float(np.linalg.norm(camera.pinhole)) / PAPER_MM)
    ways = "along the base's axis", "across", "out"
    return [
        at_most(gauge_name, len(faults), 0, short_list(faults)),
        each_at_most(place_name, ways, np.array(errors), limit, "mm", "known no better: "),
    ]


def _marks(place: CameraPlace) -> Floats:
    """(2, 2, 3) mm."""
    return np.array(place.marks)


def _mark_faults(
    context: PrototypeContext, place: CameraPlace, gauge: MeasuredPart
) -> Iterator[str]:
    """Marks are corners of the mesh, in line with the pinhole."""
    marks, points = _marks(place), gauge.placed_mesh.points
    if place.gauge != GAUGE:
        yield f"the gauge is {place.gauge}"
    for mark in marks.reshape(-1, 3):
        if np.linalg.norm(points - mark, axis=1).min() > MARK_MM:
            yield "a mark is no corner of the gauge"
    for near, far in marks:
        toward = unit((far - near)[:, None])[:, 0]
        if np.linalg.norm(np.cross(context.pinhole - near, toward)) > MARK_MM:
            yield "near and far mark are not in line with the pinhole"


def _picture_faults(context: PrototypeContext, place: CameraPlace) -> Iterator[str]:
    """Marks appear within the picture, the base turned to either side."""
    camera = context.camera
    size = np.array([camera.width, camera.height])
    for picture in place.pictures:
        mark = _turned(context, picture, _marks(place)[SIDES[picture.side], 1]) - camera.pinhole
        depth = camera.forward @ mark
        image = np.array([camera.right @ mark, camera.down @ mark]) / depth
        if (np.abs(image) > size * camera.pitch / 2).any():
            yield f"a mark at {picture.base_angle_deg:.0f} degrees is out of the picture"
    seen = {(picture.side, np.sign(picture.base_angle_deg)) for picture in place.pictures}
    if not {("positive", 0), ("negative", 0), ("positive", -1), ("negative", 1)} <= seen:
        yield "pictures to either side are missing"
    angles = [abs(one.base_angle_deg) for one in place.pictures if one.base_angle_deg]
    low, high = context.prototype.swing
    if min(angles, default=0.0) < MIN_TURN_DEG:
        yield "the base is not turned far enough"
    if any(not low <= one.base_angle_deg <= high for one in place.pictures):
        yield "the base does not turn so far"


def _turned(context: PrototypeContext, picture: MarkPicture, points: Floats) -> Floats:
    """Points (..., 3) of the base at a picture's angle."""
    angle = np.radians([picture.base_angle_deg])
    return np.asarray(context.base_rotation(angle)[0].apply(points))


def _sight_faults(
    context: PrototypeContext,
    place: CameraPlace,
    gauge: MeasuredPart,
    parts: list[MeasuredPart],
) -> Iterator[str]:
    """Rays beside the marks meet near and far arm first, or nothing."""
    own, moving = build_scene(gauge.placed_mesh), of_roles(parts, "base", "cap")
    base = build_scene(joined_meshes(moving)[0])
    still = build_scene(joined_meshes(of_roles(parts, "frame"))[0])
    balls = context.prototype.balls
    centre, radius = balls.columns("bx", 3), balls.body_radius_mm
    for picture in place.pictures:
        marks = _marks(place)[SIDES[picture.side]]
        rays, expected = _rays(context, marks)
        angle = -np.radians([picture.base_angle_deg])
        pinhole = context.base_rotation(angle)[0].apply(context.pinhole)[:, None]
        # The pinhole is on the axis: rays of the base's frame begin at the same point.
        at = f"at {picture.base_angle_deg:.0f} degrees"
        distance = _first(own, pinhole, rays)
        if not np.allclose(distance, expected, atol=BEFORE_MM):
            yield f"the marks are not seen one on the other {at}"
        far = np.where(np.isfinite(expected), expected, 2 * np.linalg.norm(context.pinhole))
        if (_first(base, pinhole, rays) < far).any():
            yield f"the base hides a mark {at}"
        ground = _turned(context, picture, rays.T).T
        if (_first(still, context.pinhole[:, None], ground) < far).any():
            yield f"the frame hides a mark {at}"
        ends = marks[1] + 0 * centre.T
        gap = distances_to_segments(centre, context.pinhole[:, None] + 0 * centre, ends.T)
        if (gap < radius).any():
            yield f"a ball hides a mark {at}"


def _rays(context: PrototypeContext, marks: Floats) -> tuple[Floats, Floats]:
    """(3, 3) unit directions beside a pair of marks, and how far each reaches; inf: to nothing.

    One to the near arm, one beyond its end to the far one, one past both on their free side.
    """
    near, far = marks
    axis = context.frame[0]
    out = near - (near @ axis) * axis
    out /= np.linalg.norm(out)
    # Into the arms: they lie on the side away from azimuth zero.
    into = -context.frame[1]
    beside = np.array([-out + into, out + into, -out - into]) * BESIDE_MM
    rays = near + beside - context.pinhole
    reach = [np.linalg.norm(near - context.pinhole), np.linalg.norm(far - context.pinhole), np.inf]
    return unit(rays.T), np.array(reach)


def _first(scene: Any, origin: Floats, rays: Floats) -> Floats:
    """(N,) distance to the first facet along unit rays (3, N); inf for none."""
    facet = first_hits(scene, origin, rays)
    distance = distances_to_planes(scene, np.maximum(facet, 0), origin, rays)
    return np.where(facet >= 0, distance, np.inf)


def _room_faults(
    context: PrototypeContext,
    place: CameraPlace,
    gauge: MeasuredPart,
    parts: list[MeasuredPart],
) -> Iterator[str]:
    """The gauge sits on the hub, clear of balls, and turns past the frame."""
    import manifold3d

    solid = gauge.solid
    for part in of_roles(parts, "base", "cap"):
        shared = (solid ^ part.solid).volume()
        if shared > PRESSED_MM3:
            yield f"the gauge and {part.part.name} share {shared:.1f} mm^3"
    balls = context.prototype.balls
    for k in np.flatnonzero(~balls.cap).tolist():
        ball = manifold3d.Manifold.sphere(float(balls.body_radius_mm[k]), 32)
        if solid.min_gap(ball.translate(balls.columns("bx", 3)[:, k]), CLEAR_MM) < CLEAR_MM:
            yield f"ball {k + 1} is in the gauge's way"
    angles = [one.base_angle_deg for one in place.pictures]
    count = max(2, math.ceil((max(angles) - min(angles)) / STEP_DEG))
    turned = []
    for angle in np.linspace(min(angles), max(angles), count).tolist():
        rotation = context.base_rotation(np.radians([angle])).as_matrix()[0]
        turned.append(solid.transform(np.hstack([rotation, np.zeros((3, 1))])))
    for part in of_roles(parts, "frame"):
        if min(one.min_gap(part.solid, CLEAR_MM) for one in turned) < CLEAR_MM:
            yield f"the gauge turns against {part.part.name}"


@dataclass(frozen=True)
class _Sight:
    """A pair of marks at a base angle, seen from a place near the pinhole."""

    marks: Floats  # near and far one, (2, 3) mm
    axis: Floats  # of the base, (3,)

    def gap(self, at: Floats, shift: Floats) -> Floats:
        """(2,) angle from far to near mark away from the axis, and about it, rad."""
        near, far = (one / np.linalg.norm(one) for one in self.marks + shift - at)
        about = np.cross(self.axis, near + far)
        about /= np.linalg.norm(about)
        return np.asarray(np.stack([np.cross(about, far), about]) @ (near - far))

    def slopes(self, pinhole: Floats, direction: Floats) -> Floats:
        """(2,) change of the gap with a displacement of the pinhole, rad/mm."""
        none = np.zeros((2, 3))
        moved, still = self.gap(pinhole + STEP_MM * direction, none), self.gap(pinhole, none)
        return np.abs(moved - still) / STEP_MM

    def slope_of(self, mark: int, pinhole: Floats, direction: Floats) -> float:
        """Change of the gap away from the axis with a displacement of one mark, rad/mm."""
        shift = np.zeros((2, 3))
        shift[mark] = STEP_MM * direction
        change = self.gap(pinhole, shift) - self.gap(pinhole, np.zeros((2, 3)))
        return float(abs(change[0])) / STEP_MM


def place_errors(
    context: PrototypeContext, place: CameraPlace, lens: Lens
) -> tuple[float, float, float]:
    """Standard deviations of the pinhole's place along the base's axis, across and out, mm.

    By finite differences: what a displacement of the pinhole or of a mark changes of the angle
    between near and far mark. Two readings each; across and out a quarter turn to either side.
    """
    axis, zero, third = context.frame
    pinhole, marks = context.pinhole, _marks(place)[0]
    quarter = context.base_rotation(np.radians([-90.0]))[0].apply(marks)
    level, upright = _Sight(marks, axis), _Sight(quarter, axis)
    noise = [_reading(context, lens, one.marks) / math.sqrt(2) for one in (level, upright)]
    along = level.slopes(pinhole, axis)[0]
    lengths = [
        level.slope_of(mark, pinhole, direction) * size / along
        for mark in (0, 1)
        for direction, size in ((third, CALIPER_MM / 2), (axis, CALIPER_MM))
    ]
    read = noise[0] / along
    out = upright.slopes(pinhole, zero)[0]
    mixed = read * upright.slopes(pinhole, axis)[0] / out
    return (
        math.hypot(read, *lengths),
        float(noise[1] / upright.slopes(pinhole, third)[1]),
        math.hypot(noise[1] / out, mixed),
    )


def _reading(context: PrototypeContext, lens: Lens, marks: Floats) -> float:
    """Error of the angle between two marks (2, 3) as they are read in the picture, rad."""
    near = marks[0] - context.pinhole
    depth = float(context.camera.forward @ near)
    blur = lens.pupil * abs(1 / depth - 1 / lens.focus)
    pixel = min(READING_PX * context.camera.pitch, READING_RAD)
    return math.hypot(pixel, OF_BLUR * blur) * depth / float(np.linalg.norm(near))
