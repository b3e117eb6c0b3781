"""The gauge that shows where the camera's pinhole is, and how well: a printed cross on the hub.

Its plug fits the hub's bore before the shaft. Two arms, one nearer to the camera, have a mark at
either end: the corner of an end with the face that contains the base's axis. From the pinhole, and
from nowhere else, the near mark of a side is seen on the far one. With the base turned by a quarter
to both sides errors of plug and bore change their sign, and are seen apart from the camera's.

Lengths are along the base's axis from the origin toward the camera, along the arms, and across.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tbcad.core.camera.requirements import CameraRequirements, camera_requirements
from tbcad.core.geometry.primitives import Component, Prism, box
from tbcad.core.geometry.rotations import even_angles, rotated_about_x, unit_circle
from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import Camera
from tbcad.prototype.assembly_steps.machine import AssembledMachine, Values, planned
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.frame.camera_mount import CameraMount
from tbcad.prototype.part import FrameLayout, Mounted, Part, Site
from tbcad.records.prototype import MarkPicture
from tbcad.types import Floats

# The lines through near and far marks, from the base's axis; less where the picture is narrower.
LINE_DEG, OF_PICTURE = 30.0, 0.85
QUARTER_DEG = 90.0
# Distances of near and far marks from the pinhole, of the origin's. Lenses reach before their
# entrance pupils by this share of the camera's diameter.
NEAR_SHARES = (0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75)
FAR_SHARES = (1.0, 1.05, 1.1, 1.15, 1.2)
LENS_OF_CAMERA = 0.75
MAX_FAR_MM = 90.0  # from the axis to the far marks: for the printer's bed
BEHIND_FAR_MM = 20.0  # from the hub to the far marks
# Errors: half a pixel, or this angle where a design's pixels are coarser than those on sale; of an
# edge's place this share of its blur; of a length by a caliper (ISO 13385-1).
READING_PX, READING_RAD, OF_BLUR, CALIPER_MM = 0.5, 5e-4, 0.05, 0.03

PLUG_SIDES, PLUG_PRESS_MM, PLUG_FREE_MM = 16, 0.1, 1.0  # wider than the bore by the second
FLANGE_MM, FLANGE_HALF_MM, FLANGE_BELOW_MM = 6.0, 18.0, 4.0
MAST_HALF_MM, THICKNESS_MM = 7.0, 12.0
ARM_MM, BLOCK_MM, STEP_MM = 8.0, 12.0, 6.0  # of the arms along the axis; of the far ends
UNDERCUT_MM = 2.0  # by which far ends recede behind their marks, beyond the line of sight
ROOT_MM = 1.0  # by which bodies reach into each other
SIDES: tuple[Literal["positive", "negative"], ...] = "positive", "negative"
WHAT = "gauge for the camera's place, on the hub while the camera is aligned"


@dataclass(frozen=True)
class GaugeSizes:
    """Where the marks are."""

    hub: float  # of the hub's face that the gauge lies on, along the axis, mm
    near: float  # of the near marks, mm
    far: float  # of the far marks, mm
    near_half: float  # from the axis to a near mark, mm
    far_half: float  # from the axis to a far mark, mm


@dataclass(frozen=True)
class Sight:
    """How the pinhole sees the marks."""

    near: float  # distance of the near marks along the base's axis, mm
    far: float  # of the far marks
    tangent: float  # of the angle between axis and lines of sight
    to_axis: float  # cosine of the angle between the optical axis and the base's
    to_zero: float  # part of the optical axis along azimuth zero


@dataclass(frozen=True, kw_only=True)
class CameraGauge(Mounted):
    """The gauge, a tool on the hub at base angle zero, and what it tells."""

    sizes: GaugeSizes  # where its marks are
    # near and far mark of the side at positive azimuths, then of the other, at base angle zero, mm,
    # (2, 2, 3)
    marks: Floats
    angles: tuple[float, float, float]  # of the base at which photographs are taken, degrees
    # of the pinhole's place, standard deviation each: along the base's axis, across the frame's
    # plane, in it out from the axis, mm
    errors: dict[str, float]


def camera_gauge(site: Site, before: FrameLayout) -> CameraGauge | None:
    """The gauge whose marks tell most of the pinhole's place; None without a camera."""
    if before.find(CameraMount) is None:
        return None
    base, camera, swing = site.base, site.layout.array.camera, site.layout.stops.range
    needed = camera_requirements(site.layout.array, site.spec.optics.capture_diameter_mm / 2)
    diameter = site.spec.prototype.camera_diameter_mm
    distance, pitch = float(norm(camera.pinhole)), camera.pixel_pitch
    sights = _sights(base, camera, diameter, needed)
    sight = min(sights, key=lambda one: max(place_errors(one, pitch, needed).values()))
    tangent = sight.tangent
    sizes = GaugeSizes(
        hub=base.hub.front,
        near=distance - sight.near,
        far=distance - sight.far,
        near_half=sight.near * tangent,
        far_half=sight.far * tangent,
    )
    low, high = (math.degrees(end) for end in swing)
    across = np.array([[1.0], [-1.0]]) * [sizes.near_half, sizes.far_half]
    along = np.broadcast_to([sizes.near, sizes.far], across.shape)
    return CameraGauge(
        tools=(_component(base, sizes),),
        sizes=sizes,
        marks=np.stack([along, across, 0 * across], axis=-1) @ _axes(base),
        angles=(max(-QUARTER_DEG, low), 0.0, min(QUARTER_DEG, high)),
        errors=place_errors(sight, pitch, needed),
    )


