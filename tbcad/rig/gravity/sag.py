"""Where the balls of a build are as its base turns in the field of gravity.

Carrier and bearing head are linear elastic solids, as prototype.glb has them; the shaft is a beam
on two bearings, the uprights are columns. All else is rigid: bearings, screwed joints, plate, feet.
The frame here is the base's at angle zero: x along the axis w, y at azimuth zero.
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from trimesh import Trimesh
from trimesh.util import concatenate

from tbcad.cad.formats.glb import read_glb
from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.vectors import norm
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.output.manifest import read_manifest, written_file
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.tables import BallRow, StopRow
from tbcad.rig.gravity.compliance import (
    N_PER_G,
    Axle,
    Bodies,
    Material,
    column_compliance,
    compliance,
    moved_to,
    rigid_motion,
    sag_of_bodies,
    shaft_compliance,
    turned_to,
)
from tbcad.types import Floats

STEEL, ALUMINIUM, ALUMINIUM_SHEAR = 210.0, 70.0, 26.0  # moduli, GPa
# Of an extrusion of 20 mm with slots of 6 mm, mm^4: vendors' lists have 6,700 to 8,000; twist
# mostly goes through the bending of both uprights, which stand apart.
SECOND_MOMENT, TWIST_CONSTANT = 7.0e3, 1.5e3
# From a screw's axis to where a part is held by it, and along its axis.
SCREW_MM, REACH_MM = 5.0, 10.0
MPA_PER_GPA = 1e3
UPRIGHTS, BEARINGS = ("upright_left", "upright_right"), ("bearing_front", "bearing_rear")
MAX_MM = 5000.0  # of a body: none that a build has is as long
X = np.array([1.0, 0.0, 0.0])
LEFT = {"turn and run-out": [3, 1, 2], "six freedoms": [0, 1, 2, 3, 4, 5]}
"""Freedoms of `Sag.unmodelled` that a calibration may give to each stop."""


@dataclass(frozen=True)
class Sag:
    """Displacements of k balls at s stops in the base's frame, which turns with it, mm."""

    angle: Floats  # of the base at each stop, radians, (s,)
    centre: Floats  # of the bodies without weight, in the base's frame, mm, (k, 3)
    axes: Floats  # of that frame at angle zero in the shell's, as rows, (3, 3)
    gravity: Floats  # direction of gravity at each stop, (s, 3)
    of: dict[str, Floats]  # by what bends: carrier, head, shaft, uprights, (s, k, 3)

    @property
    def whole(self) -> Floats:
        """Displacements by all together, mm, (s, k, 3)."""
        return np.asarray(np.sum(list(self.of.values()), axis=0))

    def between_stops(self, moved: Floats) -> float:
        """The longest way of a ball between two stops, mm, by displacements (s, k, 3)."""
        return max(
            float(norm(ball[:, None] - ball[None]).max()) for ball in np.swapaxes(moved, 0, 1)
        )

    def unmodelled(self, moved: Floats, freedoms: list[int]) -> Floats:
        """What is left of displacements (s, k, 3) after calibration, mm, (s, k).

        Calibration takes out where the balls are on the mean over stops, and for each stop the best
        rigid motion of some freedoms: 0 to 2 are shifts along the axes, 3 to 5 turns about them.
        """
        motion = rigid_motion(self.centre)[:, :, freedoms].reshape(-1, len(freedoms))
        left = (moved - moved.mean(axis=0)).reshape(len(moved), -1)
        left = left - left @ np.linalg.pinv(motion).T @ motion.T
        return norm(left.reshape(moved.shape))

    def record(self) -> dict[str, Any]:
        """For other programs, in mm: by what bends, and what is left after calibration."""
        ways = {name: self.between_stops(moved) for name, moved in self.of.items()}
        left = {name: self.unmodelled(self.whole, freedoms) for name, freedoms in LEFT.items()}
        return {
            "schema": "tbcad-sag/1",
            "between_stops_mm": self.between_stops(self.whole),
            "parts_between_stops_mm": ways,
            "left_rms_mm": {name: float(np.sqrt((one**2).mean())) for name, one in left.items()},
            "left_max_mm": {name: float(one.max()) for name, one in left.items()},
        }

    def lines(self) -> list[str]:
        """The same in words."""
        record = self.record()
        rms, most = record["left_rms_mm"], record["left_max_mm"]
        ways = ", ".join(f"{n} {mm:.2f}" for n, mm in record["parts_between_stops_mm"].items())
        return [
            f"Sag: a ball moves by up to {record['between_stops_mm']:.2f} mm between stops",
            f"  by what bends: {ways}",
            *(
                f"  left by {name} for each stop: {rms[name]:.3f} mm RMS, {most[name]:.3f} at most"
                for name in LEFT
            ),
        ]


