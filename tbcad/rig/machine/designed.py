"""The machine that an export describes, before anything is measured."""

from pathlib import Path

import numpy as np

from tbcad.core.optics.camera import without_distortion
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.prototype.purchased.parts import load_parts
from tbcad.records.prototype import NAME, Prototype
from tbcad.rig.machine.machine import Machine
from tbcad.types import Floats

RUNS = 2  # of the base through its stops, the object turned by 180 degrees between both


def designed_prototype(export: ExportedDesign, plan: Plan) -> Machine:
    """The prototype of an export; its frames are the stops of the first run, then of the second.

    Raises:
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
    """Where the LEDs of an export's prototype shine from, mm, (l, 3).

    Raises:
        InputError: the record cannot be read, or names none.
    """
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
