"""A build as the prototype's checks use it: its record, its camera, and the mirrors it serves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad_verify.mesh.vectors import axis_frame
from tbcad_verify.record.export import Camera, Export
from tbcad_verify.record.poses import ON_SEAM
from tbcad_verify.record.prototype import Prototype
from tbcad_verify.report.checks import Unknown, require
from tbcad_verify.types import Bools, Floats, Ints

# Of what caps are made of, g/cm^3: cured resins 1.15 to 1.2; aluminium alloys 2.70 (EN 573-3).
CAP_DENSITIES = {"printed": 1.18, "turned": 2.70, "none": 0.0}

OTHER_SAG = "sag.csv has other stops or balls"


@dataclass(frozen=True)
class PrototypeContext:
    """One build with a prototype."""

    export: Export  # the whole record
    prototype: Prototype  # the record of the prototype

    @property
    def camera(self) -> Camera:
        """The camera that the prototype serves."""
        return self.export.cameras[self.prototype.camera]

    @property
    def pinhole(self) -> Floats:
        """(3,) mm."""
        return self.camera.pinhole

    @property
    def radius(self) -> float:
        """Radius of the capture sphere, mm."""
        return self.export.target_mm / 2

    @property
    def moved(self) -> bool:
        """Whether pictures are moved along with their balls when they are merged."""
        return self.export.spec.prototype.picture == "moved"

    @cached_property
    def frame(self) -> Floats:
        """(3, 3) rows axis, azimuth zero, third: from the camera, not from the record."""
        return axis_frame(self.pinhole)

    def base_rotation(self, angle: Floats) -> Rotation:
        """Rotations of the base by angles (N,), radians: from its own frame to the ground's."""
        return Rotation.from_rotvec(angle[:, None] * self.frame[0])

    @cached_property
    def mirror_rows(self) -> Ints:
        """(m,) rows of mirrors.csv that are this camera's mirrors."""
        return np.flatnonzero(self.export.mirrors.camera == self.prototype.camera)

    @property
    def mirror_ids(self) -> list[str]:
        """Ids of the m mirrors."""
        return [self.export.mirrors.ids[k] for k in self.mirror_rows.tolist()]

    @cached_property
    def halved(self) -> Bools:
        """(m,) mirrors that the seam cuts."""
        return np.asarray(np.abs(self.export.mirrors.ux[self.mirror_rows]) < ON_SEAM)

    @cached_property
    def plan_rows(self) -> Ints:
        """(m,) row of the plan that shows each of this camera's mirrors, the object at 0 degrees.

        Unknown: a mirror has none, or a row names a ball that does not exist.
        """
        plan, ids = self.prototype.plan, self.mirror_ids
        row = {plan.mirror[k]: k for k in np.flatnonzero(plan.turn == 0).tolist()}
        missing = [name for name in ids if name not in row]
        if missing:
            raise Unknown(f"the plan shows no {missing[0]} ({len(missing)} mirrors missing)")
        rows = np.array([row[name] for name in ids], dtype=np.int64)
        if not np.isin(plan.ball[rows], 1 + np.arange(len(self.prototype.balls))).all():
            raise Unknown("the plan names balls that do not exist")
        return rows

    @property
    def level_axes(self) -> Floats:
        """(3, 3) rows: level under the base's axis, across it, up."""
        w, up = self.frame[0], np.array([0.0, 0.0, 1.0])
        level = np.array([w[0], w[1], 0.0]) / np.hypot(w[0], w[1])
        return np.stack([level, np.cross(up, level), up])

    @cached_property
    def masses_g(self) -> Floats:
        """(K,) of balls, and of caps without their magnets' pockets.

        A cap is a ball whose front is replaced from a half angle of 45 degrees on by the flatter
        sphere; where the front is not flatter, nothing is replaced. By revolution about the normal.
        """
        balls, density = self.prototype.balls, CAP_DENSITIES[self.export.spec.prototype.caps]
        body, front = balls.body_radius_mm, balls.radius_mm
        edge = np.minimum(np.where(body < front, body / np.sqrt(2), body), front)
        height = np.sqrt(body**2 - edge**2)  # from the body's centre, of where both spheres meet
        behind = np.pi * (2 * body**3 / 3 + body**2 * height - height**3 / 3)
        rise = front - np.sqrt(front**2 - edge**2)
        volume = behind + np.pi * rise * (3 * edge**2 + rise**2) / 6
        return np.where(balls.cap, volume * density / 1000, balls.mass_g)

    @property
    def ball(self) -> Ints:
        """(m,) ball that substitutes for each mirror, from 0."""
        return self.prototype.plan.ball[self.plan_rows] - 1

    @property
    def angle(self) -> Floats:
        """(m,) base angle at which it does, radians."""
        return np.radians(self.prototype.plan.angle[self.plan_rows])

    @property
    def stop(self) -> Ints:
        """(m,) stop at which it does, from 0. Unknown: there is no such stop."""
        stop = self.prototype.plan.stop[self.plan_rows] - 1
        if ((stop < 0) | (stop >= len(self.prototype.stops))).any():
            raise Unknown("the plan names stops that do not exist")
        return stop

    @property
    def sag_at_stops(self) -> Floats:
        """(S, K, 3) displacements of the balls at the stops by weight, in the ground's frame, mm.

        Those of sag.csv, else the means. Unknown: they are of other stops or balls.
        """
        told, stops = self.told_sag, self.prototype.stops
        if told is None:
            turns = self.base_rotation(np.radians(stops.angle)).as_matrix()
            return np.asarray(self.prototype.balls.sag.T @ turns.swapaxes(1, 2))
        return np.asarray(told[:4].sum(axis=0))

    @cached_property
    def told_sag(self) -> Floats | None:
        """(5, S, K, 3) of sag.csv, in the ground's frame: see `SagTable.moved`; None without it.

        Unknown: it is of other stops or balls.
        """
        sag, shape = self.prototype.sag, (len(self.prototype.stops), len(self.prototype.balls), 3)
        return None if sag is None else require(sag.moved(shape), OTHER_SAG)