def build_sag(export: ExportedDesign) -> Sag:
    """The sag of a build's prototype, by the modulus and the infill of its spec's printer.

    InputError: there is no prototype, its files cannot be read, or its drive has no shaft of its
    own.
    """
    folder, printer = export.folder, export.spec.printer
    record = Prototype.read(folder / NAME)
    if "shaft" not in {body.name for body in record.bought}:
        raise InputError(
            f"{folder / NAME}: the base turns on the drive's own bearings, whose stiffness no list "
            'gives: sag is computed for prototype.base.drive = "nema17-belt"'
        )
    manifest = read_manifest(folder)
    for name in (record.assembly.glb, BallRow.FILE, StopRow.FILE):
        written_file(folder, manifest, name, Prototype.MISSING)
    axes = np.array([record.frame.axis, record.frame.zero, record.frame.third])
    carrier_parts = [one.name for one in record.with_role("base") if one.name != "zero_disc"]
    solids = read_solids(folder / record.assembly.glb, axes, carrier_parts)
    bodies = _bodies(BallRow.read(folder), axes, printer.density_g_cm3)
    angle, down = np.radians([row.base_angle_deg for row in StopRow.read(folder)]), -axes[:, 2]
    gravity = rotated_about_x(np.broadcast_to(down, (len(angle), 3)), -angle)
    material = Material(printer.modulus_gpa, printer.density_g_cm3, printer.infill)
    pieces = [solids[name] for name in carrier_parts]
    held = Axle(X * pieces[0].bounds[0, 0], X * solids["shaft"].bounds[1, 0], _shaft_radius(solids))
    carrier = sag_of_bodies(concatenate(pieces), bodies, held, material)
    load = axes @ np.array(record.drive.centre_mm), record.drive.mass_g
    of = {"carrier": np.einsum("kag,sg->ska", carrier, gravity)}
    for name, flexible in _holding(record, solids, axes, held.start, material).items():
        of[name] = moved_by(flexible, held.start, bodies.centre, load, (angle, down))
    return Sag(angle, bodies.centre, axes, gravity, of)


def read_solids(path: Path, axes: Floats, carrier: list[str]) -> dict[str, Trimesh]:
    """All bodies of an assembly by name, in the frame with some axes as rows.

    InputError: it is no assembly, lacks a body, or is far too large to be one.
    """
    try:
        shown = {body.name: body.mesh for body in read_glb(path)}
    except (LookupError, ValueError, TypeError, AttributeError, OSError, struct.error):
        raise InputError(f"{path} cannot be read: build the export again") from None
    solids = {n: Trimesh(one.vertices @ axes.T, one.triangles) for n, one in shown.items()}
    missing = {*carrier, "shaft", "bearing_head", *UPRIGHTS, *BEARINGS} - solids.keys()
    if missing or max(np.ptp(one.bounds, axis=0).max() for one in solids.values()) > MAX_MM:
        raise InputError(f"{path} is no assembly that tbcad wrote: build the export again")
    return solids


def _bodies(balls: list[BallRow], axes: Floats, density: float) -> Bodies:
    """Balls and caps: nodes about as far as a seat reaches move with each."""
    centre = np.array([[ball.bx, ball.by, ball.bz] for ball in balls]) @ axes.T
    radius = np.array([ball.body_radius_mm for ball in balls])
    printed = 4 / 3 * np.pi * radius**3 / 1000 * density
    mass = np.array([math.nan if ball.mass_g is None else ball.mass_g for ball in balls])
    return Bodies(centre, radius, np.where(np.isnan(mass), printed, mass))


