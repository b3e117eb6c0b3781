"""The section [prototype.motion] of the design: how the base is driven from stop to stop."""

from typing import Literal

from pydantic import Field

from tbcad.spec.section import Section


class MotionSpec(Section):
    """How the base is driven from stop to stop, and what the controller is told."""

    axis: Literal["X", "A"] = "X"
    """Axis of the controller: X with a degree for a millimetre (GRBL 1.1 has X, Y and Z only),
    or A in degrees (grblHAL and others)."""
    trigger: Literal["coolant", "pause"] = "coolant"
    """What takes a photograph: a relay on the coolant output (M8, M9), or a person (M0)."""
    home_deg: float = Field(0.0, ge=-180, le=180)
    """Base angle at which the program is started: at the base's mark, or after homing."""
    approach_deg: float = Field(1.0, ge=0, le=30)
    """How far below its first stop the base starts, so that all are reached from one side."""
    feed_deg_min: float = Field(900.0, ge=1, le=100000)
    """Speed of the base."""
    acceleration_deg_s2: float = Field(50.0, gt=0, le=10000)
    """Acceleration of the base; the motor is chosen for it."""
    settle_s: float = Field(0.5, ge=0, le=60)
    """Rest at a stop before a photograph."""
    trigger_s: float = Field(0.2, gt=0, le=60)
    """How long the relay is on."""
    exposure_s: float = Field(1.0, ge=0, le=600)
    """Rest after the relay, while the camera exposes and saves."""
    microsteps: int = Field(16, ge=1, le=256)
    """Microsteps of the motor's driver to a full step."""
    safety: float = Field(2.0, ge=1, le=10)
    """Holding torque of the motor over the greatest torque of gravity and acceleration: for
    friction, and for what a stepper loses between full steps and at speed."""