def _sights(
    base: BaseLayout, camera: Camera, diameter: float, needed: CameraRequirements
) -> list[Sight]:
    """Marks that the picture, the lens, the hub and the printer's bed allow."""
    distance, (half_across, _) = float(norm(camera.pinhole)), needed.half_sizes
    to_axis, to_zero = -float(base.frame[0] @ camera.forward), float(base.frame[1] @ camera.forward)
    tangent = min(math.tan(math.radians(LINE_DEG)), OF_PICTURE * half_across * to_axis)
    nearest = min(LENS_OF_CAMERA * diameter / to_axis, NEAR_SHARES[-1] * distance)
    farthest = min(distance - base.hub.front - BEHIND_FAR_MM, MAX_FAR_MM / tangent)
    return [
        Sight(near * distance, far * distance, tangent, to_axis, to_zero)
        for near in NEAR_SHARES
        for far in FAR_SHARES
        if near * distance >= nearest and (far * distance <= farthest or far == FAR_SHARES[0])
    ]


def marks_seen(gauge: CameraGauge, base: BaseLayout, camera: Camera) -> tuple[MarkPicture, ...]:
    """Every picture of a pair of marks."""
    low, middle, high = gauge.angles
    pictures = []
    for angle, side in ((low, 0), (middle, 0), (middle, 1), (high, 1)):
        turned = rotated_about_x(gauge.marks[side, 1] @ base.frame.T, np.radians(angle))
        column, row = camera.project(turned @ base.frame).tolist()
        pictures.append(
            MarkPicture(base_angle_deg=angle, side=SIDES[side], column_px=column, row_px=row)
        )
    return tuple(pictures)


