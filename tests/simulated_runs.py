"""Small simulated runs: five balls, four LEDs, a few stops, and a camera with larger pixels."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.object import built_in_object
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.reflector import read_export
from tbcad.rig.calibration.estimate.parameters import Prior
from tbcad.rig.calibration.priors import prototype_prior
from tbcad.rig.machine.designed import designed_prototype, is_cap, random_build, sag_motion
from tbcad.rig.machine.machine import Machine
from tbcad.rig.runs import frames_of
from tbcad.rig.simulated_run.led_light import Occluders
from tbcad.rig.simulated_run.photographs import ImagingChain, SimulatedRun
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.process.process import load_process, process_errors
from tbcad.tolerancing.prototype.gravity import weightless

FINER = 2  # pixels for one of the export's: highlights of few pixels are hard to see
SEED = 3  # of build and noise
BRIGHT = 3.0  # LEDs: the picture is still smaller than a real one


@dataclass(frozen=True)
class Small:
    """A small run that is photographed, and the prior of its machine."""

    run: SimulatedRun
    prior: Prior

    @property
    def machine(self) -> Machine:
        """As it was simulated."""
        return self.run.built.machine


def fdm_errors() -> Errors:
    return process_errors(load_process("fdm"))


def finer(machine: Machine) -> Machine:
    """The same before a camera with more pixels."""
    camera = machine.camera
    size = {name: FINER * getattr(camera, name) for name in ("focal", "width_px", "height_px")}
    principal = FINER * (camera.principal + 0.5) - 0.5
    return replace(machine, camera=replace(camera, principal=principal, **size))


def small_run(
    folder: Path,
    stops: Sequence[int],
    chain: ImagingChain | None = None,
    subject_mm: float = 0.0,
) -> Small:
    """A run of an export through some stops, from 1, twice, by default with bright LEDs.

    The object hides LEDs if it has a size.
    """
    export = read_export(folder)
    plan = read_plan(export)
    designed = finer(designed_prototype(export, plan))
    kinds = fdm_errors()
    built = random_build(designed, plan, kinds, SEED, gravity=weightless(plan))
    every = frames_of(plan.angle)
    kept = np.array([k for k, frame in enumerate(every) if frame.stop in stops])
    frames = tuple(every[k] for k in kept)
    scene = prepared_scene(built_in_object(subject_mm or 30.0))
    run = SimulatedRun(
        replace(built, machine=built.machine.of_frames(kept)),
        frames,
        scene,
        Occluders(scene.embree if subject_mm else None, None),
        chain or ImagingChain(led_light=BRIGHT),
        SEED,
    )
    series = np.array([frame.object_turn_deg // 180 for frame in frames])
    machine = designed.of_frames(kept)
    still = [sag_motion(machine, plan.body_centre, np.zeros((len(kept), len(plan), 3)))]
    seat = np.where(is_cap(plan)[:, None], plan.body_centre, machine.centre)
    return Small(run, prototype_prior(machine, still, kinds, seat, series))
