"""The arrangement of a prototype: all its layouts, without solids, and what the spec leaves open.

Number of balls, angle of the pads and hold are chosen together: the first combination, in the order
of preference, in which balls, seats, base, stage and frame have room.
"""

from collections import Counter
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from tbcad.core.camera.sheet import RigLight
from tbcad.core.mirrors.array import MirrorDesign
from tbcad.core.spec.design import Spec, spec_with
from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.section import AUTO
from tbcad.core.spec.sizes import led_places
from tbcad.prototype.balls.layout import BallChoices, PrototypeLayout, ball_counts, prototype_layout
from tbcad.prototype.base.caps import cap_magnets
from tbcad.prototype.base.fasteners import base_fasteners
from tbcad.prototype.base.layout import BaseLayout, base_layout, carrier_masses
from tbcad.prototype.base.split import BaseSplit, BedError, split_base
from tbcad.prototype.drive.balance import (
    OVERTRAVEL_DEG,
    BaseBalance,
    PointMasses,
    ball_masses,
    home_angles,
    sum_masses,
    travel_ends,
)
from tbcad.prototype.drive.drive import Drive, base_torques, choose_drive, load_drives
from tbcad.prototype.drive.power_off import with_brake
from tbcad.prototype.electronics import led_circuit
from tbcad.prototype.fasteners import Fastener, numbered
from tbcad.prototype.frame.camera_mount import CameraMount, check_camera
from tbcad.prototype.frame.chosen_camera import with_camera
from tbcad.prototype.frame.stock import Stock
from tbcad.prototype.gravity.sag import Sag
from tbcad.prototype.keepout import KeepOut, keep_out_volume, min_distance
from tbcad.prototype.light.lamp import LampLayout
from tbcad.prototype.light.shroud import ShroudLayout, shroud_layout
from tbcad.prototype.light.upper import UpperLamps
from tbcad.prototype.part import FrameLayout, Site
from tbcad.prototype.purchased.parts import Parts, load_parts
from tbcad.prototype.registry import FRAME, PARTS
from tbcad.prototype.stage.layout import StageLayout, stage_fasteners, stage_layout

if TYPE_CHECKING:
    from tbcad.prototype.printed import PrintedPart

OPEN_BASE_KEYS = ("pad_angle_deg", "hold", "hub_boss_mm")
"""Keys of the section [prototype.base] that an arrangement chooses where they are "auto"."""
BEDS_TRIED = 3  # arrangements that only the bed is too small for, before the search ends


@dataclass(frozen=True, kw_only=True)
class PrototypeModel(Site):
    """A prototype: all its layouts, a value for every key, and its printed parts once built."""

    split: BaseSplit  # how the carrier is cut to fit the bed
    # of what turns with the base; the carrier's mass is an estimate until it is built
    balance: BaseBalance
    frame: FrameLayout  # layout of what holds stage, base and camera
    shroud: ShroudLayout | None  # round the rig, None without
    sag: Sag | None = None  # of the balls by weight, when it is known
    printed: "tuple[PrintedPart, ...]" = ()  # all printed parts, when they are built

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
    def rig_light(self) -> RigLight:
        """The light on the object and the name of the camera."""
        lamps, mount = self.frame.find(LampLayout), self.frame.find(CameraMount)
        named = mount.chosen.name if mount and mount.chosen else None
        upper = self.frame.find(UpperLamps)
        more = upper.lux if upper else 0.0
        return RigLight(lamps.lux + more if lamps else None, named)

    @property
    def purchased(self) -> dict[str, int]:
        """Quantity of purchased parts by name, without balls and drive."""
        counts = Counter(one.part.name for one in self.fasteners)
        for one in self.frame.mounted:
            counts.update(one.listed)
        if self.shroud:
            counts[self.shroud.sheet.name] += self.shroud.sheets
        return counts


def arrangements(design: MirrorDesign) -> Iterator[PrototypeModel]:
    """Every arrangement that has room, the preferred first.

    SpecError at the end, when there was none; it names the cause in the preferred one, and what was
    tried. Where the bed alone is too small for several, it is for all: more balls and longer hubs
    need larger ones.
    """
    tried, arranged, errors = list[int](), False, list[SpecError]()
    for spec, outcome in _attempts(design):
        tried.append(int(spec.prototype.k))
        if isinstance(outcome, PrototypeModel):
            arranged = True
            yield outcome
        else:
            errors.append(outcome)
        beds = [error for error in errors if isinstance(error, BedError)]
        if len(beds) == BEDS_TRIED and not arranged:
            raise BedError(f"{beds[0]}{_remedy(design, tried)}") from None
    if errors and not arranged:
        raise SpecError(f"{errors[0]}{_remedy(design, tried)}") from None


