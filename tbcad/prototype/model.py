"""The whole prototype: the first arrangement that has the solids of all its printed parts."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from OCP.Standard import Standard_Failure
from OCP.StdFail import StdFail_NotDone
from tbcad_verify.run.processes import at_once

from tbcad.cad.kernel.brep import InvalidSolidError
from tbcad.common.schedule import Submit
from tbcad.core.geometry.primitives import Component
from tbcad.core.spec.design import Spec
from tbcad.core.spec.errors import SpecError
from tbcad.prototype.arrangement import (
    PrototypeModel,
    balance_and_drive,
    frame_layout,
    shroud_round,
)
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.coupon import coupon_plates
from tbcad.prototype.base.coupon_seats import expected_downs, worst_pose
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.seat_solids import cap_parts
from tbcad.prototype.base.solid import carrier_parts
from tbcad.prototype.drive.balance import PointMasses
from tbcad.prototype.electronics import Wiring
from tbcad.prototype.gravity.weighed import against_weight
from tbcad.prototype.homing import HomingLayout
from tbcad.prototype.printed import PlacedSolid, PrintedPart, Role, placed_component
from tbcad.types import Progress

# Arrangements whose solids are tried, and how many of them with the same number of balls.
MAX_MODELS, MAX_PADS = 6, 2
KERNEL_ERRORS = (Standard_Failure, StdFail_NotDone)
KERNEL_FAILS = "the CAD kernel fails: {}"
CARRIER_PURPOSE = "carrier of the balls, turns about the axis"
COUPON_PURPOSE = "seats to try the fit of the balls before the base is printed"
PartsOrError: TypeAlias = list[PlacedSolid] | SpecError | InvalidSolidError
FutureParts: TypeAlias = "Future[PartsOrError]"


def build_prototype_model(
    arranged: Iterable[PrototypeModel],
    progress: Progress = lambda _: None,
    submit: Submit = at_once,
) -> PrototypeModel:
    """Build the solids of a prototype by its arrangements, the preferred first, against weight.

    Where the kernel fails with the preferred one, other pads and numbers of balls are tried:
    another hub's boss would leave the same faces grazing each other.

    SpecError when something does not fit; it says what to change; InvalidSolidError when the kernel
    fails.
    """
    progress("prototype: balls, their places, stops, weight")
    errors: dict[tuple[int, float], Exception] = {}
    for arrangement in arranged:
        balls, tilt = len(arrangement.layout), arrangement.base.seats.tilt
        if (balls, tilt) in errors or [k for k, _ in errors].count(balls) == MAX_PADS:
            continue
        try:
            return _model(against_weight(arrangement), progress, submit)
        except (SpecError, InvalidSolidError) as error:
            errors[balls, tilt] = error
        except KERNEL_ERRORS as error:
            errors[balls, tilt] = InvalidSolidError(KERNEL_FAILS.format(error))
        if len(errors) == MAX_MODELS:
            break
    raise next(iter(errors.values()))


def _model(arrangement: PrototypeModel, progress: Progress, submit: Submit) -> PrototypeModel:
    spec, layout, base = arrangement.spec, arrangement.layout, arrangement.base
    progress("prototype: base")
    carrier, coupons, on_stage = _base_and_stage(arrangement, submit)
    disc = _placed([arrangement.frame.of(HomingLayout).disc], spec)[0]
    turning = [*carrier, disc]
    mass = np.array([part.mass_g(spec.printer.density_g_cm3) for part in turning])
    masses = PointMasses(mass, np.array([part.properties.centroid for part in turning]))
    balance, drive = balance_and_drive(layout, base, masses, spec, arrangement.parts)
    progress("prototype: stage and frame")
    if drive != arrangement.drive:  # the mass of the solids asks for another
        arrangement = replace(arrangement, drive=drive)
        frame = frame_layout(arrangement)
        shroud = shroud_round(arrangement, frame)
        arrangement = replace(arrangement, frame=frame, shroud=shroud)
        disc = _placed([frame.of(HomingLayout).disc], spec)[0]
    frame, stage = arrangement.frame, arrangement.stage.components
    half = len(frame.printed) // 2  # the other process is idle: coupons and stage are built
    rest = submit(parts_or_error, _placed, frame.printed[half:], spec)
    on_frame = _placed(frame.printed[:half], spec)
    on_tools = _placed(frame.tools, spec)
    progress("prototype: caps and coupon")
    printed = (
        *_carrier(base, carrier),
        PrintedPart(disc, "base", frame.of(HomingLayout).disc.what),
        *_caps(base, layout, spec.mesh.structure_error_mm),
        *_components("stage", stage, parts_of(on_stage)),
        *_components("frame", frame.printed, [*on_frame, *parts_of(rest)]),
        *(PrintedPart(part, "tool", COUPON_PURPOSE) for part in parts_of(coupons)),
        *_components("tool", frame.tools, on_tools),
    )
    parts = arrangement.parts | frame.of(Wiring).parts
    return replace(arrangement, balance=balance, parts=parts, printed=printed)


def _base_and_stage(
    arrangement: PrototypeModel, submit: Submit
) -> tuple[list[PlacedSolid], FutureParts, FutureParts]:
    """The carrier, and what is built meanwhile: coupons in the carrier's worst pose, and stage."""
    base, split, printer = arrangement.base, arrangement.split, arrangement.spec.printer
    mesh_mm = arrangement.spec.mesh.structure_error_mm
    pose = worst_pose(base, split, expected_downs(base, split))
    coupons = submit(parts_or_error, coupon_plates, base, printer, pose, mesh_mm)
    on_stage = submit(parts_or_error, _placed, arrangement.stage.components, arrangement.spec)
    carrier = carrier_parts(base, split, printer, mesh_mm)
    printed_pose = worst_pose(base, split, [-part.axes[:, 2] for part in carrier])
    if not printed_pose.is_like(pose):  # the bed has no room for the pose that was expected
        coupons = submit(parts_or_error, coupon_plates, base, printer, printed_pose, mesh_mm)
    return carrier, coupons, on_stage


def _placed(components: Sequence[Component], spec: Spec) -> list[PlacedSolid]:
    mesh_mm = spec.mesh.structure_error_mm
    return [placed_component(one, spec.printer, mesh_mm) for one in components]


def parts_or_error(build: Callable[..., list[PlacedSolid]], *arguments: Any) -> PartsOrError:
    """Parts, or why there are none: another arrangement may have them."""
    try:
        return build(*arguments)
    except (SpecError, InvalidSolidError) as error:
        return error
    except KERNEL_ERRORS as error:
        return InvalidSolidError(KERNEL_FAILS.format(error))


def parts_of(outcome: FutureParts) -> list[PlacedSolid]:
    """The parts that were built meanwhile.

    SpecError when something does not fit; InvalidSolidError when the kernel fails.
    """
    parts = outcome.result()
    if isinstance(parts, Exception):
        raise parts
    return parts


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