def place_errors(sight: Sight, pitch: float, needed: CameraRequirements) -> dict[str, float]:
    """Standard deviations of the pinhole's place, mm: along the base's axis, across, out.

    A displacement is seen as the angle between near and far mark, with pixels of a pitch at unit
    distance. Along the axis both sides are read at once, and lengths of the gauge count; across and
    out it is read a quarter turn to either side, where what is wrong with the gauge has opposite
    signs.
    """
    lines, parallax = math.atan(sight.tangent), 1 / sight.near - 1 / sight.far
    level = _reading(sight, 0.0, pitch, needed) / math.sqrt(2)
    upright = _reading(sight, sight.to_zero, pitch, needed) / math.sqrt(2)
    apart = math.cos(lines) * parallax
    along = level / (math.sin(lines) * apart)
    halves = CALIPER_MM / 2 / sight.tangent
    lengths = [
        size / distance / parallax
        for size in (halves, CALIPER_MM)
        for distance in (sight.near, sight.far)
    ]
    return {
        "along_mm": math.hypot(along, *lengths),
        "across_mm": upright / apart,
        "out_mm": math.hypot(upright / (math.cos(lines) * apart), along * sight.tangent),
    }


def _reading(sight: Sight, to_zero: float, pitch: float, needed: CameraRequirements) -> float:
    """Error of the angle between two marks, radians; to_zero is 0 for arms that are level."""
    cosine = sight.to_axis + sight.tangent * to_zero  # of marks at unit distance along the axis
    blur = needed.pupil_mm * abs(1 / (sight.near * cosine) - 1 / needed.focus_mm)
    at_unit = math.hypot(min(READING_PX * pitch, READING_RAD), OF_BLUR * blur)
    return at_unit * cosine * math.cos(math.atan(sight.tangent))


def _axes(base: BaseLayout) -> Floats:
    """Rows: along the base's axis, along the arms, and away from azimuth zero, (3, 3)."""
    axis, zero, third = base.frame
    return np.stack([axis, third, -zero])


def _component(base: BaseLayout, sizes: GaugeSizes) -> Component:
    """The cross as it sits on the hub, its marked face up when it is printed."""
    axes, hub, near, far = _axes(base), sizes.hub, sizes.near, sizes.far
    wide = sizes.far_half + BLOCK_MM
    # A prism in the hub's bore, whose edges are pressed in.
    circle = (base.hub.bore + PLUG_PRESS_MM / 2) * unit_circle(even_angles(PLUG_SIDES))
    start = base.hub.socket + PLUG_FREE_MM
    corners = np.column_stack([np.full(PLUG_SIDES, start), circle])
    plug = Prism(corners @ axes, (base.hub.front + ROOT_MM - start) * axes[0])
    blocks = (  # of half a width, between two places along the axis, above a level
        (FLANGE_HALF_MM, hub, hub + FLANGE_MM, -FLANGE_BELOW_MM),
        (MAST_HALF_MM, hub, near, 0.0),
        (sizes.near_half, near - ARM_MM, near, 0.0),
        (wide, far - ARM_MM, far, STEP_MM),
    )
    added = (
        *(
            box((low, -half, level), (high, half, THICKNESS_MM), axes)
            for half, low, high, level in blocks
        ),
        *(_far_end(sizes, side, axes) for side in (1, -1)),
        plug,
    )
    return Component("camera_gauge", WHAT, added, (), (axes[2], -axes[2]))


def _far_end(sizes: GaugeSizes, side: int, axes: Floats) -> Prism:
    """The end of a far arm beyond its mark; behind the mark it recedes from the line of sight."""
    half, back = sizes.far_half, sizes.far - ARM_MM
    beyond = half + ARM_MM + UNDERCUT_MM
    end = half + BLOCK_MM + ROOT_MM
    corners = [(sizes.far, half), (sizes.far, end), (back, end), (back, beyond)]
    points = np.array([[along, side * across, 0.0] for along, across in corners])
    return Prism(points @ axes, THICKNESS_MM * axes[2])


@planned("Camera in its place", "camera_gauge", near=("carrier",))
def gauge_step(machine: AssembledMachine) -> Values:
    """The camera's alignment by the gauge."""
    place = machine.record.camera_place
    assert place is not None
    return {
        "sizes": place.lengths_mm,
        "error": place.error,
        "travel": place.travel,
        "pictures": [{"one": one} for one in place.pictures],
    }


GAUGE = Part((gauge_step,), camera_gauge)
