"""Where the balls of a prototype are as its base turns in the field of gravity: sag.csv.

Carrier and bearing head are linear elastic solids, as they are written; the shaft is a beam on two
bearings, the uprights are columns. All else is rigid: bearings, screwed joints, plate, feet. The
frame here is the base's at angle zero: x along the axis w, y at azimuth zero.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from trimesh import Trimesh
from trimesh.util import concatenate

from tbcad.cad.formats.checked_files import Row, write_table
from tbcad.cad.formats.glb import ColouredMesh
from tbcad.core.geometry.rotations import rotated_about_x
from tbcad.core.geometry.vectors import norm
from tbcad.errors import InputError
from tbcad.prototype.arrangement import PrototypeModel
from tbcad.prototype.drive.balance import ball_masses
from tbcad.prototype.fasteners import Fastener
from tbcad.prototype.gravity.compliance import (
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
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.tables import BallRow, SagRow, StopRow
from tbcad.types import Floats

STEEL, ALUMINIUM, ALUMINIUM_SHEAR = 210.0, 70.0, 26.0  # moduli, GPa
# Of an extrusion of 20 mm with slots of 6 mm, mm^4: vendors' lists have 6,700 to 8,000; twist
# mostly goes through the bending of both uprights, which stand apart.
SECOND_MOMENT, TWIST_CONSTANT = 7.0e3, 1.5e3
# From a screw's axis to where a part is held by it, and along its axis.
SCREW_MM, REACH_MM = 5.0, 10.0
MPA_PER_GPA = 1e3
UPRIGHTS, BEARINGS = ("upright_left", "upright_right"), ("bearing_front", "bearing_rear")
X = np.array([1.0, 0.0, 0.0])
LEFT = {"turn and run-out": [3, 1, 2], "six freedoms": [0, 1, 2, 3, 4, 5]}
"""Freedoms of `Sag.unmodelled` that a calibration may give to each stop."""


PARTS = ("carrier", "head", "shaft", "uprights")  # that bend


@dataclass(frozen=True)
class Sag:
    """Displacements of k balls at s stops in the base's frame, which turns with it, mm."""

    angle: Floats  # of the base at each stop, radians, (s,)
    centre: Floats  # of the bodies without weight, in the base's frame, mm, (k, 3)
    axes: Floats  # of that frame at angle zero in the shell's, as rows, (3, 3)
    of: dict[str, Floats]  # by what bends, one of PARTS, (s, k, 3)

    @property
    def gravity(self) -> Floats:
        """Direction of gravity at each stop, (s, 3)."""
        down = np.broadcast_to(-self.axes[:, 2], (len(self.angle), 3))
        return rotated_about_x(down, -self.angle)

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

    def rows(self) -> Iterable[Row]:
        """Rows of sag.csv: displacements in the frame of the shell."""
        turned = [rotated_about_x(self.of[part], self.angle[:, None]) for part in PARTS]
        moved = np.concatenate([one @ self.axes for one in turned], axis=2)
        for stop, balls in enumerate((moved + 0.0).tolist(), 1):
            for ball, cells in enumerate(balls, 1):
                yield dict(zip(SagRow.columns(), (stop, ball, *cells), strict=True))


def read_sag(folder: Path) -> Sag | None:
    """The sag that a build has in sag.csv; None where it was not worked out.

    InputError: a file of the prototype is missing, cannot be read, or is of another prototype.
    """
    record = Prototype.read(folder / NAME)
    if not (folder / SagRow.FILE).is_file():
        return None
    balls, stops, rows = BallRow.read(folder), StopRow.read(folder), SagRow.read(folder)
    shape = len(stops), len(balls)
    if [(row.stop, row.ball) for row in rows] != [(s + 1, k + 1) for s, k in np.ndindex(shape)]:
        raise InputError(
            f"{folder / SagRow.FILE} has not a row for each of {shape[0]} stops and {shape[1]} "
            "balls, in order: build the export again"
        )
    angle = np.radians([row.base_angle_deg for row in stops])
    axes = np.array([record.frame.axis, record.frame.zero, record.frame.third])
    moved = np.array([[getattr(row, one) for one in SagRow.columns()[2:]] for row in rows])
    parts = moved.reshape(*shape, len(PARTS), 3).transpose(2, 0, 1, 3) @ axes.T
    turned = rotated_about_x(parts, -angle[:, None])
    centre = np.array([[ball.bx, ball.by, ball.bz] for ball in balls]) @ axes.T
    return Sag(angle, centre, axes, dict(zip(PARTS, turned, strict=True)))