def arrange(design: MirrorDesign) -> PrototypeModel:
    """The preferred arrangement; raises as `arrangements`."""
    return next(arrangements(design))


def rearranged(model: PrototypeModel, layout: PrototypeLayout) -> PrototypeModel:
    """The same arrangement round a layout that is nearly its own; SpecError: it has no room."""
    _, outcome = next(_frame_attempts(model.spec, layout, model.parts))
    if isinstance(outcome, SpecError):
        raise outcome
    return outcome


def balance_and_drive(
    layout: PrototypeLayout, base: BaseLayout, carrier: PointMasses, spec: Spec, parts: Parts
) -> tuple[BaseBalance, Drive]:
    """The balance of balls and carrier, and the drive that turns them.

    SpecError: no drive is strong enough, or no brake holds the base without power.
    """
    balance = sum_masses(base.frame, ball_masses(layout), carrier)
    torques = base_torques(balance, layout.stops.range, spec.prototype.motion)
    drive = choose_drive(spec.prototype.base.drive, torques, load_drives(parts))
    travel = travel_ends(layout, spec.prototype.motion)
    return balance, with_brake(drive, balance, travel, parts)


Outcome = tuple[Spec, PrototypeModel | SpecError]
"""The spec that was tried, and its arrangement or why it has none."""


def _attempts(design: MirrorDesign) -> Iterator[Outcome]:
    """Outcomes for every number of balls."""
    parts, choices = load_parts(), BallChoices(design.spec, design.arrays[0])
    for k in ball_counts(design.spec, design, choices):
        spec = spec_with(design.spec, prototype={"k": k})
        check_camera(spec, design.arrays[0], parts)  # what none of the attempts has room for
        try:
            layout = prototype_layout(spec, design, k, choices)
        except SpecError as error:
            yield spec, error
        else:
            yield from _base_attempts(spec, layout, parts)


def _base_attempts(spec: Spec, layout: PrototypeLayout, parts: Parts) -> Iterator[Outcome]:
    """Outcomes for balls in their places; glue is tried only where no magnets fit."""
    section = spec.prototype.base
    for hold in section.holds:
        seated = False
        for angle in section.pad_angles_deg:
            chosen = _with_base(spec, hold=hold, pad_angle_deg=angle)
            try:
                base_layout(chosen.prototype.base, layout)
            except SpecError as error:
                yield chosen, error
            else:
                seated = True
                if not (yield from _frame_attempts(chosen, layout, parts)):
                    return
        if seated:
            return


def _frame_attempts(
    spec: Spec, layout: PrototypeLayout, parts: Parts
) -> Generator[Outcome, None, bool]:
    """Outcomes for a base whose seats have room, and whether other pads may help.

    They do not where the frame alone has no room.
    """
    for boss in spec.prototype.base.hub_bosses_mm:
        chosen = _with_base(spec, hub_boss_mm=boss)
        base = base_layout(chosen.prototype.base, layout)
        carrier = carrier_masses(base, spec.printer.density_g_cm3)
        try:
            estimate = balance_and_drive(layout, base, carrier, chosen, parts)
            keep_out = _keep_out(chosen, layout, base)
        except SpecError as error:  # whatever boss and pads
            yield chosen, error
            return False
        try:
            chosen, stage = _staged(chosen, layout, keep_out, parts)
        except SpecError as error:  # whatever the boss
            yield chosen, error
            return True
        site = Site(
            spec=chosen,
            layout=layout,
            base=base,
            drive=estimate[1],
            keep_out=keep_out,
            stage=stage,
            parts=parts,
        )
        try:
            arrangement = _arranged(site, estimate[0])
        except SpecError as error:
            yield chosen, error
        else:
            yield chosen, arrangement
            return True
    return False


def _staged(
    spec: Spec, layout: PrototypeLayout, keep_out: KeepOut, parts: Parts
) -> tuple[Spec, StageLayout]:
    """The stage, without LEDs where those in the automatic places cannot be used or wired."""
    section = spec.prototype.stage
    try:
        stage = stage_layout(spec.prototype, layout, keep_out, parts)
        led_circuit(spec.prototype, stage, parts)
        return spec, stage
    except SpecError:
        if not section.leds_mm or section.leds_mm != led_places(spec.optics.capture_diameter_mm):
            raise
    without = spec_with(spec, prototype={"stage": section.model_copy(update={"leds_mm": ()})})
    return _staged(without, layout, keep_out, parts)


def _with_base(spec: Spec, **values: object) -> Spec:
    base = spec.prototype.base.model_copy(update=values)
    return spec_with(spec, prototype={"base": base})


