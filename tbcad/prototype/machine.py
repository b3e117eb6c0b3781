"""The prototype built: its numbers, its printed parts as solids, and the drive that turns them."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbcad.cad.solids import centroid
from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.balls.layout import PrototypeLayout, prototype_layout
from tbcad.prototype.base.cap_solids import cap_magnets, cap_parts
from tbcad.prototype.base.coupon import coupon_plates
from tbcad.prototype.base.layout import BaseLayout, base_layout
from tbcad.prototype.base.purchased import base_purchased_parts as bought_for_base
from tbcad.prototype.base.solid import carrier_parts
from tbcad.prototype.base.split import BaseSplit, split_base
from tbcad.prototype.drive.balance import BaseBalance, PointMasses, ball_masses, sum_masses
from tbcad.prototype.drive.drive import Drive, choose_drive, load_drives
from tbcad.prototype.frame import frame_solids as frames
from tbcad.prototype.frame.layout import FrameLayout, bought_parts, frame
from tbcad.prototype.keepout import room
from tbcad.prototype.printing.parts import PrintedPart
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.purchased.parts import Parts, load_parts
from tbcad.prototype.stage import stage_solids as stages
from tbcad.prototype.stage.layout import StageLayout, stage
from tbcad.spec.printer import PrinterSpec
from tbcad.spec.prototype import PrototypeSpec
from tbcad.types import Progress


@dataclass(frozen=True)
class Machine:
    """All of the prototype.

    Attributes:
        made: balls, their places, the plan.
        base: the carrier's numbers.
        plan: how it is cut to fit the bed.
        stage: the object stage's.
        frame: of what holds stage, base and camera.
        pieces: all printed parts.
        balance: of what turns.
        drive: that turns it.
        parts: lists of purchased parts.
        target: diameter of the capture sphere, mm.
    """

    made: PrototypeLayout
    base: BaseLayout
    plan: BaseSplit
    stage: StageLayout
    frame: FrameLayout
    pieces: tuple[PrintedPart, ...]
    balance: BaseBalance
    drive: Drive
    parts: Parts
    target: float

    @property
    def swing(self) -> tuple[float, float]:
        """Least and largest base angle, radians."""
        return _swing(self.made)

    @property
    def bought(self) -> dict[str, int]:
        """Quantity of purchased parts by name, without balls, drive and LEDs."""
        for_base = Counter(bought_for_base(self.base, self.plan))
        in_caps = Counter(cap_magnets(self.base, self.made, self.parts))
        around = Counter(bought_parts(self.frame, self.stage))
        return dict(sorted((for_base + in_caps + around).items()))


def machine(design: MirrorDesign, progress: Progress = lambda _: None) -> Machine:
    """MirrorDesign and build the prototype.

    Raises:
        SpecError: when something does not fit; it says what to change.
        InvalidSolidError: when the kernel fails.
    """
    keys, printer, parts = design.spec.prototype, design.spec.printer, load_parts()
    target = design.spec.optics.capture_diameter_mm
    progress("prototype: balls, their places, stops")
    made = prototype_layout(design.spec, design)
    numbers = base_layout(keys.base, made)
    progress("prototype: base")
    plan = split_base(numbers, printer)
    turning = carrier_parts(numbers, plan, printer)
    density = printer.density_g_cm3
    summed = sum_masses(numbers.frame, ball_masses(made, density), _load(turning, density))
    drive = _drive(made, summed, keys, parts)
    progress("prototype: stage and frame")
    left = room(made, numbers, target / 2, float(np.radians(keys.motion.approach_deg)))
    held = stage((keys.stage, keys.frame, keys), made, left, parts)
    round_it = frame((keys.frame, keys), made, numbers, held, drive, left, parts)
    still = (*_stages(held, printer), *_frames(round_it, printer))
    progress("prototype: caps and coupon")
    pieces = (*_bases(turning), *_caps(numbers, made), *still, *_tools(numbers, printer))
    return Machine(made, numbers, plan, held, round_it, pieces, summed, drive, parts, target)


def _swing(made: PrototypeLayout) -> tuple[float, float]:
    return float(made.stops.angle.min()), float(made.stops.angle.max())


def _drive(made: PrototypeLayout, summed: BaseBalance, keys: PrototypeSpec, parts: Parts) -> Drive:
    acceleration = float(np.radians(keys.motion.acceleration_deg_s2))
    needed = summed.required_torque(*_swing(made), acceleration, keys.motion.safety)
    return choose_drive(keys.base.drive, needed, load_drives(parts))


def _load(parts: list[PlacedSolid], density: float) -> PointMasses:
    mass = [part.mass_g(density) for part in parts]
    return PointMasses(np.array(mass), np.array([centroid(part.shape) for part in parts]))


def _bases(parts: list[PlacedSolid]) -> Iterator[PrintedPart]:
    for part in parts:
        yield PrintedPart(part, "base", "carrier of the balls, turns about the axis")


def _caps(numbers: BaseLayout, made: PrototypeLayout) -> Iterator[PrintedPart]:
    own = np.flatnonzero(made.balls.cap).tolist()
    for k, part in zip(own, cap_parts(numbers, made), strict=True):
        yield PrintedPart(part, "cap", f"stands in for ball {k + 1}, which is too large to buy", k)


def _stages(held: StageLayout, printer: PrinterSpec) -> Iterator[PrintedPart]:
    for item, part in zip(held.items, stages.parts(held, printer), strict=True):
        yield PrintedPart(part, "stage", item.what)


def _frames(round_it: FrameLayout, printer: PrinterSpec) -> Iterator[PrintedPart]:
    for item, part in zip(round_it.printed, frames.parts(round_it, printer), strict=True):
        yield PrintedPart(part, "frame", item.what)


def _tools(numbers: BaseLayout, printer: PrinterSpec) -> Iterator[PrintedPart]:
    for part in coupon_plates(numbers, printer):
        yield PrintedPart(
            part, "tool", "seats to try the fit of the balls before the base is printed"
        )
