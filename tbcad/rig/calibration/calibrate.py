"""From a run's highlights to a calibrated machine, and what it is based on."""

import math
from dataclasses import dataclass, replace

import numpy as np

from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import Plan
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.records.calibration import HalvesRecord
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.run import Frame, Geometry
from tbcad.records.tables import StopRow
from tbcad.rig.calibration.detection.detection import Detection
from tbcad.rig.calibration.estimate.parameters import Of, Prior
from tbcad.rig.calibration.estimate.solve import Estimate, estimate
from tbcad.rig.calibration.intrinsics.lens import CalibratedLens
from tbcad.rig.calibration.priors import Measured, prototype_prior, shell_prior
from tbcad.rig.calibration.uncertainty import (
    FIGURES,
    PLACES,
    RayUncertainty,
    known_rays,
    ray_slopes,
)
from tbcad.rig.machine.designed import designed_prototype, is_cap, sag_motion
from tbcad.rig.machine.machine import Machine
from tbcad.rig.machine.shells import NOT_SERVED, designed_half, half_of, plan_of
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.prototype.gravity import read_gravity, weightless
from tbcad.types import Bools, Ints, Progress

MIN_HIGHLIGHTS = 10  # of a half
HALVES = {"angles": "frame", "LEDs": "led"}


@dataclass(frozen=True)
class Setup:
    """A machine before it is calibrated: a prototype, or one camera of a shell.

    Of a shell its mirrors are the balls of its plan.
    """

    export: ExportedDesign
    plan: Plan
    frames: tuple[Frame, ...]  # that are photographed, in the order of the machine's
    designed: Machine  # the machine without weight, at the angles of these frames
    lens: CalibratedLens | None = None  # of its camera, where it is known
    geometry: Geometry = "prototype"

    def prior(self, errors: Errors, measured: Measured = ()) -> Prior:
        """Means and standard deviations by its process and by radii that are measured.

        InputError: radii of a shell are given as measured, which only balls and caps can be.
        """
        if self.geometry == "shell":
            if measured:
                raise InputError(
                    "--measured is of balls and caps, and a shell has none: leave it out"
                )
            return shell_prior(self.designed, errors, self.lens is not None)
        home = Prototype.read(self.export.folder / NAME).home
        stop = np.array([frame.stop - 1 for frame in self.frames])
        known = (self.export.folder / StopRow.FILE).is_file()  # not of exports by old versions
        gravity = read_gravity(self.export, self.plan) if known else weightless(self.plan)
        turned = replace(self.designed, angle=self.designed.angle + gravity.wind_up[stop])
        placed = replace(turned, centre=self.plan.centre)
        return prototype_prior(
            turned,
            [
                sag_motion(placed, self.plan.body_centre, sag[stop], turn[stop])
                for sag, turn in zip(gravity.sag, gravity.turn, strict=True)
            ],
            errors,
            np.where(
                is_cap(self.plan)[:, None], self.plan.body_centre - self.plan.sag, turned.centre
            ),
            np.array([int(frame.object_turn_deg != 0) for frame in self.frames]),
            math.radians(home.zero_error_deg),
            self.lens is not None,
            measured,
        )


def prepared_setup(
    export: ExportedDesign,
    frames: tuple[Frame, ...],
    size: tuple[int, int],
    lens: CalibratedLens | None,
    geometry: Geometry = "prototype",
) -> Setup:
    """The machine of a build as frames of a run, of a shell those of one camera, show it.

    InputError: the build has no prototype or LEDs, or another picture's size than the run.
    """
    plan = plan_of(export, geometry, frames)
    machine = (
        designed_prototype(export, plan)
        if geometry == "prototype"
        else designed_half(export, half_of(frames))
    )
    if (machine.camera.width_px, machine.camera.height_px) != size:
        raise InputError(
            f"{export.folder} has a camera of {machine.camera.width_px} x "
            f"{machine.camera.height_px} pixels, the run's photographs have {size[0]} x {size[1]}: "
            "name the build that was photographed"
        )
    stops = len(plan.angle)
    if max(frame.stop for frame in frames) > stops:
        raise InputError(
            f"the run has a stop beyond the {stops} of {export.folder}: name the build that was "
            "photographed"
        )
    angle = np.radians([frame.base_angle_deg for frame in frames])
    camera = machine.camera if lens is None else lens.on(machine.camera)
    seated = machine.centre - plan.sag  # weight is of each frame
    machine = replace(machine, angle=angle, camera=camera, centre=seated)
    return Setup(export, plan, frames, machine, lens, geometry)


