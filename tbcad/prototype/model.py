"""The whole prototype: its layouts, its printed parts as solids, and the drive that turns them."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from OCP.Standard import Standard_Failure
from OCP.StdFail import StdFail_NotDone

from tbcad.background import Submit, at_once
from tbcad.cad.brep import InvalidSolidError
from tbcad.formats.step_read_back import check_read_back
from tbcad.geometry.primitives import Component
from tbcad.mirrors.array import MirrorDesign
from tbcad.prototype.arrangement import Arrangement, arrangements, balance_and_drive
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.cap_solids import cap_magnets, cap_parts
from tbcad.prototype.base.coupon import coupon_plates
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.purchased import base_purchased_parts
from tbcad.prototype.base.solid import carrier_parts
from tbcad.prototype.base.split import BaseSplit
from tbcad.prototype.drive.balance import BaseBalance, PointMasses
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.electronics.wiring import Wiring
from tbcad.prototype.frame.layout import FrameLayout, frame_layout, frame_purchased_parts
from tbcad.prototype.printing.component_solids import placed_component
from tbcad.prototype.printing.parts import PrintedPart, Role
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.purchased.parts import Parts
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.spec.printer import PrinterSpec
from tbcad.types import Progress

# Arrangements whose solids are tried, and how many of them with the same number of balls.
MAX_MODELS, MAX_PADS = 6, 2
KERNEL_ERRORS = (Standard_Failure, StdFail_NotDone)
KERNEL_FAILS = "the CAD kernel fails: {}"
CARRIER_PURPOSE = "carrier of the balls, turns about the axis"
COUPON_PURPOSE = "seats to try the fit of the balls before the base is printed"


@dataclass(frozen=True)
class PrototypeModel:
    """All of the prototype.

    Attributes:
        spec: of the design, with a value for every key.
        layout: balls, their places, the plan of the stops.
        base: layout of the carrier.
        split: how the carrier is cut to fit the bed.
        stage: layout of the object stage.
        wiring: of lamp and LEDs.
        frame: layout of what holds stage, base and camera.
        printed: all printed parts.
        balance: of what turns with the base.
        drive: that turns it.
        parts: lists of purchased parts.
        capture_radius: of the capture sphere, mm.
    """

    spec: Spec
    layout: PrototypeLayout
    base: BaseLayout
    split: BaseSplit
    stage: StageLayout
    wiring: Wiring
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
        counts.update(self.wiring.purchased)
        return counts


def build_prototype_model(
    design: MirrorDesign, progress: Progress = lambda _: None, submit: Submit = at_once
) -> PrototypeModel:
    """Arrange the prototype of a design and build its solids.

    Where the kernel fails with the preferred arrangement, other pads and numbers of balls are
    tried: another hub's boss would leave the same faces grazing each other.

    Args:
        design: the mirrors.
        progress: called with each stage.
        submit: takes what can be done meanwhile.

    Raises:
        SpecError: when something does not fit; it says what to change.
        InvalidSolidError: when the kernel fails.
    """
    progress("prototype: balls, their places, stops")
    errors: dict[tuple[int, float], Exception] = {}
    for arrangement in arrangements(design):
        balls, tilt = len(arrangement.layout), arrangement.base.seats.tilt
        if (balls, tilt) in errors or [k for k, _ in errors].count(balls) == MAX_PADS:
            continue
        try:
            return _model(arrangement, progress, submit)
        except (SpecError, InvalidSolidError) as error:
            errors[balls, tilt] = error
        except KERNEL_ERRORS as error:
            errors[balls, tilt] = InvalidSolidError(KERNEL_FAILS.format(error))
        if len(errors) == MAX_MODELS:
            break
    raise next(iter(errors.values()))


def _model(arrangement: Arrangement, progress: Progress, submit: Submit) -> PrototypeModel:
    spec, layout, base = arrangement.spec, arrangement.layout, arrangement.base
    printer, parts = spec.printer, arrangement.parts
    progress("prototype: base")
    carrier = carrier_parts(base, arrangement.split, printer)
    disc = placed_component(arrangement.frame.homing.disc, printer)
    masses = _masses([*carrier, disc], printer.density_g_cm3)
    faults = [submit(carrier_fault, part) for part in carrier]
    balance, drive = balance_and_drive(layout, base, masses, spec, parts)
    progress("prototype: stage and frame")
    stage, keep_out, frame = arrangement.stage, arrangement.keep_out, arrangement.frame
    if drive != arrangement.drive:  # the mass of the solids asks for another
        frame = frame_layout(spec.prototype, layout, base, stage, drive, keep_out, parts)
        disc = placed_component(frame.homing.disc, printer)
    static = [
        *_components("stage", stage.components, printer),
        *_components("frame", frame.printed, printer),
    ]
    progress("prototype: caps and coupon")
    printed = (
        *(PrintedPart(part, "base", CARRIER_PURPOSE) for part in carrier),
        PrintedPart(disc, "base", frame.homing.disc.what),
        *_caps(base, layout),
        *static,
        *(PrintedPart(part, "tool", COUPON_PURPOSE) for part in coupon_plates(base, printer)),
    )
    for fault in faults:
        if fault.result():
            raise InvalidSolidError(fault.result())
    return PrototypeModel(
        spec=spec,
        layout=layout,
        base=base,
        split=arrangement.split,
        stage=stage,
        wiring=arrangement.wiring,
        frame=frame,
        printed=printed,
        balance=balance,
        drive=drive,
        parts=parts | arrangement.wiring.parts,
        capture_radius=spec.optics.capture_diameter_mm / 2,
    )


def carrier_fault(part: PlacedSolid) -> str:
    """What is wrong with a piece of the carrier that its STEP file does not keep, or nothing."""
    try:
        check_read_back(part.name, part.shape, part.properties)
    except InvalidSolidError as error:
        return str(error)
    except KERNEL_ERRORS as error:
        return KERNEL_FAILS.format(error)
    return ""


def _masses(parts: list[PlacedSolid], density: float) -> PointMasses:
    mass = [part.mass_g(density) for part in parts]
    return PointMasses(np.array(mass), np.array([part.properties.centroid for part in parts]))


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
