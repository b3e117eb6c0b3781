"""States of a machine for tests: as designed, and with errors such as printed parts give."""

from dataclasses import replace

import numpy as np

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import unit
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.run import Frame
from tbcad.rig import runs
from tbcad.rig.machine.designed import designed_prototype
from tbcad.rig.machine.machine import Machine

# Standard deviations, about those of tbcad/tolerancing/process/fdm.toml.
SEAT_MM, RADIUS_MM, CAMERA_MM, RUNOUT_MM = 0.15, 0.005, 0.14, 0.05
SAG_MM, SEAT_RAD = 0.1, 1e-3
CAMERA_RAD, AXIS_RAD, ANGLE_RAD = 2.4e-3, 1.5e-3, 0.5e-3


def machine_of(export: ExportedDesign, plan: Plan) -> Machine:
    """As designed."""
    return designed_prototype(export, plan)


def frames_of(plan: Plan) -> tuple[Frame, ...]:
    """All stops of the first run, then of the second."""
    return runs.frames_of(plan.angle)


def perturbed(machine: Machine, seed: int) -> Machine:
    """With random errors."""
    rng = np.random.default_rng(seed)
    k, f = len(machine.radius), len(machine.angle)
    tilt = rng.normal(0, CAMERA_RAD, 3)
    camera = replace(
        machine.camera,
        pinhole=machine.camera.pinhole + rng.normal(0, CAMERA_MM, 3),
        axes=rotated(
            machine.camera.axes,
            np.tile(unit(tilt), (3, 1)),
            np.full(3, np.linalg.norm(tilt)),
        ),
        focal=machine.camera.focal * 1.003,
        principal=machine.camera.principal + np.array([1.5, -1.0]),
        distortion=np.array([-0.01, 0.002, 1e-4, -1e-4, 0.0]),
    )
    return replace(
        machine,
        camera=camera,
        axis=unit(machine.axis + rng.normal(0, AXIS_RAD, 3)),
        axis_point=machine.axis_point + rng.normal(0, RUNOUT_MM, 3),
        angle=machine.angle + rng.normal(0, ANGLE_RAD, f),
        centre=machine.centre + rng.normal(0, SEAT_MM, (k, 3)),
        radius=machine.radius + rng.normal(0, RADIUS_MM, k),
        shift=rng.normal(0, RUNOUT_MM, (f, 3)),
        turn=rng.normal(0, ANGLE_RAD, (f, 3)),
        sag=rng.normal(0, SAG_MM, (f, k, 3)),
        seat_turn=rng.normal(0, SEAT_RAD, (f, k, 3)),
    )
