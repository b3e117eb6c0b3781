"""One prototype: as a build describes it, and both runs as a machine's state has them."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import perpendicular_axes
from tbcad.core.optics.camera import LensCamera, without_distortion
from tbcad.core.optics.pedestals.cells import NO_WALLS, GrooveWalls
from tbcad.core.optics.sphere_forms import TERM_COUNT, Forms
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan, PrototypeRun, balls_at_stops, prototype_run
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.prototype.gravity.compliance import best_motions
from tbcad.prototype.purchased.parts import load_parts
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.run import Frame
from tbcad.rig.machine.machine import OF_FRAMES, Machine
from tbcad.tolerancing.montecarlo.draws import ShellDraws
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.prototype.gravity import Gravity
from tbcad.tolerancing.prototype.windows import (
    PrototypeDraws,
    cap_rotations,
    draw_prototypes,
    powered_plan,
    tilted_centres,
)
from tbcad.types import Bools, Floats

RUNS = 2  # of the base through its stops, the object turned by 180 degrees between both
TURNS = (0, 180)  # of the object in both runs, degrees
# Along each axis, mm. Drawings of T-1 LEDs allow 0.25 mm, and a printed pocket has 0.3 mm of play,
# both as two standard deviations: root of 0.125^2 + 0.15^2.
LED_MM = 0.2
# Of k1, k2, p1, p2, k3 of OpenCV's model. Judgement: lenses sold as free from distortion are off by
# 1 % at the corner of a picture of 90 degrees, where r^2 is 1.5.
DISTORTION = (7e-3, 2e-3, 3e-4, 3e-4, 0.0)
# Of the optical axis on the sensor, along rows and columns, pixels. Judgement: 0.07 mm as two
# standard deviations on pixels of 3.45 um. The camera is turned until the picture is where it
# belongs, so this comes with the opposite tilt.
PRINCIPAL_PX = 10.0
# Random stream of a build's other errors, beyond those of its shells and its prototype.
OTHER_STREAM = 2000


def designed_prototype(export: ExportedDesign, plan: Plan) -> Machine:
    """The prototype of a build; its frames are the stops of the first run, then of the second.

    InputError: the record of the prototype cannot be read, or has no LEDs.
    """
    camera = export.reflectors[0].camera
    return Machine(
        camera=without_distortion(camera),
        axis=plan.frame[0],
        axis_point=np.zeros(3),
        angle=np.tile(plan.angle, RUNS),
        centre=plan.centre,
        radius=plan.radius,
        leds=read_leds(export.folder),
        forms=designed_forms(plan),
    )


def designed_shell(reflector: Reflector, leds: Floats) -> Machine:
    """One camera of the shell with its curved mirrors as spheres at rest; LEDs (l, 3), mm."""
    mirrors = reflector.mirrors
    radius = 1 / mirrors.curvature
    return Machine(
        camera=without_distortion(reflector.camera),
        axis=np.array([0.0, 0.0, 1.0]),
        axis_point=np.zeros(3),
        angle=np.zeros(1),
        centre=mirrors.apex - radius[:, None] * mirrors.normal,
        radius=radius,
        leds=leds,
    )


def read_leds(folder: Path) -> Floats:
    """Where the LEDs of a prototype shine from, mm, (l, 3); InputError: it names none."""
    path = folder / NAME
    leds = Prototype.read(path).leds
    if not leds:
        raise InputError(
            f"{path} names no LEDs, which calibrate the machine: build it with the default of "
            "prototype.stage.leds_mm"
        )
    return np.array([led.position_mm for led in leds])


def dome_radius(export: ExportedDesign) -> float:
    """Radius of the domes of a build's LEDs, mm."""
    return float(load_parts()[export.spec.prototype.stage.led]["diameter_mm"]) / 2


def machine_runs(
    export: ExportedDesign, plan: Plan, machine: Machine, frames: tuple[Frame, ...]
) -> tuple[PrototypeRun, PrototypeRun]:
    """Both runs of a machine: for camera a's mirrors, and for camera b's, the object turned.

    At a stop that is no frame of the machine the base is taken to be where the plan has it.
    """
    a, b = (machine_run(export, plan, machine, frames, half) for half in range(len(TURNS)))
    return a, b