def _keep_out(spec: Spec, layout: PrototypeLayout, base: BaseLayout) -> KeepOut:
    motion = spec.prototype.motion
    approach = float(np.radians(motion.approach_deg))
    if motion.homes:
        lowest = np.radians(home_angles(layout, motion).switch - OVERTRAVEL_DEG)
        approach = max(approach, float(layout.stops.angle[0] - lowest))
    return keep_out_volume(layout, base, spec.optics.capture_diameter_mm / 2, approach)


def _arranged(site: Site, balance: BaseBalance) -> PrototypeModel:
    spec, frame = site.spec, frame_layout(site)
    shroud, lamps = shroud_round(site, frame), frame.find(LampLayout)
    lamp_z = float(lamps.places[0, 2]) if lamps else 0.0
    upper = frame.find(UpperLamps) is not None
    light = {"lamp_z_mm": lamp_z, "upper": upper, "shroud": shroud is not None}
    chosen = with_camera(spec, site.layout.array)
    lit = spec.prototype.light.model_copy(update=light)
    known = vars(site) | {
        "spec": spec_with(chosen, prototype={"light": lit}),
        "split": split_base(site.base, spec.printer),
    }
    return PrototypeModel(**known, balance=balance, frame=frame, shroud=shroud)


def shroud_round(site: Site, frame: FrameLayout) -> ShroudLayout | None:
    """The shroud round stage, frame and base; SpecError when no sheet is large enough."""
    static, spec = (*site.stage.components, *frame.printed, *frame.purchased), site.spec.prototype
    floor = spec.frame.floor_mm - frame.of(Stock).plate["thickness_mm"]
    return shroud_layout(spec.light, static, site.keep_out, floor, site.parts)


def _remedy(design: MirrorDesign, tried: list[int]) -> str:
    """Other values that were tried, as the end of an error message.

    Where the spec fixes keys that could be open: an arrangement without that, if there is one.
    """
    fixed = {key: value for key, value in _open_keys(design.spec).items() if value != AUTO}
    if not fixed:
        return f" (tried: {', '.join(map(str, dict.fromkeys(tried)))} balls)"
    free = _with_base(
        spec_with(design.spec, prototype={"k": AUTO}), **dict.fromkeys(OPEN_BASE_KEYS, AUTO)
    )
    try:
        chosen = _open_keys(arrange(MirrorDesign(free, design.arrays)).spec)
    except SpecError:
        return ""
    return "; tried: there is room with " + ", ".join(
        f"prototype.{key} auto (which becomes {chosen[key]})" for key in fixed
    )


def _open_keys(spec: Spec) -> dict[str, object]:
    base = spec.prototype.base
    return {"k": spec.prototype.k} | {f"base.{key}": getattr(base, key) for key in OPEN_BASE_KEYS}


# Light goes into the first two; the stage's own limits hold for its post.
MAY_BE_LIT = ("camera", "camera_lens", "stage_post", "upper_board_*", "upper_rod_*")
REMEDY = "prototype.frame.uprights_mm or prototype.largest_ball_mm smaller"


def frame_layout(site: Site) -> FrameLayout:
    """The frame round a base and a stage; SpecError names what to change where it does not fit."""
    frame = FrameLayout(())
    for part in FRAME:
        if mounted := part.layout(site, frame):
            frame = FrameLayout((*frame.mounted, mounted))
    light, swept = _clearances(site, frame)
    return replace(frame, light=light, swept=swept)


def _clearances(site: Site, frame: FrameLayout) -> tuple[dict[str, float], dict[str, float]]:
    """Smallest distances of all static parts to light and to what the base sweeps."""
    keep_out, clearance = site.keep_out, site.spec.prototype.frame.clearance_mm
    bodies = (*frame.printed, *frame.purchased)
    static = {body.name: body.added for body in bodies if not body.rotates}
    light = {
        name: min_distance(keep_out.to_light, bodies)
        for name, bodies in static.items()
        if not any(fnmatchcase(name, one) for one in MAY_BE_LIT)
    }
    swept = {name: min_distance(keep_out.to_swept, bodies) for name, bodies in static.items()}
    obstacles = ("light of the balls", "balls and base as they swing")
    for obstacle, distances in zip(obstacles, (light, swept), strict=True):
        name, distance = min(distances.items(), key=lambda item: item[1])
        if distance < clearance:
            raise SpecError(
                f"{name.replace('_', ' ')}: {distance:.1f} mm from the {obstacle}, less than "
                f"prototype.frame.clearance_mm {clearance:g}: make {_more_room(name)}"
            )
    return light, swept


def _more_room(name: str) -> str:
    """Remedy that gives a body more clearance."""
    remedies = (one for part in PARTS for one in part.remedies.items())
    return next((text for pattern, text in remedies if fnmatchcase(name, pattern)), REMEDY)
