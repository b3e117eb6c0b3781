"""The camera's place in its mount: its own axes, where plate, screws and fence are along them.

Lengths are behind the pinhole along the optical axis, across, and out from the axis.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tbcad.core.geometry.primitives import Primitive, Prism, box, cylinder_between, slot
from tbcad.core.geometry.vectors import unit
from tbcad.core.optics.camera import Camera
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.frame.chosen_camera import ChosenCamera, plate_face
from tbcad.prototype.frame.shared import CLEARANCE_HOLE_MM
from tbcad.prototype.purchased.parts import PurchasedPart
from tbcad.types import Floats

M5_MM, M5_HOLE_MM = 5.0, CLEARANCE_HOLE_MM[5.0]
TRIPOD_HOLE_MM = CLEARANCE_HOLE_MM[6.35]
YAW_DEG = 3.0  # to either side
# The camera plate.
TOP_MM = 12.0  # of plate and bracket behind the pinhole
PLATE_MM = 12.0  # thickness
GAP_MM = 14.0  # between plate and bracket: two nuts and a washer at the nearest
UPPER_MM, LOWER_MM, PAIR_MM = 12.0, 72.0, 13.0  # of the three screws: from the top, half distance
RECESS_BEYOND_MM = 5.0  # of the recess beyond the head
PLATE_END_MM = 5.0  # of the plate beyond the fence's slots
# The fence.
FENCE_MM, FENCE_HEIGHT_MM, FENCE_HALF_MM = 12.0, 14.0, 28.0
FENCE_LIP_MM = 6.0  # least height of the fence at the camera's back
FENCE_SCREW_MM = 20.0  # from the middle to its screws


@dataclass(frozen=True)
class MountPlace:
    """Where the camera is, the frame's axes as rows (3, 3), and the insert of the three screws."""

    spec: PrototypeSpec
    axes: Floats
    camera: Camera
    insert: PurchasedPart
    chosen: ChosenCamera | None

    @cached_property
    def own(self) -> Floats:
        """Rows: behind the pinhole along the optical axis, across, out from it, (3, 3)."""
        back = -self.camera.forward
        level = self.axes[0]
        return np.stack([back, self.axes[1], unit(level - (level @ back) * back)])

    @property
    def axis(self) -> float:
        """Out to what the camera stands on."""
        return float(self.spec.frame.camera_axis_mm)

    @property
    def radius(self) -> float:
        """Out to the camera plate; between this and the axis is the fence's step."""
        return plate_face(self.axis, self.chosen.lens_radius) if self.chosen else self.axis

    @property
    def riser(self) -> float:
        """Height of the fence's step; 0 without."""
        return self.radius - self.axis

    @property
    def back(self) -> float:
        """Behind the pinhole to the camera's back."""
        return float(self.spec.frame.camera_back_mm)

    @property
    def tripod(self) -> float:
        """Behind the pinhole to the tripod thread."""
        return float(self.spec.frame.camera_screw_mm)

    @property
    def fence_height(self) -> float:
        """From the camera plate to the fence's edge."""
        return max(FENCE_HEIGHT_MM, self.riser + FENCE_LIP_MM)

    @property
    def bracket_at(self) -> float:
        """Out to the bracket's face."""
        return self.radius + PLATE_MM + GAP_MM

    @property
    def along(self) -> float:
        """Travel of the camera along its axis to either side."""
        return self.spec.frame.camera_travel_mm / 2

    @property
    def fence_screws(self) -> float:
        """Behind the pinhole to the fence's screws."""
        return self.back + FENCE_MM / 2

    @property
    def fence_travel(self) -> float:
        """Of the fence's slots to either side: that of the camera, and what yaw needs."""
        return self.along + FENCE_SCREW_MM * float(np.tan(np.radians(YAW_DEG)))

    @property
    def plate_end(self) -> float:
        """Behind the pinhole to the camera plate's end."""
        fence = self.fence_screws + self.fence_travel + M5_HOLE_MM / 2
        lowest = float(self.screws[-1, 0]) + self.insert["outer_mm"] / 2
        return max(fence, lowest) + PLATE_END_MM

    @property
    def recess(self) -> float:
        """Half length of the recess for the tripod screw's head."""
        return self.along + TRIPOD_HOLE_MM + RECESS_BEYOND_MM

    @property
    def window(self) -> float:
        """Half length of the window for its key."""
        return self.along + TRIPOD_HOLE_MM / 2

    @property
    def screws(self) -> Floats:
        """Places (3, 2) of the three screws: behind the pinhole, and across."""
        upper = TOP_MM + UPPER_MM
        beyond = self.tripod + self.recess + self.insert["outer_mm"]
        lower = max(TOP_MM + LOWER_MM, beyond)
        return np.array([[upper, -PAIR_MM], [upper, PAIR_MM], [lower, 0.0]])

    def point(self, back: float, across: float, out: float) -> Floats:
        """A point (3,) of the camera's own axes, in the frame of the shell."""
        return np.asarray(self.camera.pinhole + np.array([back, across, out]) @ self.own)

    def block(self, low: tuple[float, float, float], high: tuple[float, float, float]) -> Prism:
        """A box between two points of the camera's own axes."""
        local = box(low, high, self.own)
        return Prism(local.corners + self.camera.pinhole, local.along)

    def hole(self, back: float, across: float, out: tuple[float, float], size: float) -> Primitive:
        """A hole of a diameter out from the axis, between two distances."""
        start, end = (self.point(back, across, one) for one in out)
        return cylinder_between(start, end, size / 2)

    def slot(
        self, place: tuple[float, float], along: int, travel: float, out: tuple[float, float]
    ) -> Primitive:
        """A slot of M5 about a place, along one of the own axes, with a travel to either side."""
        start = self.point(*place, out[0])
        depth = (out[1] - out[0]) * self.own[2]
        return slot(start, self.own[along], 2 * travel, M5_HOLE_MM / 2, depth)
