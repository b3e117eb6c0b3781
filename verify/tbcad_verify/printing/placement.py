"""How a part lies best in a printer, or how much it is too large."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.vectors import norm, tangent_basis
from tbcad_verify.printing.orientations import PartHull
from tbcad_verify.printing.overhang import overhang_area
from tbcad_verify.printing.part_measures import PartMeasures
from tbcad_verify.printing.profile import Profile
from tbcad_verify.printing.rotating_callipers import best_turn
from tbcad_verify.types import Floats

SLACK_MM = 1e-3  # what no machine can tell, and float32 may have added
AXIS_COS = math.cos(math.radians(0.01))
WORDS = ("x", "y", "z")


@dataclass(frozen=True)
class Pose:
    """One way to lie.

    Attributes:
        rotation: (3, 3) from the file's axes to the machine's: x right, y back, z up.
        size: (3,) of the part then, mm.
        turn: about the machine's z, the last part of the rotation, rad.
        excess: how much too large for the bed, mm; negative where there is room.
    """

    rotation: Floats
    size: Floats
    turn: float
    excess: float

    @property
    def down(self) -> Floats:
        """(3,) the file's direction that points down."""
        return np.asarray(-self.rotation[2])


@dataclass(frozen=True)
class Placement:
    """The best way to lie.

    Attributes:
        pose: it.
        fits: whether the bed, less the clearance at its rim, holds it.
        overhang: area that needs support then, mm^2; None where nothing does.
    """

    pose: Pose
    fits: bool
    overhang: float | None


def place(shape: PartMeasures, profile: Profile) -> Placement:
    """Search resting faces and axes, each at its best turn about the vertical.

    Of those that fit, the one with least overhang, then the lowest, then the one most like the
    file's; else the one that comes nearest to fitting, tilted ones included. Tilts between those
    tried are not searched.
    """
    poses = _poses(shape.hull, shape.hull.down, profile)
    if not any(_fits(pose) for pose in poses):
        poses += _poses(shape.hull, shape.hull.tilted, profile)
    fitting = [pose for pose in poses if _fits(pose)]
    if not fitting:
        pose = min(poses, key=lambda pose: pose.excess)
        return Placement(pose, False, _overhangs(shape, [pose], profile)[0])
    areas = _overhangs(shape, fitting, profile)
    keys = [
        (*_rank(shape, pose, area), k)
        for k, (pose, area) in enumerate(zip(fitting, areas, strict=True))
    ]
    best = min(keys)[-1]
    return Placement(fitting[best], True, areas[best])


def _rank(shape: PartMeasures, pose: Pose, overhang: float | None) -> tuple[int, int, int]:
    # Whole numbers, so that rounding does not choose between orientations that are alike.
    grain = 1e-6 * shape.mass.area
    height, tilt = float(pose.size[2]), 1 - float(pose.rotation[2, 2])
    return round((overhang or 0) / grain), round(height / SLACK_MM), round(1e6 * tilt)


def pose_text(pose: Pose) -> str:
    """Which of the file's directions points down, and the turn that follows."""
    k = int(np.abs(pose.down).argmax())
    if abs(pose.down[k]) > AXIS_COS:
        down = f"{'-' if pose.down[k] < 0 else '+'}{WORDS[k]}"
    else:
        down = "({:.3f}, {:.3f}, {:.3f})".format(*(pose.down + 0.0))
    degrees = math.degrees(pose.turn)
    turned = f" turned {degrees:.1f} deg" if degrees > 0.05 else ""
    return f"{down} down{turned}"


def _poses(hull: PartHull, directions: Floats, profile: Profile) -> list[Pose]:
    return [_pose(hull, down, profile) for down in directions.T]


def _pose(hull: PartHull, down: Floats, profile: Profile) -> Pose:
    level = np.stack([*(side[:, 0] for side in tangent_basis(-down[:, None])), -down])
    points = np.einsum("ij,jn->in", level, hull.points)
    width, depth, height = profile.bed_mm
    rim = 2 * profile.clearance_mm
    angle, sides = best_turn(points[:2], width - rim, depth - rim, SLACK_MM)
    size = np.append(sides, np.ptp(points[2]))
    excess = float((size - np.array([width - rim, depth - rim, height])).max())
    return Pose(np.einsum("ij,jk->ik", _about_z(angle), level), size, angle, excess)


def _about_z(angle: float) -> Floats:
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])


def _fits(pose: Pose) -> bool:
    return pose.excess <= SLACK_MM


def _overhangs(shape: PartMeasures, poses: list[Pose], profile: Profile) -> list[float | None]:
    if profile.overhang_deg is None:
        return [None] * len(poses)
    double, lean = norm(shape.mesh.area), math.radians(profile.overhang_deg)
    return [overhang_area(shape.mesh, double, pose.down, lean) for pose in poses]
