"""Simulate the run of a random build: all photographs, as files of a run's folder."""

import zlib
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime
from io import BytesIO
from os import PathLike
from pathlib import Path
from time import monotonic

import numpy as np
from PIL import Image

from tbcad.common.atomic_files import write_errors_as_input_errors
from tbcad.errors import InputError
from tbcad.light.simulate.capture.real import RealOptics
from tbcad.light.simulate.capture.sensor import Image16, SimulatedSensor
from tbcad.light.simulate.parallel import THREADS
from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.real_camera import LEFT_OUT_OF_RUNS, real_optics
from tbcad.light.simulate.scene.lamps import lit_by, read_lamps
from tbcad.light.simulate.scene.object import SceneObject, built_in_object
from tbcad.light.simulate.scene.object_from_file import ObjectOptions, load_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.real_scene import real_scene
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.light.simulate.scene.upper_lamps import upper_screen
from tbcad.options.machines import SimulateRunOptions
from tbcad.options.shared import exposures
from tbcad.output.folder import check_replaceable, replacing
from tbcad.output.single_files import Source, refuse_inputs
from tbcad.prototype.balls.catalogue import recorded_roughness_nm
from tbcad.records.camera_sheet import RealOpticsRecord
from tbcad.records.run import (
    PHOTOGRAPHS,
    RECORD,
    Frame,
    Geometry,
    PhaseTimes,
    RunRecord,
)
from tbcad.records.tables import SagRow, StopRow
from tbcad.rig.machine.designed import (
    BuiltPrototype,
    designed_build,
    designed_prototype,
    dome_radius,
    random_build,
)
from tbcad.rig.machine.machine import truth_file, write_machine
from tbcad.rig.machine.shells import perfect_half, random_half, shell_frame
from tbcad.rig.runs import export_digests, exposure_of, frames_of
from tbcad.rig.simulated_run.led_light import Occluders, stage_scene
from tbcad.rig.simulated_run.photographs import (
    EXPOSURE_S,
    LED_LIGHT,
    ImagingChain,
    SimulatedRun,
    phases_of,
)
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.prototype.gravity import read_gravity
from tbcad.types import Progress

CAMERA = "simulated"
MIRRORS = ("design.json", "mirrors.csv")
DEPENDS_ON: dict[Geometry, tuple[str, ...]] = {
    "prototype": (*MIRRORS, "prototype.json", "balls.csv", "rotation_plan.csv"),
    "shell": MIRRORS,
}
BY_WEIGHT: dict[Geometry, tuple[str, ...]] = {
    "prototype": (StopRow.FILE, SagRow.FILE),
    "shell": (),
}
"""Files that it depends on too where a build has them."""
# Most pixels are black: runs of one number alone are as quick to find, and a third of the bytes.
PNG = {"compress_level": 1, "compress_type": zlib.Z_RLE}
# Of a simulated camera there is no clock: photographs follow each other from here.
BEGIN = datetime(2022, 11, 1, tzinfo=UTC)


Builds = tuple[tuple[BuiltPrototype, tuple[Frame, ...]], ...]


def prepare_run(
    export: ExportedDesign, errors: Errors, subject: SceneObject, options: SimulateRunOptions
) -> tuple[tuple[SimulatedRun, ...], tuple[str, ...]]:
    """A random build of a build before it is photographed, and the phases to photograph.

    It is the prototype, or both cameras of the shell. InputError: the build has no prototype with
    LEDs, or a shell with planar mirrors, or has not the stops or phases asked for.
    """
    times = PhaseTimes(*exposures(options.exposure_leds, options.exposure_lit))
    builds = (_shells if options.shell else _prototype)(export, errors, options)
    leds = len(builds[0][0].machine.leds)
    phases = times.phases(_chosen_phases(options.phase_names(), phases_of(leds)))
    # Before a shell nothing stands, and its object is as bright from all sides.
    lamps = None if options.shell else read_lamps(export.folder)
    real, told = _real(export, options)
    if real is None:
        scene = prepared_scene(lit_by(lamps, subject) if lamps else subject)
    else:
        scene = real_scene(export, subject, lamps, options.gloss)
    if not options.shell:
        scene = replace(scene, screen=upper_screen(export.folder))
    stage = None if options.shell else stage_scene(export.folder)
    occluders = Occluders(scene.embree, stage)
    chain = ImagingChain(
        SimulatedSensor(bits=options.bits, noise=options.noise),
        dome=dome_radius(export),
        led_light=LED_LIGHT * options.led_brightness,
        times=times,
        real=real,
        told=told,
    )
    runs = []
    for whole, every in builds:
        frames = _chosen_stops(options.stop_numbers(), every)
        kept = np.array([every.index(frame) for frame in frames])
        built = replace(whole, machine=whole.machine.of_frames(kept))
        runs.append(SimulatedRun(built, frames, scene, occluders, chain, options.seed))
    return tuple(runs), phases


def _real(
    export: ExportedDesign, options: SimulateRunOptions
) -> tuple[RealOptics | None, RealOpticsRecord | None]:
    """Lens and mirrors, and what the run's record says of them; None with ideal optics."""
    if options.optics == "ideal":
        return None, None
    optics, told = real_optics(
        export, None if options.shell else recorded_roughness_nm(export.folder)
    )
    own = {"gloss": options.gloss, "bits": options.bits, "left_out": LEFT_OUT_OF_RUNS}
    return optics, told.model_copy(update=own)


