"""Coverage of simulated prototypes: their balls within the windows that the software assumes.

Every mirror has a window in the photograph of its stop, with a ball in it
(light.simulate.prototype.run). The windows keep their places in the picture, in pixels; base,
balls and camera are off. So a camera error turns all rays of a build alike, and the other errors
move the balls under the windows. In a calibrated build the software moves the windows along.

Both runs are described in the frame of the prototype, with the object turned in the second.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.core.geometry.rotations import rotated
from tbcad.core.geometry.vectors import dot, norm, perpendicular_axes, unit
from tbcad.core.optics.reflection import reflected_rays, reflection_points
from tbcad.core.optics.sphere_forms import (
    FIRST,
    FORM_TERMS,
    PER_MM,
    Forms,
    effective_centres,
    heights,
    powered_radius,
)
from tbcad.core.optics.windows import cell_windows
from tbcad.light.simulate.prototype.run import (
    HALF_TURN,
    Plan,
    PrototypeRun,
    prototype_runs,
    sight_frames,
)
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.tolerancing.montecarlo.builds import CameraCoverage, CoverageResult
from tbcad.tolerancing.montecarlo.coverage import virtual_camera_numbers
from tbcad.tolerancing.montecarlo.draws import Shape, draw_kinds
from tbcad.tolerancing.montecarlo.edge_model import ASYMMETRIC
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.prototype.gravity import Gravity
from tbcad.tolerancing.prototype.rays import SIDE_SAMPLES, minimum_miss_distances
from tbcad.types import Bools, Floats, Ints

FIRST_STREAM = 1000  # random streams of a build begin here, beyond those of its shells
ITERATIONS = 16  # of the search for the point of a ball that shows the object's centre


@dataclass(frozen=True)
class PrototypeDraws:
    """Errors of s prototypes of k balls and t stops, in the order of the builds.

    The base goes through its stops twice, for camera a's mirrors and for camera b's. A point x of
    the designed base is moved to R(wobble) R(tilt) R(axis, stop's angle + angle) x + runout.
    """

    radius: Floats  # by which balls are too large, mm, (s, k)
    # of the balls' centres on the base without weight, which seats are placed against, mm,
    # (s, k, 3)
    seat: Floats
    cap_tilt: Floats  # of caps about two axes across their own, radians, (s, k, 2)
    angle: Floats  # of the base at stops of both runs, with gravity, radians, (s, 2, t)
    runout: Floats  # of the axis there, along azimuth zero and across it, mm, (s, 2, t, 2)
    # of the base about azimuth zero and across it at those stops, at the object, radians
    wobble: Floats  # (s, 2, t, 2)
    # of caps' fronts: sagittas too large over the part in use, and the form besides that, mm
    # (tbcad.core.optics.sphere_forms), (s, k) and (s, k, t)
    power: Floats
    form: Floats
    sag: Floats  # of displacements by weight as in `Gravity`, as shares of them, (s, 2)
    tilt: Floats  # of the axis about azimuth zero and across, at the object, radians, (s, 2)
    camera_shift: Floats  # of the pinhole, mm, (s, 3)
    camera_tilt: Floats  # rotation vectors about the pinhole, radians, (s, 3)
    focal: Floats  # focal length over the designed one, (s,)

    def __len__(self) -> int:
        return len(self.focal)


def draw_prototypes(
    errors: Errors, seed: int, builds: Sequence[int], is_cap: Bools, gravity: Gravity
) -> PrototypeDraws:
    """Errors of some prototypes; see tbcad.tolerancing.montecarlo.draws.draw_kinds.

    Purchased balls have the errors of their grade, caps (k,) those of a mirror that is a part of
    its own (`Errors.whole_radius`), each with its centre unchanged, and those of a cap's form.
    Gravity is that at the t stops of one run.
    """
    k, t = len(is_cap), len(gravity.wind_up)
    shapes: dict[str, Shape] = {  # in the order of the random streams; only append to it
        "ball_radius": (k,),
        "sphere_radius": (k,),
        "seat": (k, 3),
        "rotation_angle": (2, t),
        "axis_runout": (2, t, 2),
        "axis_tilt": (2,),
        "camera_shift": (3,),
        "camera_tilt": (3,),
        "camera_focal": (),
        "cap_tilt": (k, 2),
        "wind_up": (),
        "sag": (2,),
        "axis_wobble": (2, t, 2),
        "cap_sagitta": (k,),
        **{f"cap_{name}": (k, len(terms)) for name, terms in FORM_TERMS.items()},
    }
    errors = replace(errors, sphere_radius=errors.whole_radius)
    drawn = draw_kinds(errors, seed, builds, shapes, FIRST_STREAM)
    return PrototypeDraws(
        radius=np.where(is_cap, drawn["sphere_radius"], drawn["ball_radius"]),
        seat=drawn["seat"] - errors.weight * gravity.mean,
        cap_tilt=np.where(is_cap[:, None], drawn["cap_tilt"], 0.0),
        angle=drawn["rotation_angle"] + drawn["wind_up"][:, None, None] * gravity.wind_up,
        runout=drawn["axis_runout"],
        wobble=drawn["axis_wobble"],
        power=np.where(is_cap, drawn["cap_sagitta"], 0.0),
        form=np.where(
            is_cap[:, None],
            np.concatenate([drawn[f"cap_{name}"] for name in FORM_TERMS], axis=2),
            0.0,
        ),
        sag=drawn["sag"],
        tilt=drawn["axis_tilt"],
        camera_shift=drawn["camera_shift"],
        camera_tilt=drawn["camera_tilt"],
        focal=1 + drawn["camera_focal"],
    )


@dataclass(frozen=True)
class RunWindows:
    """The windows of one run's m mirrors, as camera directions: right, down, forward."""

    ball: Ints  # number of the ball in each window, (m,)
    stop: Ints  # number of its stop, (m,)
    side: Floats  # unit directions along the sides of all windows, (e, SIDE_SAMPLES, 3)
    first: Ints  # number of each mirror's first side, (m + 1,)
    middle: Floats  # unit directions of the mirrors' apices, (m, 3)
    outward: Floats  # directions from there to the outline, away from the seam, (m, 3)
    halved: Bools  # mirrors that the seam halves, (m,)


@dataclass(frozen=True)
class PrototypeWindows:
    """The prototype as designed, as the fast model needs it."""

    pinhole: Floats  # mm, (3,)
    axes: Floats  # the camera's right, down and forward, (3, 3)
    plan: Plan
    runs: tuple[RunWindows, RunWindows]  # for camera a's mirrors and for camera b's
    virtual: Ints  # number of each mirror's virtual camera, a's mirrors, then b's, (2 m,)
    gravity: Gravity  # at its stops

    @property
    def is_cap(self) -> Bools:
        """Which balls are made instead of purchased, (k,)."""
        return np.asarray(self.plan.body_radius < self.plan.radius)

    @cached_property
    def designed_rays(self) -> list[tuple[Floats, Floats]]:
        """Of each run without errors: see `_middle_rays`."""
        exact = draw_prototypes(Errors(), 0, [0], self.is_cap, self.gravity)
        return [_middle_rays(run, run_pose(self, exact, 0, k)) for k, run in enumerate(self.runs)]


def prototype_model(
    reflectors: tuple[Reflector, Reflector], plan: Plan, gravity: Gravity
) -> PrototypeWindows:
    """The fast model of both cameras, the plan, and what gravity does at its stops."""
    (a, b), view = prototype_runs(reflectors, plan), reflectors[0].camera
    axes = view.axes
    both = _run_windows(a, axes), _run_windows(b, axes * HALF_TURN)
    virtual = virtual_camera_numbers(both[1].halved)
    return PrototypeWindows(view.pinhole, axes, plan, both, virtual, gravity)


def _run_windows(run: PrototypeRun, axes: Floats) -> RunWindows:
    sides, m = cell_windows(run.reflector.cells, run.camera.pinhole), len(run.reflector)
    order = np.argsort(sides.mirror, kind="stable")
    mirror = sides.mirror[order]
    t = np.broadcast_to(np.linspace(0, 1, SIDE_SAMPLES), (len(mirror), SIDE_SAMPLES))
    still = np.broadcast_to(run.reflector.u, (m, 3)), np.zeros(m)
    side = sides.rays(t, *still)[order] @ run.window_rotation[mirror] @ axes.T
    apex = unit(run.reflector.mirrors.apex - run.camera.pinhole)
    middle = np.einsum("mx,mxy->my", apex, run.window_rotation) @ axes.T
    first = np.searchsorted(mirror, np.arange(m + 1))
    halved = run.reflector.mirrors.apex[:, 0] == 0
    outline = np.add.reduceat(side.mean(axis=1), first[:-1]) / np.diff(first)[:, None]
    outward = np.where(halved[:, None], outline - middle, ASYMMETRIC)
    return RunWindows(run.ball, run.stop, side, first, middle, outward, halved)


@dataclass(frozen=True)
class PrototypeResult:
    """Coverage and pointing errors of s prototypes: see CoverageResult."""

    coverage: Floats  # with designed windows, mm, (s, v)
    offset: Floats  # likewise, mm, (s, 2 m)
    calibrated_coverage: Floats  # with windows where the balls are, mm, (s, v)
    calibrated_offset: Floats  # likewise, mm, (s, 2 m)

    @property
    def uncalibrated(self) -> CoverageResult:
        """Builds that are assumed to be the designed one."""
        return CoverageResult(self.coverage, self.offset)

    @property
    def calibrated(self) -> CoverageResult:
        """The same builds, with camera and balls known, so that every window is at its ball."""
        return CoverageResult(self.calibrated_coverage, self.calibrated_offset)


@dataclass(frozen=True)
class PrototypeCase:
    """Simulates builds of the prototype; it can be sent to another process."""

    model: PrototypeWindows
    errors: Errors
    seed: int

    def __call__(self, builds: range) -> PrototypeResult:
        """Result of the builds of these numbers."""
        return prototype_result(self.model, self.draws(builds))

    def draws(self, builds: range) -> PrototypeDraws:
        """Errors of the builds of these numbers."""
        model = self.model
        return draw_prototypes(self.errors, self.seed, builds, model.is_cap, model.gravity)

    def calibrated(self, builds: range) -> CameraCoverage:
        """Only what virtual cameras of these builds cover once calibrated."""
        draws = self.draws(builds)
        poses = (calibrated_poses(self.model, draws, k) for k in range(len(draws)))
        return CameraCoverage(np.array([_coverage(self.model, both) for both in poses]))


@dataclass(frozen=True)
class RunPose:
    """Actual camera and balls of one run of one build, in the prototype's frame."""

    pinhole: Floats  # mm, (3,)
    lens: Floats  # turn directions in the designed camera, as rows, into actual ones, (m, 3, 3)
    centre: Floats  # of the ball in each window, mm, (m, 3)
    radius: Floats  # of each, mm, (m,)
    form: Floats  # of each, (m, FORM_COLUMNS)
    highlight: Floats  # unit directions in which they show the object's centre, (m, 3)


def run_pose(model: PrototypeWindows, draws: PrototypeDraws, build: int, half: int) -> RunPose:
    """Camera and balls when each mirror of one run is photographed."""
    run, plan = model.runs[half], model.plan
    powered = powered_plan(plan, draws.power[build])
    arm = (tilted_centres(powered, draws.cap_tilt[build]) - plan.body_centre)[run.ball]
    by_weight = Rotation.from_rotvec(model.gravity.turned(draws.sag[build])[run.stop, run.ball])
    seat = (plan.body_centre + draws.seat[build])[run.ball]
    seat = seat + model.gravity.sagged(draws.sag[build])[run.stop, run.ball]
    caps = cap_rotations(plan, draws.cap_tilt[build])[run.ball]
    angle = plan.angle[run.stop] + draws.angle[build, half, run.stop]
    tilt = Rotation.from_rotvec(draws.tilt[build] @ plan.frame[1:])
    runout = draws.runout[build, half, run.stop] @ plan.frame[1:]
    wobble = Rotation.from_rotvec(draws.wobble[build, half, run.stop] @ plan.frame[1:])

    def turned(vectors: Floats) -> Floats:
        return np.asarray(wobble.apply(tilt.apply(rotated(vectors, plan.frame[0], angle))))

    centre = turned(seat + by_weight.apply(arm)) + runout
    radius = powered.radius[run.ball] + draws.radius[build, run.ball]
    form = form_rows(plan, draws.form[build])[run.ball]
    for start in range(FIRST, PER_MM, 3):
        form[:, start : start + 3] = turned((by_weight * caps).apply(form[:, start : start + 3]))
    pinhole = model.pinhole + draws.camera_shift[build]
    # A longer focal length makes pictures larger: a pixel's ray is nearer to the axis.
    nearer = np.array([[1 / draws.focal[build]], [1 / draws.focal[build]], [1.0]])
    lens = nearer * Rotation.from_rotvec(draws.camera_tilt[build]).apply(model.axes)
    lenses = np.repeat(lens[None], len(radius), axis=0)
    still = np.zeros(3)
    seen = effective_centres(centre, radius, form, still, pinhole)
    shown = reflection_points(seen, radius, still, pinhole, ITERATIONS)
    return RunPose(pinhole, lenses, centre, radius, form, unit(shown - pinhole))


def powered_plan(plan: Plan, power: Floats) -> Plan:
    """The plan with caps whose sagittas are larger by a power (k,), mm; their apices stay."""
    if plan.half_aperture is None:
        return plan
    return replace(plan, radius=powered_radius(plan.radius, plan.half_aperture, power))


def form_rows(plan: Plan, terms: Floats) -> Floats:
    """Forms of the plan's spheres by their terms, mm, (k, t), as rows (k, FORM_COLUMNS)."""
    half = np.zeros(len(plan)) if plan.half_aperture is None else plan.half_aperture
    return Forms(terms, perpendicular_axes(plan.normal), half).rows()


def tilted_centres(plan: Plan, tilt: Floats) -> Floats:
    """Centres of the reflecting spheres with their bodies tilted in their seats, mm, (k, 3).

    Tilts are about two axes across the normal, radians, (k, 2). A ball's own is its body's, and
    stays.
    """
    arm = plan.centre - plan.body_centre
    return np.asarray(plan.body_centre + cap_rotations(plan, tilt).apply(arm))


def cap_rotations(plan: Plan, tilt: Floats) -> Rotation:
    """Of the bodies in their seats by tilts (k, 2): see `tilted_centres`."""
    return Rotation.from_rotvec(np.einsum("ka,kax->kx", tilt, perpendicular_axes(plan.normal)))


def calibrated_pose(model: PrototypeWindows, half: int, pose: RunPose) -> RunPose:
    """The same with windows as a merge puts them on the actual balls (`prototype_run`)."""
    middle = unit(model.runs[half].middle @ model.axes)
    before = sight_frames(middle, model.pinhole)
    after = sight_frames(pose.highlight, pose.pinhole)
    return replace(pose, lens=model.axes @ np.swapaxes(before, 1, 2) @ after)


def calibrated_poses(model: PrototypeWindows, draws: PrototypeDraws, build: int) -> list[RunPose]:
    """Both runs of one build with their windows moved to the actual balls."""
    return [calibrated_pose(model, k, run_pose(model, draws, build, k)) for k in (0, 1)]


def prototype_result(model: PrototypeWindows, draws: PrototypeDraws) -> PrototypeResult:
    """Coverage and pointing errors of s prototypes, with designed and with calibrated windows.

    Coverage is twice the minimum distance from the object's centre of all rays camera -> edge of
    the window -> reflected; zero where the window does not contain the centre's image; the smaller
    of a mirror's halves at the seam. Offsets are the distance at the object between the ray in the
    middle of each window and the designed ray, square to that; infinite without a ball.
    """
    rows = []
    for build in range(len(draws)):
        poses = [run_pose(model, draws, build, half) for half in (0, 1)]
        known = [calibrated_pose(model, half, pose) for half, pose in enumerate(poses)]
        rows.append((*_seen(model, poses), *_seen(model, known)))
    return PrototypeResult(*map(np.array, zip(*rows, strict=True)))


def _seen(model: PrototypeWindows, poses: list[RunPose]) -> tuple[Floats, Floats]:
    rays = zip(map(_middle_rays, model.runs, poses), model.designed_rays, strict=True)
    return _coverage(model, poses), np.concatenate([_offsets(*pair) for pair in rays])


def _coverage(model: PrototypeWindows, poses: list[RunPose]) -> Floats:
    misses = [
        minimum_miss_distances(
            *((run.side, run.first), run.outward),
            *(pose.highlight, pose.lens, pose.pinhole, pose.centre, pose.radius, pose.form),
        )
        for run, pose in zip(model.runs, poses, strict=True)
    ]
    diameter = np.full(int(model.virtual.max()) + 1, np.inf)
    np.minimum.at(diameter, model.virtual, 2 * np.concatenate(misses))
    return diameter


def _middle_rays(run: RunWindows, pose: RunPose) -> tuple[Floats, Floats]:
    """Points on balls and unit directions after them of windows' middle rays, (m, 3), or NaN."""
    ray = unit((run.middle[:, None] @ pose.lens)[:, 0])
    to_centre = pose.centre - pose.pinhole
    along = dot(ray, to_centre)
    inside = pose.radius**2 - dot(to_centre, to_centre) + along**2
    half_chord = np.sqrt(np.where(inside < 0, np.nan, inside))
    point = pose.pinhole + (along - half_chord)[:, None] * ray
    normal = (point - pose.centre) / pose.radius[:, None]
    normal = unit(normal - heights(pose.form, point - pose.centre)[1])
    return point, reflected_rays(pose.pinhole, point, normal)


def _offsets(ray: tuple[Floats, Floats], designed: tuple[Floats, Floats]) -> Floats:
    """Distance (m,) of rays from designed ones, in planes through the origin square to these."""
    (point, direction), (start, aim) = ray, designed
    at_plane = point - (dot(point, aim) / dot(direction, aim))[:, None] * direction
    apart = norm(at_plane - start + dot(start, aim)[:, None] * aim)
    return np.where(np.isnan(apart), np.inf, apart)
