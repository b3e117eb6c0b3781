"""Folders of runs whose photographs are simulated without noise."""

import hashlib
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from tbcad.light.simulate.capture.photograph import Samples, row_bands
from tbcad.light.simulate.parallel import in_threads
from tbcad.light.simulate.prototype.ball_rays import photographed_pixels
from tbcad.light.simulate.prototype.run import Plan, PrototypeRun
from tbcad.light.simulate.scene.ray_casting import Scene
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.run import LIT, PHOTOGRAPHS, RECORD, Frame, RunRecord, exposure_name
from tbcad.rig.machine.designed import machine_runs
from tbcad.rig.machine.machine import Machine
from tbcad.rig.runs import exposure_of
from tbcad.types import Bytes

Change = Callable[[np.ndarray, Frame, str], np.ndarray]
TAKEN = datetime(2026, 1, 1, tzinfo=UTC)
EXPOSURE_S = 0.5
DEPENDS_ON = ("design.json", "mirrors.csv", "balls.csv", "prototype.json", "rotation_plan.csv")


def stop_photograph(run: PrototypeRun, scene: Scene, stop: int, samples: Samples = 1) -> Bytes:
    """The whole photograph of a stop, from 0, (h, w, 3); a pixel is the mean of some rays.

    The run is of camera a's mirrors, or of camera b's with the object turned.
    """
    height, width = run.camera.height_px, run.camera.width_px
    bands = [np.arange(rows.start * width, rows.stop * width) for rows in row_bands(height)]
    colours = in_threads(partial(photographed_pixels, run, scene, stop, samples), bands)
    return np.concatenate(colours).reshape(height, width, 3)


def photographs_of(
    export: ExportedDesign, plan: Plan, machine: Machine, frames: tuple[Frame, ...], scene: Scene
) -> dict[str, np.ndarray]:
    """Photographs of the lit object, by name."""
    runs = machine_runs(export, plan, machine, frames)
    return {
        exposure_name(frame, LIT): stop_photograph(
            runs[frame.object_turn_deg // 180], scene, frame.stop - 1
        )
        for frame in frames
    }


def write_run(
    folder: Path,
    export: ExportedDesign,
    frames: tuple[Frame, ...],
    photographs: dict[str, np.ndarray],
    phases: tuple[str, ...] = (LIT,),
    change: Change = lambda image, _frame, _phase: image,
    suffix: str = "png",
) -> Path:
    """A run as tbcad run leaves it; `change` may alter each image, before it is written."""
    images = folder / PHOTOGRAPHS
    images.mkdir(parents=True)
    camera = export.reflectors[0].camera
    for frame in frames:
        for phase in phases:
            name = exposure_name(frame, phase)
            lit = photographs[exposure_name(frame, LIT)]
            image = change(lit if phase == LIT else np.zeros_like(lit), frame, phase)
            write_exposure(images, frame, phase, image, f"{name}.{suffix}")
    RunRecord(
        export_sha256={name: digest(export.folder / name) for name in DEPENDS_ON},
        source="simulated",
        camera="test",
        width_px=camera.width_px,
        height_px=camera.height_px,
        phases=phases,
        frames=frames,
        locked={},
        seconds=0.0,
    ).write(folder / RECORD)
    return folder


def write_exposure(images: Path, frame: Frame, phase: str, image: np.ndarray, file: str) -> None:
    """A photograph with its sidecar."""
    written, data = cv2.imencode(Path(file).suffix, image[..., ::-1])
    assert written
    (images / file).write_bytes(data.tobytes())
    told = data.tobytes(), Path(file).suffix, (image.shape[1], image.shape[0])
    sidecar = exposure_of(frame, phase, told, EXPOSURE_S, TAKEN)
    sidecar.write((images / file).with_suffix(".json"))


def digest(path: Path) -> str:
    """sha256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
