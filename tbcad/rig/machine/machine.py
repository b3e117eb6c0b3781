"""One machine: a camera, spheres that rotate about an axis, and LEDs that rest.

Everything is in the frame of the design (mm, z up, the object's centre at the origin). A machine's
frames are its photographed positions: one for each stop of each run of the base. The object is
turned between both runs; camera, axis and LEDs are not. The shell of one camera is a machine with
one frame, whose spheres are its mirrors.
"""

from dataclasses import dataclass, replace

import numpy as np

from tbcad.core.geometry.rotations import rotated
from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.reflection import reflection_points
from tbcad.types import Floats, Ints


@dataclass(frozen=True)
class Machine:
    """The state of a machine with k spheres, f frames and l LEDs."""

    camera: LensCamera
    axis: Floats  # unit vector of the axis that the base rotates about, (3,)
    axis_point: Floats  # a point of the axis, mm, (3,)
    angle: Floats  # of the base in each frame, radians, (f,)
    centre: Floats  # of the reflecting spheres at base angle zero, mm, (k, 3)
    radius: Floats  # of the reflecting spheres, mm, (k,)
    leds: Floats  # where each LED shines from, mm, (l, 3)
    # of the base in each frame, beside its rotation, mm, (f, 3); None for nowhere
    shift: Floats | None = None

    def centres(self, frame: Ints, sphere: Ints) -> Floats:
        """Centres of spheres (n,) in frames (n,), mm, (n, 3)."""
        turned = rotated(self.centre[sphere] - self.axis_point, self.axis, self.angle[frame])
        placed = np.asarray(self.axis_point + turned)
        return placed if self.shift is None else placed + self.shift[frame]

    def of_frames(self, frames: Ints) -> "Machine":
        """The same machine in some of its frames (g,)."""
        shift = None if self.shift is None else self.shift[frames]
        return replace(self, angle=self.angle[frames], shift=shift)

    def moved(self, shift: Floats) -> "Machine":
        """The same machine as a whole elsewhere, by a shift in mm, (3,)."""
        return replace(
            self,
            camera=replace(self.camera, pinhole=self.camera.pinhole + shift),
            axis_point=self.axis_point + shift,
            centre=self.centre + shift,
            leds=self.leds + shift,
        )

    def highlights(self, frame: Ints, sphere: Ints, led: Ints) -> Floats:
        """Columns and rows (n, 2) at which spheres show LEDs in frames, each (n,), from 0."""
        centre, camera = self.centres(frame, sphere), self.camera
        points = reflection_points(centre, self.radius[sphere], self.leds[led], camera.pinhole)
        return camera.project(points)


@dataclass(frozen=True)
class Highlights:
    """Measured reflections of LEDs in spheres, over n of them."""

    frame: Ints  # from 0, (n,)
    sphere: Ints  # from 0, (n,)
    led: Ints  # from 0, (n,)
    pixel: Floats  # column and row; whole numbers are pixel centres, (n, 2)
    sigma: Floats  # standard deviation of column and of row, pixels, (n,)

    def __len__(self) -> int:
        return len(self.frame)