def machine_run(
    export: ExportedDesign, plan: Plan, machine: Machine, frames: tuple[Frame, ...], half: int
) -> PrototypeRun:
    """One run of a machine, 0 for camera a's mirrors, 1 for camera b's; see `machine_runs`."""
    if len(machine.radius) != len(plan):
        raise InputError(
            f"the machine has {len(machine.radius)} balls, {export.folder} has {len(plan)}: name "
            "the build that the machine was calibrated with"
        )
    balls = _balls(plan, machine, frames, TURNS[half])
    return prototype_run(export.reflectors[half], plan, half, machine.camera, balls)


def stops_known(plan: Plan, frames: tuple[Frame, ...]) -> Bools:
    """Whether each stop of each run is a frame, (2, s)."""
    known = np.zeros((len(TURNS), len(plan.angle)), dtype=bool)
    for frame in frames:
        if frame.stop <= len(plan.angle):
            known[TURNS.index(frame.object_turn_deg), frame.stop - 1] = True
    return known


def _balls(plan: Plan, machine: Machine, frames: tuple[Frame, ...], turn: int) -> Floats:
    """Balls at all stops of one run, as of `PrototypeRun`, (s, k, 8)."""
    stops = len(plan.angle)
    known = [
        (frame.stop - 1, number)
        for number, frame in enumerate(frames)
        if frame.object_turn_deg == turn and frame.stop <= stops
    ]
    at, number = np.array(known, dtype=np.int64).reshape(-1, 2).T
    every: dict[str, Any] = {"angle": plan.angle.copy()}
    every["angle"][at] = machine.angle[number]
    for name in OF_FRAMES:
        if (values := getattr(machine, name)) is not None:
            every[name] = np.zeros((stops, *values.shape[1:]))
            every[name][at] = values[number]
    there = replace(machine, **every)
    stop = np.repeat(np.arange(stops), len(plan))
    ball = np.tile(np.arange(len(plan)), stops)

    def place(points: Floats) -> Floats:
        return there.on_spheres(points.reshape(-1, 3), stop, ball).reshape(points.shape)

    if there.forms is None:
        return balls_at_stops(plan, machine.centre, machine.radius, place)
    forms = there.forms_in(stop, ball).reshape(stops, len(plan), -1)
    return balls_at_stops(plan, machine.centre, machine.radius, place, forms, there.forms.outward)


@dataclass(frozen=True)
class BuiltPrototype:
    """A prototype with its k bodies, which caps have beside their reflecting spheres."""

    machine: Machine
    body_centre: Floats  # of the spheres in the seats at base angle zero, mm, (k, 3)
    body_radius: Floats  # mm, (k,)
    walls: GrooveWalls = NO_WALLS  # that end the mirrors of a shell; they do not turn with the base


@dataclass(frozen=True)
class OtherErrors:
    """Errors that are no process's; see tbcad.rig.machine.designed."""

    leds: Floats  # mm, (l, 3)
    distortion: Floats  # k1, k2, p1, p2, k3, (5,)
    principal: Floats  # pixels, (2,)


def designed_build(designed: Machine, plan: Plan) -> BuiltPrototype:
    """The build without errors."""
    return BuiltPrototype(designed, plan.body_centre, plan.body_radius)


@dataclass(frozen=True)
class Motion:
    """How the base of f frames is moved beside its angle, and its k balls on it; see Machine."""

    angle: Floats  # further about the axis, radians, (f,)
    turn: Floats  # radians, (f, 3)
    shift: Floats  # mm, (f, 3)
    sag: Floats  # of the reflecting spheres, mm, (f, k, 3)
    seat_turn: Floats  # radians, (f, k, 3)


def sag_motion(
    machine: Machine, body: Floats, sag: Floats, seat_turn: Floats | None = None
) -> Motion:
    """Displacements of bodies in the base's frame, mm, (f, k, 3), as the best motion and the rest.

    To first order, for an axis through the origin. Bodies are at (k, 3), mm: the centre of a flat
    cap's sphere is metres behind its body, and moves with the turn of its seat, (f, k, 3) radians,
    as far as its arm is long. None: all seats turn as the best motion does.
    """
    fitted = best_motions(body, sag)
    own = 0 * sag if seat_turn is None else seat_turn - fitted[:, None, 3:]
    rest = sag - fitted[:, None, :3] - np.cross(fitted[:, None, 3:], body)
    rest = rest + np.cross(own, machine.centre - body)
    shift, turn = (
        rotated(one, machine.axis, machine.angle) for one in (fitted[:, :3], fitted[:, 3:])
    )
    angle = turn @ machine.axis
    return Motion(angle, turn - angle[:, None] * machine.axis, shift, rest, own)


