"""The whole prototype: its layouts, its printed parts as solids, and the drive that turns them."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from tbcad.cad.solids import centroid
from tbcad.geometry.primitives import Component
from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.base.cap_solids import cap_magnets, cap_parts
from tbcad.prototype.base.coupon import coupon_plates
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.purchased import base_purchased_parts
from tbcad.prototype.base.solid import carrier_parts
from tbcad.prototype.base.split import BaseSplit, split_base
from tbcad.prototype.drive.balance import BaseBalance, PointMasses, ball_masses, sum_masses
from tbcad.prototype.drive.drive import Drive, choose_drive, load_drives
from tbcad.prototype.frame.layout import FrameLayout, frame_layout, frame_purchased_parts
from tbcad.prototype.keepout import keep_out_volume
from tbcad.prototype.printing.component_solids import placed_component
from tbcad.prototype.printing.parts import PrintedPart, Role
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.purchased.parts import Parts, load_parts
from tbcad.prototype.stage.layout import StageLayout, stage_layout
from tbcad.spec.printer import PrinterSpec
from tbcad.spec.prototype import PrototypeSpec
from tbcad.types import Progress

CARRIER_PURPOSE = "carrier of the balls, turns about the axis"
COUPON_PURPOSE = "seats to try the fit of the balls before the base is printed"


@dataclass(frozen=True)
class PrototypeModel:
    """All of the prototype.

    Attributes:
        layout: balls, their places, the plan of the stops.
        base: layout of the carrier.
        split: how the carrier is cut to fit the bed.
        stage: layout of the object stage.
        frame: layout of what holds stage, base and camera.
        printed: all printed parts.
        balance: of what turns with the base.
        drive: that turns it.
        parts: lists of purchased parts.
        capture_radius: of the capture sphere, mm.
    """

    layout: PrototypeLayout
    base: BaseLayout
    split: BaseSplit
    stage: StageLayout
    frame: FrameLayout
    printed: tuple[PrintedPart, ...]
    balance: BaseBalance
    drive: Drive
    parts: Parts
    capture_radius: float

    @property
    def purchased(self) -> dict[str, int]:
        """Quantity of purchased parts by name, without balls and drive."""
        counts = Counter(base_purchased_parts(self.base, self.split))
        counts.update(cap_magnets(self.base, self.layout, self.parts))
        counts.update(frame_purchased_parts(self.frame))
        counts[self.stage.led.name] += len(self.stage.leds)
        return counts


def build_prototype_model(
    design: MirrorDesign, progress: Progress = lambda _: None
) -> PrototypeModel:
    """Lay out the prototype of a design, choose its drive and build its solids.

    Raises:
        SpecError: when something does not fit; it says what to change.
        InvalidSolidError: when the kernel fails.
    """
    spec, printer, parts = design.spec.prototype, design.spec.printer, load_parts()
    capture_radius = design.spec.optics.capture_diameter_mm / 2
    progress("prototype: balls, their places, stops")
    layout = prototype_layout(design.spec, design)
    base = base_layout(spec.base, layout)
    progress("prototype: base")
    split = split_base(base, printer)
    carrier = carrier_parts(base, split, printer)
    density = printer.density_g_cm3
    balance = sum_masses(base.frame, ball_masses(layout, density), _masses(carrier, density))
    drive = _drive(layout, balance, spec, parts)
    progress("prototype: stage and frame")
    approach = float(np.radians(spec.motion.approach_deg))
    keep_out = keep_out_volume(layout, base, capture_radius, approach)
    stage = stage_layout(spec, layout, keep_out, parts)
    frame = frame_layout(spec, layout, base, stage, drive, keep_out, parts)
    static = [
        *_components("stage", stage.components, printer),
        *_components("frame", frame.printed, printer),
    ]
    progress("prototype: caps and coupon")
    printed = (
        *(PrintedPart(part, "base", CARRIER_PURPOSE) for part in carrier),
        *_caps(base, layout),
        *static,
        *(PrintedPart(part, "tool", COUPON_PURPOSE) for part in coupon_plates(base, printer)),
    )
    return PrototypeModel(
        layout=layout,
        base=base,
        split=split,
        stage=stage,
        frame=frame,
        printed=printed,
        balance=balance,
        drive=drive,
        parts=parts,
        capture_radius=capture_radius,
    )


def _drive(
    layout: PrototypeLayout, balance: BaseBalance, spec: PrototypeSpec, parts: Parts
) -> Drive:
    acceleration = float(np.radians(spec.motion.acceleration_deg_s2))
    torque = balance.required_torque(*layout.stops.range, acceleration, spec.motion.safety)
    return choose_drive(spec.base.drive, torque, load_drives(parts))


def _masses(parts: list[PlacedSolid], density: float) -> PointMasses:
    mass = [part.mass_g(density) for part in parts]
    return PointMasses(np.array(mass), np.array([centroid(part.shape) for part in parts]))


def _caps(base: BaseLayout, layout: PrototypeLayout) -> Iterator[PrintedPart]:
    balls = np.flatnonzero(layout.balls.cap).tolist()
    for ball, part in zip(balls, cap_parts(base, layout), strict=True):
        purpose = f"stands in for ball {ball + 1}, which is too large to buy"
        yield PrintedPart(part, "cap", purpose, ball)


def _components(
    role: Role, components: Iterable[Component], printer: PrinterSpec
) -> Iterator[PrintedPart]:
    for component in components:
        yield PrintedPart(placed_component(component, printer), role, component.what)
