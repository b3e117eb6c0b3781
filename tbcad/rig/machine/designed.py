"""One prototype: as an export describes it, and both runs as a machine's state has them."""

from pathlib import Path

import numpy as np

from tbcad.core.geometry.rotations import rotated
from tbcad.core.optics.camera import without_distortion
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan, PrototypeRun, balls_at_stops, prototype_run
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.prototype.purchased.parts import load_parts
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.run import Frame
from tbcad.rig.machine.machine import Machine
from tbcad.types import Bools, Floats

RUNS = 2  # of the base through its stops, the object turned by 180 degrees between both
TURNS = (0, 180)  # of the object in both runs, degrees


def designed_prototype(export: ExportedDesign, plan: Plan) -> Machine:
    """The prototype of an export; its frames are the stops of the first run, then of the second.

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
    """Radius of the domes of an export's LEDs, mm."""
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
            "the export that the machine was calibrated with"
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
    angle, shift = plan.angle.copy(), np.zeros((len(plan.angle), 3))
    shifts = np.zeros((len(frames), 3)) if machine.shift is None else machine.shift
    for frame, found, moved in zip(frames, machine.angle, shifts, strict=True):
        if frame.object_turn_deg == turn and frame.stop <= len(angle):
            angle[frame.stop - 1], shift[frame.stop - 1] = found, moved

    def place(points: Floats) -> Floats:
        turned = rotated(points - machine.axis_point, machine.axis, angle[:, None])
        return np.asarray(machine.axis_point + turned + shift[:, None])

    return balls_at_stops(plan, machine.centre, machine.radius, place)
