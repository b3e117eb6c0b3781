"""machine.json: a machine's state, as calibrated or as simulated, read and written exactly."""

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from tbcad.errors import InputError
from tbcad.formats.checked_files import Finite, Record, Vector, read_json
from tbcad.geometry.vectors import norm
from tbcad.machine.machine import Machine
from tbcad.optics.camera import LensCamera
from tbcad.runs.exposure import Frame

MACHINE_SCHEMA = "tbcad-machine/1"
RECORD = "machine.json"
TRUTH = "truth.json"  # the machine of a simulated run, in its folder
ROUNDING = 1e-9  # of unit vectors

Pair = tuple[Finite, Finite]
Length = Annotated[Finite, Field(gt=0)]


class _Camera(Record):
    pinhole_mm: Vector
    axes: tuple[Vector, Vector, Vector]
    focal_px: tuple[Length, Length]
    principal_px: Pair
    distortion: tuple[Finite, Finite, Finite, Finite, Finite]
    width_px: int = Field(ge=16, le=65_536)
    height_px: int = Field(ge=16, le=65_536)


class _Sphere(Record):
    centre_mm: Vector
    radius_mm: Length


class _Document(Record):
    camera: _Camera
    axis: Vector
    axis_point_mm: Vector
    frames: list[Frame] = Field(min_length=1)
    angle_deg: list[Finite] = Field(min_length=1)
    spheres: list[_Sphere] = Field(min_length=1)
    leds_mm: list[Vector]
    shift_mm: list[Vector] | None = None


def truth_file(machine: str) -> str:
    """Name of the file with a machine as it was simulated: truth.json, of a shell truth_a.json."""
    return f"truth_{machine}.json" if machine else TRUTH


def machine_record(machine: Machine, frames: tuple[Frame, ...]) -> dict[str, Any]:
    """The object of machine.json, for a machine with these frames."""
    camera = machine.camera
    spheres = zip(machine.centre.tolist(), machine.radius.tolist(), strict=True)
    return {
        "schema": MACHINE_SCHEMA,
        "camera": {
            "pinhole_mm": camera.pinhole.tolist(),
            "axes": camera.axes.tolist(),
            "focal_px": camera.focal.tolist(),
            "principal_px": camera.principal.tolist(),
            "distortion": camera.distortion.tolist(),
            "width_px": camera.width_px,
            "height_px": camera.height_px,
        },
        "axis": machine.axis.tolist(),
        "axis_point_mm": machine.axis_point.tolist(),
        "frames": [frame.model_dump() for frame in frames],
        "angle_deg": np.degrees(machine.angle).tolist(),
        "spheres": [{"centre_mm": centre, "radius_mm": radius} for centre, radius in spheres],
        "leds_mm": machine.leds.tolist(),
        "shift_mm": None if machine.shift is None else machine.shift.tolist(),
    }


def write_machine(path: Path, machine: Machine, frames: tuple[Frame, ...]) -> None:
    """Write machine.json."""
    text = json.dumps(machine_record(machine, frames), indent=1) + "\n"
    path.write_text(text, encoding="utf-8")


def read_machine(path: Path) -> tuple[Machine, tuple[Frame, ...]]:
    """The machine that a file describes, and its frames.

    Raises:
        InputError: the file is missing or says what cannot be.
    """
    found = read_json(path, _Document, MACHINE_SCHEMA, "name a folder that tbcad calibrate wrote")
    axis, axes = np.array(found.axis), np.array(found.camera.axes)
    if abs(norm(axis) - 1) > ROUNDING or np.abs(axes @ axes.T - np.eye(3)).max() > ROUNDING:
        raise InputError(f"{path}: axes are no unit vectors at right angles: calibrate again")
    if len(found.angle_deg) != len(found.frames):
        raise InputError(f"{path}: another number of angles than frames: calibrate again")
    if found.shift_mm is not None and len(found.shift_mm) != len(found.frames):
        raise InputError(f"{path}: another number of shifts than frames: calibrate again")
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
    return machine, tuple(found.frames)
