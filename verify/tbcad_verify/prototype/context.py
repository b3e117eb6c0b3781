"""The export from the prototype's side: its record, its camera, and the mirrors it serves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tbcad_verify.prototype import axis
from tbcad_verify.record.export import Camera, Export
from tbcad_verify.record.poses import HALVED
from tbcad_verify.record.prototype import Prototype
from tbcad_verify.report.checks import Unknown
from tbcad_verify.types import Floats, Ints


@dataclass(frozen=True)
class PrototypeContext:
    """One export with a prototype.

    Attributes:
        export: all of it.
        prototype: its's record.
    """

    export: Export
    prototype: Prototype

    @property
    def camera(self) -> Camera:
        """The camera that the prototype serves."""
        return self.export.cameras[self.prototype.camera]

    @property
    def pinhole(self) -> Floats:
        """(3,) mm."""
        return self.camera.pinhole

    @property
    def semi_minor(self) -> float:
        """Of the ellipsoid, mm."""
        return float(self.export.spec["optics"]["semi_minor_mm"])

    @property
    def radius(self) -> float:
        """Of the capture sphere, mm."""
        return self.export.target_mm / 2

    @cached_property
    def frame(self) -> Floats:
        """(3, 3) rows axis, azimuth zero, third: from the camera, not from the record."""
        return axis.frame_of(self.pinhole)

    @cached_property
    def mine(self) -> Ints:
        """(m,) rows of mirrors.csv that are this camera's mirrors."""
        return np.flatnonzero(self.export.mirrors.camera == self.prototype.camera)

    @cached_property
    def halved(self) -> NDArray[np.bool_]:
        """(m,) mirrors that the seam cuts."""
        return np.asarray(np.abs(self.export.mirrors.ux[self.mine]) < HALVED)

    @cached_property
    def pictures(self) -> Ints:
        """(m,) row of the plan that shows each of this camera's mirrors, the object not turned.

        Raises:
            Unknown: a mirror has none, or a row names a ball or stop that there is not.
        """
        plan, ids = self.prototype.plan, self.export.mirrors.ids
        straight = np.flatnonzero(plan.turn == 0).tolist()
        row = {plan.mirror[k]: k for k in straight}
        missing = [ids[k] for k in self.mine.tolist() if ids[k] not in row]
        if missing:
            raise Unknown(f"the plan shows no {missing[0]} ({len(missing)} mirrors missing)")
        found = np.array([row[ids[k]] for k in self.mine.tolist()], dtype=np.int64)
        if not (
            (plan.ball[found] >= 1).all() and (plan.ball[found] <= len(self.prototype.balls)).all()
        ):
            raise Unknown("the plan names balls that there are not")
        return found

    @property
    def ball(self) -> Ints:
        """(m,) ball that stands in for each mirror, from 0."""
        return self.prototype.plan.ball[self.pictures] - 1

    @property
    def angle(self) -> Floats:
        """(m,) base angle at which it does, radians."""
        return np.radians(self.prototype.plan.angle[self.pictures])
