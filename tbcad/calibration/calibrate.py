"""From a run's highlights to a calibrated machine, and what it is based on."""

import math
from dataclasses import dataclass, replace

import numpy as np

from tbcad.calibration.cross_validation import Halves, cross_validation
from tbcad.calibration.detection.detection import Detection
from tbcad.calibration.estimate.parameters import Prior
from tbcad.calibration.estimate.solve import Estimate, estimate
from tbcad.calibration.intrinsics.lens import Lens
from tbcad.calibration.priors import Fitted, prototype_prior, shell_prior
from tbcad.calibration.uncertainty import RayUncertainty, ray_uncertainty
from tbcad.errors import InputError
from tbcad.machine.designed import designed_prototype
from tbcad.machine.machine import Machine
from tbcad.machine.shells import NOT_SERVED, designed_half, half_of, plan_of
from tbcad.records.exposure import Frame
from tbcad.records.prototype import NAME, Prototype
from tbcad.records.run import Geometry
from tbcad.records.tables import StopRow
from tbcad.simulate.prototype.plan import Plan
from tbcad.simulate.scene.exported import ExportedDesign
from tbcad.tolerance.montecarlo.error_kinds import Errors
from tbcad.tolerance.prototype.wind_up import read_wind_up
from tbcad.types import Ints, Progress


@dataclass(frozen=True)
class Setup:
    """A machine before it is calibrated: a prototype, or of a shell see `ShellSetup`.

    Attributes:
        export: of its design.
        plan: its balls and stops.
        frames: that are photographed, in the order of the machine's.
        designed: the machine, at the angles of these frames.
        lens: of its camera, where it is known.
    """

    export: ExportedDesign
    plan: Plan
    frames: tuple[Frame, ...]
    designed: Machine
    lens: Lens | None = None

    def prior(self, errors: Errors, measured: tuple[tuple[int, float, float], ...] = ()) -> Prior:
        """What is known of it by its process and by radii that are measured."""
        home = Prototype.read(self.export.folder / NAME).home
        fitted = Fitted(
            body_centre=self.plan.body_centre,
            is_cap=np.asarray(self.plan.body_radius < self.plan.radius),
            series=np.array([int(frame.object_turn_deg != 0) for frame in self.frames]),
            zero_error=math.radians(home.zero_error_deg),
            lens_known=self.lens is not None,
            measured=measured,
        )
        stop = np.array([frame.stop - 1 for frame in self.frames])
        known = (self.export.folder / StopRow.FILE).is_file()  # not of exports by old versions
        wind_up = read_wind_up(self.export, self.plan)[stop] if known else 0.0
        turned = self.designed.angle + wind_up
        return prototype_prior(replace(self.designed, angle=turned), errors, fitted)


@dataclass(frozen=True)
class ShellSetup(Setup):
    """One camera of a shell before it is calibrated: its mirrors are the balls of its plan."""

    def prior(self, errors: Errors, measured: tuple[tuple[int, float, float], ...] = ()) -> Prior:
        """What is known of it by its process.

        Raises:
            InputError: radii are given as measured, which only balls and caps can be.
        """
        if measured:
            raise InputError("--measured is of balls and caps, and a shell has none: leave it out")
        return shell_prior(self.designed, errors, self.lens is not None)


def prepared_setup(
    export: ExportedDesign,
    frames: tuple[Frame, ...],
    size: tuple[int, int],
    lens: Lens | None,
    geometry: Geometry = "prototype",
) -> Setup:
    """The machine of an export as the frames of a run show it.

    Args:
        export: of its design.
        frames: of the run's record; of a shell those of one camera.
        size: width and height of the run's photographs.
        lens: of the camera, where it is known.
        geometry: of the run.

    Raises:
        InputError: the export has no prototype or LEDs, or another picture's size than the run.
    """
    kind: type[Setup] = Setup if geometry == "prototype" else ShellSetup
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
            "name the export that was photographed"
        )
    stops = len(plan.angle)
    if max(frame.stop for frame in frames) > stops:
        raise InputError(
            f"the run has a stop beyond the {stops} of {export.folder}: name the export that was "
            "photographed"
        )
    angle = np.radians([frame.base_angle_deg for frame in frames])
    camera = machine.camera if lens is None else lens.on(machine.camera)
    return kind(export, plan, frames, replace(machine, angle=angle, camera=camera), lens)


@dataclass(frozen=True)
class MirrorRays:
    """The middle rays of the mirrors whose stops were photographed, over m of them.

    Attributes:
        ids: of the mirrors.
        known: how well each ray is known.
        absent: ids of the mirrors whose frames the run does not have.
    """

    ids: tuple[str, ...]
    known: RayUncertainty
    absent: tuple[str, ...]


@dataclass(frozen=True)
class Calibration:
    """A calibrated machine.

    Attributes:
        setup: before.
        detection: of the highlights.
        found: the estimate.
        rays: of the mirrors.
        halves: how halves of the data agree.
    """

    setup: Setup
    detection: Detection
    found: Estimate
    rays: MirrorRays
    halves: tuple[Halves, ...]


def calibrate(
    setup: Setup, detection: Detection, prior: Prior, progress: Progress = lambda _: None
) -> Calibration:
    """Estimate the machine, and how well its rays are known.

    Raises:
        InputError: there are no highlights.
    """
    found = estimate(prior, detection.highlights, progress)
    progress("uncertainty of the rays")
    ids, absent, frame, sphere = ray_places(setup)
    known = ray_uncertainty(found, frame, sphere)
    halves = cross_validation(found, frame, sphere, progress)
    return Calibration(setup, detection, found, MirrorRays(ids, known, absent), halves)


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
        raise InputError("the run has no stop of the plan: name the export that was photographed")
    frame, sphere = np.array(places).T
    return tuple(ids), tuple(absent), frame, sphere