def _prototype(export: ExportedDesign, errors: Errors, options: SimulateRunOptions) -> Builds:
    """One build with all stops of both runs."""
    plan = read_plan(export)
    designed = designed_prototype(export, plan)
    if options.perfect:
        built = designed_build(designed, plan)
    else:
        gravity = read_gravity(export, plan)
        built = random_build(designed, plan, errors, options.seed, gravity=gravity)
    return ((built, frames_of(plan.angle)),)


def _shells(export: ExportedDesign, errors: Errors, options: SimulateRunOptions) -> Builds:
    """One frame of each camera."""
    return tuple(
        (
            perfect_half(export, half)
            if options.perfect
            else random_half(export, half, errors, options.seed),
            (shell_frame(half),),
        )
        for half in range(len(export.reflectors))
    )


def _chosen_phases(asked: tuple[str, ...] | None, every: tuple[str, ...]) -> tuple[str, ...]:
    wrong = [phase for phase in asked or () if phase not in every]
    if wrong:
        raise InputError(f"phase {wrong[0]} is not photographed: allowed is {', '.join(every)}")
    return tuple(phase for phase in every if asked is None or phase in asked)


def _chosen_stops(asked: tuple[int, ...] | None, every: tuple[Frame, ...]) -> tuple[Frame, ...]:
    last = max(frame.stop for frame in every)
    wrong = [stop for stop in asked or () if not 1 <= stop <= last]
    if wrong:
        raise InputError(f"stop {wrong[0]} is not in the plan: allowed is 1 to {last}")
    return tuple(frame for frame in every if asked is None or frame.stop in asked)


def write_run(
    runs: tuple[SimulatedRun, ...],
    phases: tuple[str, ...],
    export: Path,
    out: Path,
    progress: Progress,
) -> None:
    """Photograph all frames and write a run's folder, atomically.

    The runs are the prototype, or both cameras of the shell. InputError: the folder holds
    something, or cannot be written.
    """
    check_is_free(out, (export,))
    with replacing(out, "run", force=False, inputs=(export,)) as new:
        (new / PHOTOGRAPHS).mkdir()
        record = _record(runs, phases, export)
        record.write(new / RECORD)
        for name, run in zip(record.machines, runs, strict=True):
            write_machine(new / truth_file(name), run.built.machine, run.frames)
            _write_frames(run, phases, new / PHOTOGRAPHS, progress)


def check_is_free(out: Path, inputs: Iterable[Source] = ()) -> None:
    """Refuse a folder that holds something, or is not apart from what is read.

    Photographs are never overwritten.
    """
    with write_errors_as_input_errors(out):
        refuse_inputs(out, inputs)
        if out.exists() and (not out.is_dir() or any(out.iterdir())):
            raise InputError(f"{out} holds files, and photographs are not replaced: name another")
    check_replaceable(out, "run", force=False)


def _write_frames(
    run: SimulatedRun, phases: tuple[str, ...], folder: Path, progress: Progress
) -> None:
    run.maps  # noqa: B018 - once, before threads ask for it
    count = len(run.frames)

    def frame(number: int) -> None:
        for phase, image in run.frame_photographs(number, phases).items():
            seconds = EXPOSURE_S * run.chain.exposure(phase)
            _write_photograph(folder, run.frames[number], phase, image, seconds)

    started = monotonic()
    with ThreadPoolExecutor(THREADS) as pool:
        for done, _ in enumerate(pool.map(frame, range(count)), 1):
            left = (monotonic() - started) / done * (count - done)
            progress(f"frame {done} of {count}, {left:.0f} s left")


def _write_photograph(
    folder: Path, frame: Frame, phase: str, image: Image16, seconds: float
) -> None:
    file = BytesIO()
    Image.fromarray(image).save(file, "png", **PNG)
    data, size = file.getvalue(), (image.shape[1], image.shape[0])
    sidecar = exposure_of(frame, phase, (data, ".png", size), seconds, BEGIN)
    (folder / sidecar.file).write_bytes(data)
    sidecar.write((folder / sidecar.file).with_suffix(".json"))


def _record(runs: tuple[SimulatedRun, ...], phases: tuple[str, ...], export: Path) -> RunRecord:
    camera, frames = runs[0].built.machine.camera, tuple(f for run in runs for f in run.frames)
    geometry: Geometry = "prototype" if len(runs) == 1 else "shell"
    return RunRecord(
        export_sha256=export_digests(export, DEPENDS_ON[geometry], BY_WEIGHT[geometry]),
        source="simulated",
        camera=CAMERA,
        width_px=camera.width_px,
        height_px=camera.height_px,
        phases=phases,
        frames=frames,
        locked={},
        seconds=EXPOSURE_S * len(frames) * sum(map(runs[0].chain.exposure, phases)),
        geometry=geometry,
        real=runs[0].chain.told,
    )


def run_object(
    export: ExportedDesign,
    file: str | PathLike[str] | None,
    options: ObjectOptions | None = None,
    told: Progress | None = None,
) -> SceneObject:
    """The object of a file, or the built-in one in the size that stands on the stage.

    InputError: the file cannot be read, or the object is larger than the capture sphere.
    """
    stage = export.spec.prototype.stage
    room = min(export.capture_mm, stage.object_diameter_mm, 2 * abs(stage.top_mm))
    if file is None:
        return built_in_object(room)
    return load_object(file, export.capture_mm, options, told)