def _shaft_radius(solids: dict[str, Trimesh]) -> float:
    return float(np.ptp(solids["shaft"].bounds[:, 1]) / 2)


def _holding(
    record: Prototype, solids: dict[str, Trimesh], axes: Floats, hub: Floats, material: Material
) -> dict[str, Floats]:
    """Compliances at the hub of head, shaft and uprights, (6, 6) each, in the base's frame."""
    middle = {name: solids[name].bounds[:, 0].mean() for name in BEARINGS}
    front, rear = (X * middle[name] for name in BEARINGS)
    inertia = math.pi / 4 * _shaft_radius(solids) ** 4
    shaft = shaft_compliance(hub[0] - front[0], front[0] - rear[0], STEEL * MPA_PER_GPA * inertia)
    loaded = [_round(solids[name]) for name in BEARINGS]
    head = compliance(solids["bearing_head"], front, _screws(record, axes), loaded, material)
    return {
        "head": moved_to(head, hub - front),
        "shaft": shaft,
        "uprights": _uprights(solids, axes, hub),
    }


def _round(bearing: Trimesh) -> Axle:
    """Outside of a bearing, which its seat is round."""
    low, high = bearing.bounds
    return Axle(X * low[0], X * high[0], float(high[1]))


def _screws(record: Prototype, axes: Floats) -> list[Axle]:
    """Round the screws that hold the head on the uprights."""
    held = [one for one in record.fasteners if "bearing_head" in one.through]
    held = [one for one in held if not set(UPRIGHTS).isdisjoint(one.through)]
    places = [(axes @ np.array(one.position_mm), axes @ np.array(one.along)) for one in held]
    return [Axle(at - REACH_MM * along, at + REACH_MM * along, SCREW_MM) for at, along in places]


def _uprights(solids: dict[str, Trimesh], axes: Floats, hub: Floats) -> Floats:
    """Compliance of both uprights at the hub, (6, 6): columns that the head makes one."""
    corners = np.stack([(solids[name].vertices @ axes).min(axis=0) for name in UPRIGHTS])
    ends = np.stack([(solids[name].vertices @ axes).max(axis=0) for name in UPRIGHTS])
    middle = np.concatenate([corners, ends]).mean(axis=0)
    foot, apart = corners[0, 2], norm(corners[1] - corners[0])
    height = float((solids["bearing_head"].vertices @ axes)[:, 2].min()) - foot
    bending = 2 * ALUMINIUM * MPA_PER_GPA * SECOND_MOMENT
    twisting = 2 * ALUMINIUM_SHEAR * MPA_PER_GPA * TWIST_CONSTANT
    # A turn about z bends both uprights the other way.
    twisting += bending * 3 / height**2 * (apart / 2) ** 2
    top = np.array([*middle[:2], foot + height])
    column = turned_to(column_compliance(height, bending, twisting), axes)
    return moved_to(column, hub - axes @ top)


def moved_by(
    flexible: Floats,
    hub: Floats,
    centre: Floats,
    load: tuple[Floats, float],
    turns: tuple[Floats, Floats],
) -> Floats:
    """Displacements of places (k, 3) on the base as what holds its hub bends, mm, (s, k, 3).

    By a compliance (6, 6) at the hub, place and mass (g) of the load, the angles of the base (s,)
    and the direction of gravity, (3,).
    """
    angle, down = turns
    arm = rotated_about_x(np.broadcast_to(load[0], (len(angle), 3)), angle) - hub
    force = np.broadcast_to(load[1] * N_PER_G * down, arm.shape)
    motion = np.concatenate([force, np.cross(arm, force)], axis=1) @ flexible
    place = rotated_about_x(np.broadcast_to(centre, (len(angle), *centre.shape)), angle[:, None])
    moved = motion[:, None, :3] + np.cross(motion[:, None, 3:], place - hub)
    return rotated_about_x(moved, -angle[:, None])
