"""The prototype built: its numbers, its printed parts as solids, and the drive that turns them."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tbcad.cad.solids import centroid
from tbcad.mirrors.array import Design
from tbcad.prototype.balls.layout import Prototype, prototype
from tbcad.prototype.base.cap_solids import caps, magnets
from tbcad.prototype.base.coupon import coupon
from tbcad.prototype.base.layout import BaseLayout, base
from tbcad.prototype.base.purchased import bought as bought_for_base
from tbcad.prototype.base.solid import carrier
from tbcad.prototype.base.split import Split, split
from tbcad.prototype.drive.balance import Balance, Load, balance, ball_load
from tbcad.prototype.drive.drive import Drive, Parts, chosen, load_drives, load_parts
from tbcad.prototype.frame import frame_solids as frames
from tbcad.prototype.frame.layout import FrameLayout, bought_parts, frame
from tbcad.prototype.keepout import room
from tbcad.prototype.printing.parts import PrintedPart
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.stage import stage_solids as stages
from tbcad.prototype.stage.layout import StageLayout, stage
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

    made: Prototype
    base: BaseLayout
    plan: Split
    stage: StageLayout
    frame: FrameLayout
    pieces: tuple[PrintedPart, ...]
    balance: Balance
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
        in_caps = Counter(magnets(self.base, self.made, self.parts))
        around = Counter(bought_parts(self.frame, self.stage))
        return dict(sorted((for_base + in_caps + around).items()))


def machine(design: Design, progress: Progress = lambda _: None) -> Machine:
    """Design and build the prototype.

    Raises:
        SpecError: when something does not fit; it says what to change.
        InvalidSolidError: when the kernel fails.
    """
    keys, parts = design.spec.prototype, load_parts()
    target = design.spec.optics.capture_diameter_mm
    progress("prototype: balls, their places, stops")
    made = prototype(design.spec, design)
    numbers = base(keys.base, made)
    progress("prototype: base")
    plan = split(numbers)
    turning = carrier(numbers, plan)
    density = keys.base.density_g_cm3
    summed = balance(numbers.frame, ball_load(made, density), _load(turning, density))
    drive = _drive(made, summed, keys, parts)
    progress("prototype: stage and frame")
    left = room(made, numbers, target / 2, float(np.radians(keys.motion.approach_deg)))
    held = stage((keys.stage, keys.frame, keys), made, left, parts)
    round_it = frame((keys.frame, keys), made, numbers, held, drive, left, parts)
    still = (*_stages(held, keys), *_frames(round_it, keys))
    progress("prototype: caps and coupon")
    pieces = (*_bases(turning), *_caps(numbers, made), *still, *_tools(numbers))
    return Machine(made, numbers, plan, held, round_it, pieces, summed, drive, parts, target)


def _swing(made: Prototype) -> tuple[float, float]:
    return float(made.stops.angle.min()), float(made.stops.angle.max())


def _drive(made: Prototype, summed: Balance, keys: PrototypeSpec, parts: Parts) -> Drive:
    acceleration = float(np.radians(keys.motion.acceleration_deg_s2))
    needed = summed.needed(*_swing(made), acceleration, keys.motion.safety)
    return chosen(keys.base.drive, needed, load_drives(parts))


def _load(parts: list[PlacedSolid], density: float) -> Load:
    mass = [part.mass_g(density) for part in parts]
    return Load(np.array(mass), np.array([centroid(part.shape) for part in parts]))


def _bases(parts: list[PlacedSolid]) -> Iterator[PrintedPart]:
    for part in parts:
        yield PrintedPart(part, "base", "carrier of the balls, turns about the axis")


def _caps(numbers: BaseLayout, made: Prototype) -> Iterator[PrintedPart]:
    own = np.flatnonzero(made.balls.cap).tolist()
    for k, part in zip(own, caps(numbers, made), strict=True):
        yield PrintedPart(part, "cap", f"stands in for ball {k + 1}, which is too large to buy", k)


def _stages(held: StageLayout, keys: PrototypeSpec) -> Iterator[PrintedPart]:
    for item, part in zip(held.items, stages.parts(held, keys.base), strict=True):
        yield PrintedPart(part, "stage", item.what)


def _frames(round_it: FrameLayout, keys: PrototypeSpec) -> Iterator[PrintedPart]:
    for item, part in zip(round_it.printed, frames.parts(round_it, keys.base), strict=True):
        yield PrintedPart(part, "frame", item.what)


def _tools(numbers: BaseLayout) -> Iterator[PrintedPart]:
    for part in coupon(numbers):
        yield PrintedPart(
            part, "tool", "seats to try the fit of the balls before the base is printed"
        )