@dataclass(frozen=True)
class WeighedBase:
    """What a base, its weight and what holds it are, in the base's frame at angle zero."""

    axes: Floats  # of that frame in the shell's, as rows, (3, 3)
    angle: Floats  # of the base at each stop, radians, (s,)
    bodies: Bodies
    carrier: list[Trimesh]  # its pieces, the one with the hub first
    load: tuple[Floats, float]  # centre of gravity of all that turns, mm, (3,), and mass, g
    solids: dict[str, Trimesh]  # bearing head, shaft, bearings and uprights
    screws: list[Axle]  # that hold the head on the uprights
    material: Material  # of carrier and head


def weighed_base(built: PrototypeModel, meshes: list[ColouredMesh]) -> WeighedBase | None:
    """Of a prototype with meshes of its bodies; None with a drive that has no shaft of its own.

    No list says how stiff the bearings of a rotary stage are.
    """
    layout, printer, balance = built.layout, built.spec.printer, built.balance
    axes, balls = balance.frame, ball_masses(built.layout)
    shown = {one.name: one.mesh for one in meshes}
    carrier = [p.name for p in built.printed if p.role == "base" and p.name != "zero_disc"]
    if "shaft" not in shown:
        return None
    solids = {
        name: Trimesh(shown[name].vertices @ axes.T, shown[name].triangles)
        for name in (*carrier, "shaft", "bearing_head", *UPRIGHTS, *BEARINGS)
    }
    return WeighedBase(
        axes=axes,
        angle=layout.stops.angle,
        bodies=Bodies(balls.centre @ axes.T, layout.balls.body_radius, balls.mass_g),
        carrier=[solids[name] for name in carrier],
        load=(axes @ balance.centre, balance.mass_g),
        solids=solids,
        screws=_screws(built.fasteners, axes),
        material=Material(printer.modulus_gpa, printer.density_g_cm3, printer.infill),
    )


def write_sag(folder: Path, base: WeighedBase) -> None:
    """Write sag.csv."""
    write_table(folder / SagRow.FILE, SagRow.columns(), list(sag_of(base).rows()))


def sag_of(base: WeighedBase) -> Sag:
    """The sag of the balls of a base."""
    hub, shaft = base.carrier[0].bounds[0, 0], base.solids["shaft"]
    held = Axle(X * hub, X * shaft.bounds[1, 0], _shaft_radius(base.solids))
    carrier = sag_of_bodies(concatenate(base.carrier), base.bodies, held, base.material)
    sag = Sag(base.angle, base.bodies.centre, base.axes, {})
    of = {"carrier": np.einsum("kag,sg->ska", carrier, sag.gravity)}
    turns = base.angle, -base.axes[:, 2]
    for name, flexible in _holding(base, held.start).items():
        of[name] = moved_by(flexible, held.start, base.bodies.centre, base.load, turns)
    return Sag(base.angle, base.bodies.centre, base.axes, of)


def _shaft_radius(solids: dict[str, Trimesh]) -> float:
    return float(np.ptp(solids["shaft"].bounds[:, 1]) / 2)


def _holding(base: WeighedBase, hub: Floats) -> dict[str, Floats]:
    """Compliances at the hub of head, shaft and uprights, (6, 6) each, in the base's frame."""
    solids = base.solids
    middle = {name: solids[name].bounds[:, 0].mean() for name in BEARINGS}
    front, rear = (X * middle[name] for name in BEARINGS)
    inertia = math.pi / 4 * _shaft_radius(solids) ** 4
    shaft = shaft_compliance(hub[0] - front[0], front[0] - rear[0], STEEL * MPA_PER_GPA * inertia)
    loaded = [_round(solids[name]) for name in BEARINGS]
    head = compliance(solids["bearing_head"], front, base.screws, loaded, base.material)
    return {
        "head": moved_to(head, hub - front),
        "shaft": shaft,
        "uprights": _uprights(solids, base.axes, hub),
    }


def _round(bearing: Trimesh) -> Axle:
    """Outside of a bearing, which its seat is round."""
    low, high = bearing.bounds
    return Axle(X * low[0], X * high[0], float(high[1]))


def _screws(fasteners: Iterable[Fastener], axes: Floats) -> list[Axle]:
    """Round the screws that hold the head on the uprights."""
    held = [one for one in fasteners if "bearing_head" in one.through]
    held = [one for one in held if not set(UPRIGHTS).isdisjoint(one.through)]
    places = [(axes @ one.place, axes @ one.along) for one in held]
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
