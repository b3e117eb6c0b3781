"""machine.json: a machine's state, as calibrated or as simulated, read and written exactly."""

from pathlib import Path

import numpy as np

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.camera import LensCamera
from tbcad.errors import InputError
from tbcad.records.calibration import CalibratedCamera, MachineRecord, SphereRecord
from tbcad.records.exposure import Frame
from tbcad.rig.machine.machine import Machine

RECORD = "machine.json"
TRUTH = "truth.json"  # the machine of a simulated run, in its folder
ROUNDING = 1e-9  # of unit vectors


def truth_file(machine: str) -> str:
    """Name of the file with a machine as it was simulated: truth.json, of a shell truth_a.json."""
    return f"truth_{machine}.json" if machine else TRUTH


def write_machine(path: Path, machine: Machine, frames: tuple[Frame, ...]) -> None:
    """Write machine.json, for a machine with these frames."""
    camera = machine.camera
    spheres = zip(machine.centre.tolist(), machine.radius.tolist(), strict=True)
    MachineRecord(
        camera=CalibratedCamera(
            pinhole_mm=camera.pinhole.tolist(),
            axes=camera.axes.tolist(),
            focal_px=camera.focal.tolist(),
            principal_px=camera.principal.tolist(),
            distortion=camera.distortion.tolist(),
            width_px=camera.width_px,
            height_px=camera.height_px,
        ),
        axis=machine.axis.tolist(),
        axis_point_mm=machine.axis_point.tolist(),
        frames=frames,
        angle_deg=np.degrees(machine.angle).tolist(),
        spheres=tuple(SphereRecord(centre_mm=at, radius_mm=radius) for at, radius in spheres),
        leds_mm=machine.leds.tolist(),
        shift_mm=None if machine.shift is None else machine.shift.tolist(),
    ).write(path)


def read_machine(path: Path) -> tuple[Machine, tuple[Frame, ...]]:
    """The machine that a file describes, and its frames.

    Raises:
        InputError: the file is missing or says what cannot be.
    """
    found = MachineRecord.read(path)
    axis, axes = np.array(found.axis), np.array(found.camera.axes)
    if abs(norm(axis) - 1) > ROUNDING or np.abs(axes @ axes.T - np.eye(3)).max() > ROUNDING:
        raise InputError(f"{path}: axes are no unit vectors at right angles: calibrate again")
    camera = LensCamera(
        pinhole=np.array(found.camera.pinhole_mm),
        axes=axes,
        focal=np.array(found.camera.focal_px),
        principal=np.array(found.camera.principal_px),
        distortion=np.array(found.camera.distortion),
        width_px=found.camera.width_px,
        height_px=found.camera.height_px,
    )
    machine = Machine(
        camera=camera,
        axis=axis,
        axis_point=np.array(found.axis_point_mm),
        angle=np.radians(found.angle_deg),
        centre=np.array([sphere.centre_mm for sphere in found.spheres]),
        radius=np.array([sphere.radius_mm for sphere in found.spheres]),
        leds=np.array(found.leds_mm).reshape(-1, 3),
        shift=None if found.shift_mm is None else np.array(found.shift_mm),
    )
    return machine, found.frames