@dataclass(frozen=True)
class MirrorRays:
    """The middle rays of the mirrors whose stops were photographed, over m of them."""

    ids: tuple[str, ...]
    known: RayUncertainty
    absent: tuple[str, ...]  # ids of the mirrors whose frames the run does not have


@dataclass(frozen=True)
class MachineCalibration:
    """A calibrated machine."""

    setup: Setup
    detection: Detection
    found: Estimate
    rays: MirrorRays
    halves: tuple[HalvesRecord, ...]


def calibrate(
    setup: Setup, detection: Detection, prior: Prior, progress: Progress = lambda _: None
) -> MachineCalibration:
    """Estimate the machine, and how well its rays are known."""
    found = unbiased_estimate(prior, detection, progress)
    progress("uncertainty of the rays")
    ids, absent, frame, sphere = ray_places(setup)
    known = known_rays(prior, found.values, found.covariance, frame, sphere)
    halves = cross_validation(found, frame, sphere, progress)
    return MachineCalibration(setup, detection, found, MirrorRays(ids, known, absent), halves)


def unbiased_estimate(
    prior: Prior, detection: Detection, progress: Progress = lambda _: None
) -> Estimate:
    """The machine, without what sampling adds to its spots' centroids.

    The contrast that the lens leaves of lines of a cycle a pixel is a figure that residuals show.
    """
    found = estimate(prior, detection.highlights, progress)
    shift = np.broadcast_to(detection.sampling, found.residual.shape)
    square = (shift[found.used] ** 2).sum()
    if square == 0:
        return found
    contrast = np.clip((shift * found.residual)[found.used].sum() / square, 0.0, 1.0)
    whole = detection.highlights
    whole = replace(whole, pixel=whole.pixel - contrast * shift)
    return estimate(prior, whole, progress, found.values)


def ray_places(setup: Setup) -> tuple[tuple[str, ...], tuple[str, ...], Ints, Ints]:
    """Ids of mirrors with a frame, of those without, and frame and sphere of the former."""
    number: dict[tuple[int, int], int] = {
        (frame.object_turn_deg, frame.stop): k for k, frame in enumerate(setup.frames)
    }
    ids, absent, places = [], [], []
    for half, (turn, letter) in enumerate(((0, "a"), (180, "b"))):
        pairs = zip(setup.plan.ball[half].tolist(), setup.plan.stop[half].tolist(), strict=True)
        for mirror, (ball, stop) in enumerate(pairs, 1):
            if ball == NOT_SERVED:
                continue
            frame = number.get((turn, stop + 1))
            name = f"{letter}{mirror:04d}"
            if frame is None:
                absent.append(name)
            else:
                ids.append(name)
                places.append((frame, ball))
    if not places:
        raise InputError("the run has no stop of the plan: name the build that was photographed")
    frame, sphere = np.array(places).T
    return tuple(ids), tuple(absent), frame, sphere


def cross_validation(
    found: Estimate, frame: Ints, sphere: Ints, progress: Progress
) -> tuple[HalvesRecord, ...]:
    """Calibrate from every other frame and from the rest, likewise LEDs; compare rays (m,)."""
    results = []
    for by, field in HALVES.items():
        even = getattr(found.highlights, field) % 2 == 0
        parts = [found.used & side for side in (even, ~even)]
        if min(part.sum() for part in parts) >= MIN_HIGHLIGHTS:
            results.append(_compared(found, by, parts, (frame, sphere), progress))
    return tuple(results)


def _compared(
    found: Estimate, by: str, parts: list[Bools], rays: tuple[Ints, Ints], progress: Progress
) -> HalvesRecord:
    progress(f"halves with {by} apart")
    h = found.highlights
    measured = replace(h, sigma=h.sigma * found.noise_factor)
    one, other = (estimate(found.prior, measured.only(part), start=found.values) for part in parts)
    slopes, _ = ray_slopes(found.prior, found.values, *rays)
    # Parameters of single frames are left out: a half sees every other frame.
    static = np.flatnonzero(~found.prior.is_of(Of.FRAME))
    places = slopes[np.arange(slopes.shape[0]) % FIGURES < PLACES][:, static]
    square = (places.T @ places).toarray()  # of sums of squares over all rays
    known, of_other = (half.covariance_rows(static) for half in (one, other))
    own = float((square * (known + of_other)[:, static]).sum())
    expected = own - 2 * float((square @ known * of_other).sum())
    difference, count = places @ (one.values - other.values)[static], len(rays[0])
    return HalvesRecord(
        apart=by,
        highlights=(len(one.highlights), len(other.highlights)),
        found_mm=math.sqrt(float(difference @ difference) / count),
        expected_mm=math.sqrt(expected / count),
    )
