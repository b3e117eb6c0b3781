"""Which steps there are, in order: what each mounts, and its words."""

from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase

from tbcad.prototype.assembly_steps import words_base, words_frame, words_rest
from tbcad.prototype.assembly_steps.machine import RESISTORS, Machine, Text


@dataclass(frozen=True)
class Plan:
    """A step as it is planned for all designs."""

    key: str  # name for files
    title: str  # of the step
    text: Callable[[Machine], Text]  # its words for a prototype
    bodies: tuple[str, ...] = ()  # patterns of names of the bodies that it mounts
    loose: tuple[str, ...] = ()  # parts, or kinds of them, without bodies that it takes
    near: tuple[str, ...] = ()  # bodies that the picture shows, too
    always: bool = False  # whether it is needed without any of its bodies

    def needed(self, machine: Machine) -> bool:
        """Whether a prototype has any of its bodies, or needs it always."""
        return self.always or any(
            fnmatchcase(body, pattern) for body in machine.bodies for pattern in self.bodies
        )


PLANS = (
    Plan("coupon", "Try the seats", words_base.coupon, ("coupon_*",)),
    Plan(
        "shop",
        "Drill the plate, cut the uprights",
        words_frame.shop,
        ("plate",),
    ),
    Plan(
        "carrier",
        "The carrier",
        words_base.carrier,
        ("carrier", "carrier_*"),
        ("GLUE-EPOXY",),
    ),
    Plan("caps", "Make the caps", words_base.caps, ("cap_*",)),
    Plan(
        "frame",
        "Feet and uprights on the plate",
        words_frame.frame,
        ("upright_*",),
    ),
    Plan("head", "Bearing head on the uprights", words_frame.head, ("bearing_*",)),
    Plan("table", "Rotary stage on the head", words_frame.table, ("rotary_stage*",)),
    Plan(
        "hub",
        "Zero disc on the hub",
        words_base.hub,
        ("zero_disc", "wheel", "coupling"),
    ),
    Plan(
        "shaft",
        "Base on its shaft",
        words_frame.shaft,
        ("shaft", "collar"),
        ("belts",),
        near=("carrier", "carrier_*", "bearing_head", "wheel"),
    ),
    Plan("motor", "Motor", words_frame.motor, ("motor", "pinion"), near=("wheel",)),
    Plan(
        "homing",
        "Switch and zero pin",
        words_frame.homing,
        ("home_*",),
        ("shafts",),
        ("zero_disc",),
    ),
    Plan("lamps", "Lamps", words_rest.lamps, ("lamp_*",), ("strips",), ("plate",)),
    Plan("stage", "Object stage", words_rest.stage, ("stage_*",), ("WIRE-28", "WIRE-30")),
    Plan(
        "camera",
        "Bracket, plate and fence of the camera",
        words_rest.camera,
        ("camera_bracket", "camera_plate", "camera_fence", "camera"),
    ),
    Plan(
        "wiring",
        "Wiring",
        words_rest.wiring,
        loose=("electronics", "wires", "connectors", RESISTORS),
        always=True,
    ),
    Plan("zero", "Angle zero", words_rest.zero, always=True),
    Plan("gauge", "Camera in its place", words_rest.gauge, ("camera_gauge",), near=("carrier",)),
    Plan("balls", "Balls into their seats", words_base.balls, ("ball_*",), near=("carrier",)),
    Plan("shroud", "Shroud", words_rest.shroud, ("shroud_*",), ("sheets",)),
    Plan("first", "First photographs", words_rest.first, always=True),
)
