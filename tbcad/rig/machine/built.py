"""A prototype as one simulated build comes out: the designed machine with a process's errors."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.core.optics.camera import LensCamera
from tbcad.core.optics.pedestals.cells import NO_WALLS, GrooveWalls
from tbcad.light.simulate.prototype.run import Plan
from tbcad.rig.machine.machine import Machine
from tbcad.tolerancing.montecarlo.draws import ShellDraws
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.prototype.windows import PrototypeDraws, draw_prototypes, tilted_centres
from tbcad.types import Bools, Floats

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


@dataclass(frozen=True)
class BuiltPrototype:
    """A prototype with its k bodies, which caps have beside their reflecting spheres."""

    machine: Machine
    body_centre: Floats  # of the spheres in the seats at base angle zero, mm, (k, 3)
    body_radius: Floats  # mm, (k,)
    walls: GrooveWalls = NO_WALLS  # that end the mirrors of a shell; they do not turn with the base


@dataclass(frozen=True)
class OtherErrors:
    """Errors that are no process's; see tbcad.rig.machine.built."""

    leds: Floats  # mm, (l, 3)
    distortion: Floats  # k1, k2, p1, p2, k3, (5,)
    principal: Floats  # pixels, (2,)


def designed_build(designed: Machine, plan: Plan) -> BuiltPrototype:
    """The build without errors."""
    return BuiltPrototype(designed, plan.body_centre, plan.body_radius)


def random_build(
    designed: Machine,
    plan: Plan,
    errors: Errors,
    seed: int,
    *,
    wind_up: Floats,
) -> BuiltPrototype:
    """The first simulated build, the same that `tbcad tolerance` has, with a real lens and LEDs.

    The wind-up is the turn of the base under gravity at the plan's stops, radians, (t,).
    """
    draws = draw_prototypes(errors, seed, [0], is_cap(plan), wind_up)
    return _built(designed, plan, draws, draw_other_errors(len(designed.leds), seed))


def draw_other_errors(leds: int, seed: int, camera: int = 0) -> OtherErrors:
    """Errors of the lens, the sensor and so many LEDs, for a camera by its number from 0."""
    key = np.random.SeedSequence(seed, spawn_key=(0, OTHER_STREAM + camera))
    random = np.random.Generator(np.random.Philox(key))
    return OtherErrors(
        leds=LED_MM * random.standard_normal((leds, 3)),
        distortion=np.array(DISTORTION) * random.standard_normal(len(DISTORTION)),
        principal=PRINCIPAL_PX * random.standard_normal(2),
    )


def _built(
    designed: Machine, plan: Plan, draws: PrototypeDraws, other: OtherErrors
) -> BuiltPrototype:
    tilt = Rotation.from_rotvec(draws.tilt[0] @ plan.frame[1:])
    seats = draws.seat[0]
    machine = Machine(
        camera=built_camera(designed.camera, draws, other),
        axis=tilt.apply(designed.axis),
        axis_point=designed.axis_point,
        angle=designed.angle + draws.angle[0].ravel(),
        centre=tilt.apply(tilted_centres(plan, draws.cap_tilt[0]) + seats),
        radius=plan.radius + draws.radius[0],
        leds=designed.leds + other.leds,
        shift=(draws.runout[0] @ plan.frame[1:]).reshape(-1, 3),
    )
    # A ball is its own body, too large or too small as it is.
    body_radius = np.where(is_cap(plan), plan.body_radius, machine.radius)
    return BuiltPrototype(machine, tilt.apply(plan.body_centre + seats), body_radius)


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
