"""The gauge for the camera's place: its marks, and whether they are seen.

Marks are looked for in the mesh. The base with the gauge is rotated to the angles of the pictures;
rays beside each mark must pass the near arm and meet the far one, and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tbcad_verify.mesh.vectors import distances_to_segments, unit
from tbcad_verify.prototype.bodies import body_scene, placed_meshes
from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.measured_parts import MeasuredPart, of_roles
from tbcad_verify.record.prototype import RECORD, CameraPlace
from tbcad_verify.report.checks import Check, CheckName, Unknown, informative, no_faults, require
from tbcad_verify.types import Floats

GAUGE = "camera_gauge"
MARK_MM = 0.02  # of a corner from the recorded mark, and of the pinhole from a line through marks
BESIDE_MM = 0.3  # of the rays from a near mark
BEFORE_MM = 3.0  # of a hit from the mark it belongs to
PRESSED_MM3 = 5.0  # that the plug may share with the hub
CLEAR_MM, STEP_DEG = 1.0, 15.0
SIDES = {"positive": 0, "negative": 1}
FILE = RECORD
CHECKS = {"camera gauge": "faults"}


def checks(
    names: list[CheckName], context: PrototypeContext, parts: list[MeasuredPart]
) -> list[Check]:
    """Marks, sight and clearance of the gauge. Unknown: there is no mesh of it."""
    if context.export.spec.prototype.camera_diameter_mm == 0:
        return [informative(names[0], 0, "no camera")]
    place = require(context.prototype.camera_place, "there is no camera_place")
    gauge = next((part for part in parts if part.part.name == GAUGE), None)
    if gauge is None:
        raise Unknown(f"there is no {GAUGE}")
    given = context, place, gauge
    faults = [*_mark_faults(*given), *_sight_faults(*given, parts), *_room_faults(*given, parts)]
    return [no_faults(names[0], faults)]


def _mark_faults(
    context: PrototypeContext, place: CameraPlace, gauge: MeasuredPart
) -> Iterator[str]:
    """Marks are corners of the mesh, in line with the pinhole, and in the pictures."""
    camera, marks = context.camera, np.array(place.marks)  # (2, 2, 3)
    for mark in marks.reshape(-1, 3):
        if np.linalg.norm(gauge.placed_mesh.points - mark, axis=1).min() > MARK_MM:
            yield "a mark is no corner of the gauge"
    for near, far in marks:
        toward = (far - near) / np.linalg.norm(far - near)
        if np.linalg.norm(np.cross(context.pinhole - near, toward)) > MARK_MM:
            yield "near and far mark are not in line with the pinhole"
    half = np.array([camera.width, camera.height]) * camera.pitch / 2
    low, high = context.prototype.swing
    for picture in place.pictures:
        angle = picture.base_angle_deg
        mark = _turned(context, angle, marks[SIDES[picture.side], 1]) - camera.pinhole
        image = np.array([camera.right @ mark, camera.down @ mark]) / (camera.forward @ mark)
        if (np.abs(image) > half).any():
            yield f"a mark at {angle:.0f} degrees is out of the picture"
        if not low <= angle <= high:
            yield "the base does not turn so far"


def _turned(context: PrototypeContext, angle_deg: float, points: Floats) -> Floats:
    """Points (..., 3) of the base at an angle."""
    return np.asarray(context.base_rotation(np.radians([angle_deg]))[0].apply(points))


def _sight_faults(
    context: PrototypeContext, place: CameraPlace, gauge: MeasuredPart, parts: list[MeasuredPart]
) -> Iterator[str]:
    """Rays beside the marks meet near and far arm first, or nothing."""
    own, base, still = (
        body_scene(placed_meshes(some))
        for some in ([gauge], of_roles(parts, "base", "cap"), of_roles(parts, "frame"))
    )
    balls, pinhole = context.prototype.balls, np.repeat(context.pinhole[:, None], 3, axis=1)
    centre, radius = balls.columns("bx", 3), balls.body_radius_mm
    for picture in place.pictures:
        marks = np.array(place.marks[SIDES[picture.side]])
        rays, expected = _rays(context, marks)
        # The pinhole is on the axis: rays of the base's frame begin at the same point.
        at = f"at {picture.base_angle_deg:.0f} degrees"
        if not np.allclose(own.first(pinhole, rays)[1], expected, atol=BEFORE_MM):
            yield f"the marks are not seen one on the other {at}"
        far = np.where(np.isfinite(expected), expected, 2 * np.linalg.norm(context.pinhole))
        if (base.first(pinhole, rays)[1] < far).any():
            yield f"the base hides a mark {at}"
        ground = _turned(context, picture.base_angle_deg, rays.T).T
        if (still.first(pinhole, ground)[1] < far).any():
            yield f"the frame hides a mark {at}"
        ends = [np.broadcast_to(end, centre.shape) for end in (pinhole[:, :1], marks[1][:, None])]
        if (distances_to_segments(centre, *ends) < radius).any():
            yield f"a ball hides a mark {at}"


def _rays(context: PrototypeContext, marks: Floats) -> tuple[Floats, Floats]:
    """(3, 3) unit directions beside a pair of marks, and how far each reaches; inf: to nothing.

    One to the near arm, one beyond its end to the far one, one past both on their free side.
    """
    near, far = np.linalg.norm(marks - context.pinhole, axis=1)
    axis, zero, _ = context.frame
    out = marks[0] - (marks[0] @ axis) * axis
    out /= np.linalg.norm(out)
    # Into the arms: they lie on the side away from azimuth zero.
    beside = np.array([-out - zero, out - zero, -out + zero]) * BESIDE_MM
    return unit((marks[0] + beside - context.pinhole).T), np.array([near, far, np.inf])


def _room_faults(
    context: PrototypeContext, place: CameraPlace, gauge: MeasuredPart, parts: list[MeasuredPart]
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
    rotations = context.base_rotation(np.radians(np.linspace(min(angles), max(angles), count)))
    turned = [solid.transform(np.column_stack([r, np.zeros(3)])) for r in rotations.as_matrix()]
    for part in of_roles(parts, "frame"):
        if min(one.min_gap(part.solid, CLEAR_MM) for one in turned) < CLEAR_MM:
            yield f"the gauge turns against {part.part.name}"