def random_build(
    designed: Machine, plan: Plan, errors: Errors, seed: int, *, gravity: Gravity
) -> BuiltPrototype:
    """The first simulated build, the same that `tbcad tolerance` has, with a real lens and LEDs."""
    draws = draw_prototypes(errors, seed, [0], is_cap(plan), gravity)
    by_weight = (
        np.tile(one(draws.sag[0]), (RUNS, 1, 1)) for one in (gravity.sagged, gravity.turned)
    )
    moved = sag_motion(designed, plan.body_centre, *by_weight)
    across = plan.frame[1:]
    other = draw_other_errors(len(designed.leds), seed)
    tilt = Rotation.from_rotvec(draws.tilt[0] @ across)
    seats, forms = draws.seat[0], designed_forms(plan)
    if forms is not None:
        turned = tilt * cap_rotations(plan, draws.cap_tilt[0])
        axes = np.stack([turned.apply(forms.axes[:, i]) for i in (0, 1)], axis=1)
        forms = replace(forms, terms=draws.form[0], axes=axes)
    powered = powered_plan(plan, draws.power[0])
    machine = Machine(
        camera=built_camera(designed.camera, draws, other),
        axis=tilt.apply(designed.axis),
        axis_point=designed.axis_point,
        angle=designed.angle + draws.angle[0].ravel() + moved.angle,
        centre=tilt.apply(tilted_centres(powered, draws.cap_tilt[0]) + seats),
        radius=powered.radius + draws.radius[0],
        leds=designed.leds + other.leds,
        turn=moved.turn + (draws.wobble[0] @ across).reshape(-1, 3),
        shift=moved.shift + (draws.runout[0] @ across).reshape(-1, 3),
        sag=moved.sag,
        seat_turn=moved.seat_turn,
        forms=forms,
    )
    # A ball is its own body, too large or too small as it is.
    body_radius = np.where(is_cap(plan), plan.body_radius, machine.radius)
    return BuiltPrototype(machine, tilt.apply(plan.body_centre + seats), body_radius)


def draw_other_errors(leds: int, seed: int, camera: int = 0) -> OtherErrors:
    """Errors of the lens, the sensor and so many LEDs, for a camera by its number from 0."""
    key = np.random.SeedSequence(seed, spawn_key=(0, OTHER_STREAM + camera))
    random = np.random.Generator(np.random.Philox(key))
    return OtherErrors(
        leds=LED_MM * random.standard_normal((leds, 3)),
        distortion=np.array(DISTORTION) * random.standard_normal(len(DISTORTION)),
        principal=PRINCIPAL_PX * random.standard_normal(2),
    )


def designed_forms(plan: Plan) -> Forms | None:
    """Forms of the plan's caps without errors; None where it has none."""
    half = plan.half_aperture
    if half is None or not half.any():
        return None
    return Forms(np.zeros((len(half), TERM_COUNT)), perpendicular_axes(plan.normal), half)


def is_cap(plan: Plan) -> Bools:
    """Which spheres are made instead of purchased, (k,)."""
    return np.asarray(plan.body_radius < plan.radius)


def built_camera(
    designed: LensCamera, draws: PrototypeDraws | ShellDraws, other: OtherErrors
) -> LensCamera:
    """The camera of the first of some builds."""
    right, down, _ = designed.axes
    aside = other.principal / designed.focal
    back = Rotation.from_rotvec(aside[0] * down - aside[1] * right)
    tilt = Rotation.from_rotvec(draws.camera_tilt[0])
    return replace(
        designed,
        pinhole=designed.pinhole + draws.camera_shift[0],
        axes=(tilt * back).apply(designed.axes),
        focal=designed.focal * draws.focal[0],
        principal=designed.principal + other.principal,
        distortion=designed.distortion + other.distortion,
    )
