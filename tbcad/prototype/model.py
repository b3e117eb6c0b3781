"""The whole prototype: its layouts, its printed parts as solids, and the drive that turns them."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from OCP.Standard import Standard_Failure
from OCP.StdFail import StdFail_NotDone

from tbcad.background import Submit, at_once
from tbcad.cad.brep import InvalidSolidError
from tbcad.camera.requirements import camera_requirements
from tbcad.geometry.primitives import Component
from tbcad.prototype.arrangement import (
    Arrangement,
    balance_and_drive,
    shroud_round,
)
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.cap_solids import cap_magnets, cap_parts
from tbcad.prototype.base.coupon import coupon_plates
from tbcad.prototype.base.coupon_pose import expected_downs, worst_pose
from tbcad.prototype.base.fasteners import base_fasteners
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.solid import carrier_parts
from tbcad.prototype.base.split import BaseSplit
from tbcad.prototype.drive.balance import BaseBalance, PointMasses
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.electronics.wiring import Wiring
from tbcad.prototype.fasteners.fastener import Fastener, numbered
from tbcad.prototype.frame.camera_gauge import CameraGauge, camera_gauge
from tbcad.prototype.frame.layout import FrameLayout, frame_layout, frame_purchased_parts
from tbcad.prototype.light.shroud import ShroudLayout
from tbcad.prototype.printing.component_solids import placed_component, placed_components
from tbcad.prototype.printing.parts import PrintedPart, Role
from tbcad.prototype.printing.placing import PlacedSolid
from tbcad.prototype.purchased.parts import Parts
from tbcad.prototype.stage.fasteners import stage_fasteners
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.design import Spec
from tbcad.spec.errors import SpecError
from tbcad.types import Progress

# Arrangements whose solids are tried, and how many of them with the same number of balls.
MAX_MODELS, MAX_PADS = 6, 2
KERNEL_ERRORS = (Standard_Failure, StdFail_NotDone)
KERNEL_FAILS = "the CAD kernel fails: {}"
CARRIER_PURPOSE = "carrier of the balls, turns about the axis"
COUPON_PURPOSE = "seats to try the fit of the balls before the base is printed"

PartsOrError: TypeAlias = list[PlacedSolid] | SpecError | InvalidSolidError


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
        gauge: that shows where the camera's pinhole is; None without a camera.
        shroud: round the rig, None without.
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
    gauge: CameraGauge | None
    shroud: ShroudLayout | None
    printed: tuple[PrintedPart, ...]
    balance: BaseBalance
    drive: Drive
    parts: Parts
    capture_radius: float

    @cached_property
    def fasteners(self) -> tuple[Fastener, ...]:
        """All fasteners in their places, named."""
        base, parts = self.base, self.parts
        return numbered(
            (
                *base_fasteners(base, self.split, self.drive, parts),
                *cap_magnets(base, self.layout, parts),
                *self.frame.fasteners,
                *stage_fasteners(self.stage, parts),
            )
        )

    @property
    def purchased(self) -> dict[str, int]:
        """Quantity of purchased parts by name, without balls and drive."""
        counts = Counter(one.part.name for one in self.fasteners)
        counts.update(frame_purchased_parts(self.frame))
        counts.update(self.wiring.purchased(self.frame.lamps))
        if self.shroud:
            counts[self.shroud.sheet.name] += self.shroud.sheets
        return counts


def build_prototype_model(
    arranged: Iterable[Arrangement],
    progress: Progress = lambda _: None,
    submit: Submit = at_once,
    begun: Callable[[Arrangement], None] = lambda _: None,
) -> PrototypeModel:
    """Build the solids of a prototype.

    Where the kernel fails with the preferred arrangement, other pads and numbers of balls are
    tried: another hub's boss would leave the same faces grazing each other.

    Args:
        arranged: its arrangements, the preferred first.
        progress: called with each stage.
        submit: takes what can be done meanwhile.
        begun: called with each arrangement before its solids are built.

    Raises:
        SpecError: when something does not fit; it says what to change.
        InvalidSolidError: when the kernel fails.
    """
    progress("prototype: balls, their places, stops")
    errors: dict[tuple[int, float], Exception] = {}
    for arrangement in arranged:
        balls, tilt = len(arrangement.layout), arrangement.base.seats.tilt
        if (balls, tilt) in errors or [k for k, _ in errors].count(balls) == MAX_PADS:
            continue
        begun(arrangement)
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
    printer, parts, split = spec.printer, arrangement.parts, arrangement.split
    mesh_mm = spec.mesh.structure_error_mm
    progress("prototype: base")
    pose = worst_pose(base, split, expected_downs(base, split))
    stage, keep_out, frame = arrangement.stage, arrangement.keep_out, arrangement.frame
    coupons = submit(parts_or_error, coupon_plates, base, printer, pose, mesh_mm)
    on_stage = submit(parts_or_error, placed_components, stage.components, printer, mesh_mm)
    carrier = carrier_parts(base, split, printer, mesh_mm)
    printed_pose = worst_pose(base, split, [-part.axes[:, 2] for part in carrier])
    if not printed_pose.is_like(pose):  # the bed has no room for the pose that was expected
        coupons = submit(parts_or_error, coupon_plates, base, printer, printed_pose, mesh_mm)
    disc = placed_component(frame.homing.disc, printer, mesh_mm)
    masses = _masses([*carrier, disc], printer.density_g_cm3)
    balance, drive = balance_and_drive(layout, base, masses, spec, parts)
    progress("prototype: stage and frame")
    shroud = arrangement.shroud
    if drive != arrangement.drive:  # the mass of the solids asks for another
        frame = frame_layout(spec.prototype, layout, base, stage, drive, keep_out, parts)
        disc = placed_component(frame.homing.disc, printer, mesh_mm)
        shroud = shroud_round(spec, stage, frame, keep_out, parts)
    # Not by submit: the other process is busy with coupons and stage until now.
    on_frame = placed_components(frame.printed, printer, mesh_mm)
    gauge = _gauge(spec, layout, base, frame)
    tools = placed_components([gauge.component] if gauge else [], printer, mesh_mm)
    progress("prototype: caps and coupon")
    printed = (
        *_carrier(base, carrier),
        PrintedPart(disc, "base", frame.homing.disc.what),
        *_caps(base, layout, mesh_mm),
        *_components("stage", stage.components, parts_of(on_stage)),
        *_components("frame", frame.printed, on_frame),
        *(PrintedPart(part, "tool", COUPON_PURPOSE) for part in parts_of(coupons)),
        *_components("tool", [gauge.component] if gauge else [], tools),
    )
    return PrototypeModel(
        spec=spec,
        layout=layout,
        base=base,
        split=split,
        stage=stage,
        wiring=arrangement.wiring,
        frame=frame,
        gauge=gauge,
        shroud=shroud,
        printed=printed,
        balance=balance,
        drive=drive,
        parts=parts | arrangement.wiring.parts,
        capture_radius=spec.optics.capture_diameter_mm / 2,
    )


def parts_or_error(build: Callable[..., list[PlacedSolid]], *arguments: Any) -> PartsOrError:
    """Parts with their properties, or why there are none: another arrangement may have them."""
    try:
        parts = build(*arguments)
        for part in parts:
            _ = part.properties  # kept with it
    except (SpecError, InvalidSolidError) as error:
        return error
    except KERNEL_ERRORS as error:
        return InvalidSolidError(KERNEL_FAILS.format(error))
    return parts


def parts_of(outcome: "Future[PartsOrError]") -> list[PlacedSolid]:
    """The parts that were built meanwhile.

    Raises:
        SpecError: when something does not fit.
        InvalidSolidError: when the kernel fails.
    """
    parts = outcome.result()
    if isinstance(parts, Exception):
        raise parts
    return parts


def _gauge(
    spec: Spec, layout: PrototypeLayout, base: BaseLayout, frame: FrameLayout
) -> CameraGauge | None:
    if frame.mount is None:
        return None
    camera, diameter = layout.array.camera, spec.prototype.camera_diameter_mm
    needed = camera_requirements(layout.array, spec.optics.capture_diameter_mm / 2)
    return camera_gauge(base, camera, diameter, needed, layout.stops.range)


def _masses(parts: list[PlacedSolid], density: float) -> PointMasses:
    mass = [part.mass_g(density) for part in parts]
    return PointMasses(np.array(mass), np.array([part.properties.centroid for part in parts]))


def _carrier(base: BaseLayout, pieces: list[PlacedSolid]) -> Iterator[PrintedPart]:
    """The carrier's pieces, that with the hub first; a printed bore is too narrow for a shaft."""
    reamed = f"{CARRIER_PURPOSE}; ream its bore {base.spec.shaft_mm:g} H7"
    first = reamed if base.hub.boss else CARRIER_PURPOSE
    for number, piece in enumerate(pieces):
        yield PrintedPart(piece, "base", CARRIER_PURPOSE if number else first)


def _caps(base: BaseLayout, layout: PrototypeLayout, mesh_mm: float) -> Iterator[PrintedPart]:
    balls = np.flatnonzero(layout.balls.cap).tolist()
    for ball, part in zip(balls, cap_parts(base, layout, mesh_mm), strict=True):
        purpose = f"stands in for ball {ball + 1}, which is too large to buy"
        yield PrintedPart(part, "cap", purpose, ball)


def _components(
    role: Role, components: Sequence[Component], placed: Sequence[PlacedSolid]
) -> Iterator[PrintedPart]:
    for component, part in zip(components, placed, strict=True):
        yield PrintedPart(part, role, component.what)
