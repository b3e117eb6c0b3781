"""The best orientation of a part in a printer, or by how much it is too large."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tbcad_verify.mesh.mesh import Mesh
from tbcad_verify.mesh.vectors import norm
from tbcad_verify.printing.orientations import HullView, best_rotation
from tbcad_verify.printing.part_measures import PartMeasures
from tbcad_verify.printing.profile import Profile
from tbcad_verify.types import Floats

SLACK_MM = 1e-3  # below any machine's precision, and the error of float32
AXIS_COS = math.cos(math.radians(0.01))
AXES = ("x", "y", "z")
BED_MM = 0.01  # facets within this of the lowest point lie on the bed; far less than a layer
# Normals of fine facets are uncertain by this: faces at just the allowed lean are allowed.
UNCERTAINTY_RAD = 1e-3


@dataclass(frozen=True)
class Pose:
    """One orientation."""

    rotation: Floats  # (3, 3) from the file's axes to the machine's: x right, y back, z up
    size: Floats  # (3,) of the part then, mm
    turn: float  # about the machine's z, the last part of the rotation, rad
    excess: float  # by how much it is too large for the bed, mm; negative where there is room

    @property
    def fits(self) -> bool:
        """Whether it fits the bed less the clearance at its rim."""
        return self.excess <= SLACK_MM

    @property
    def down(self) -> Floats:
        """(3,) the file's direction that points down."""
        return np.asarray(-self.rotation[2])


@dataclass(frozen=True)
class BedPlacement:
    """The best orientation."""

    pose: Pose  # the orientation
    overhang: float | None  # area that needs support, mm^2; None for processes without support


def place(measures: PartMeasures, profile: Profile) -> BedPlacement:
    """Search resting faces and axes, each at its best rotation about the vertical.

    Of those that fit, the one with the smallest overhang, then the lowest, then the one most like
    the file's; else the one that comes nearest to fitting, tilted ones included. Tilts between
    those tried are not searched.
    """
    hull = measures.hull
    poses = [_pose(view, profile) for view in hull.standing]
    if not any(pose.fits for pose in poses):
        poses += [_pose(view, profile) for view in hull.leaning]
    fitting = [pose for pose in poses if pose.fits]
    if not fitting:
        pose = min(poses, key=lambda pose: pose.excess)
        return BedPlacement(pose, _overhangs(measures, [pose], profile)[0])
    areas = _overhangs(measures, fitting, profile)
    pose, area = min(zip(fitting, areas, strict=True), key=lambda pair: _rank(measures, *pair))
    return BedPlacement(pose, area)


def _rank(measures: PartMeasures, pose: Pose, overhang: float | None) -> tuple[int, int, int]:
    # Whole numbers, so that rounding does not choose between orientations that are alike.
    grain = 1e-6 * measures.mass.area
    height, tilt = float(pose.size[2]), 1 - float(pose.rotation[2, 2])
    return round((overhang or 0) / grain), round(height / SLACK_MM), round(1e6 * tilt)


def pose_text(pose: Pose) -> str:
    """The direction of the file that points down, and the rotation about z that follows."""
    k = int(np.abs(pose.down).argmax())
    if abs(pose.down[k]) > AXIS_COS:
        down = f"{'-' if pose.down[k] < 0 else '+'}{AXES[k]}"
    else:
        down = "({:.3f}, {:.3f}, {:.3f})".format(*(pose.down + 0.0))
    degrees = math.degrees(pose.turn)
    turned = f" turned {degrees:.1f} deg" if degrees > 0.05 else ""
    return f"{down} down{turned}"


def _pose(view: HullView, profile: Profile) -> Pose:
    width, depth, height = profile.bed_mm
    rim = 2 * profile.clearance_mm
    angle, sides = best_rotation(view, width - rim, depth - rim, SLACK_MM)
    size = np.append(sides, view.height)
    excess = float((size - np.array([width - rim, depth - rim, height])).max())
    cos, sin = math.cos(angle), math.sin(angle)
    rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return Pose(np.einsum("ij,jk->ik", rotation, view.level), size, angle, excess)


def _overhangs(measures: PartMeasures, poses: list[Pose], profile: Profile) -> list[float | None]:
    if profile.overhang_deg is None:
        return [None] * len(poses)
    double, lean = norm(measures.mesh.area), math.radians(profile.overhang_deg)
    return [overhang_area(measures.mesh, double, pose.down, lean) for pose in poses]


def overhang_area(mesh: Mesh, double: Floats, down: Floats, lean_rad: float) -> float:
    """Area of facets that lean more than allowed and do not lie on the bed, mm^2.

    `double`: (F,) twice the facets' areas, mm^2.
    `down`: (3,) unit, the direction that points down.
    """
    limit = math.sin(min(lean_rad + UNCERTAINTY_RAD, math.pi / 2))
    below = np.flatnonzero(np.einsum("in,i->n", mesh.area, down) > limit * double)
    depth = np.einsum("ni,i->n", mesh.points, down)
    lying = depth > depth.max() - BED_MM
    on_bed = lying[mesh.faces[below]].all(axis=1)
    return float(double[below[~on_bed]].sum()) / 2
