"""What made prototypes see: their balls within the windows that the software takes for right.

Every mirror has a window in the photograph of its stop, with a ball in it (tbcad.simulate.prototype
.run). The windows stay where they are in the picture, in pixels; base, balls and camera are off. So
an error of the camera turns all rays of a machine alike, and the others move the balls under them.
Unless they are known: then the software moves the windows along.

Both runs are taken in the frame of the machine, with the object turned in the second.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from tbcad.geometry.rotations import rotated
from tbcad.geometry.vectors import dot, norm, unit
from tbcad.optics.reflection import reflected_rays
from tbcad.optics.windows import cell_windows
from tbcad.simulate.prototype.plan import HALF_TURN, Plan
from tbcad.simulate.prototype.run import PrototypeRun, prototype_runs
from tbcad.simulate.scene.reflector import Reflector
from tbcad.tolerance.montecarlo.draws import Errors
from tbcad.tolerance.prototype.draws import PrototypeDraws, draw
from tbcad.tolerance.prototype.rays import SAMPLES, highlights, least_misses
from tbcad.types import Bools, Floats, Ints

# In the camera: along no symmetry plane of a design, so that it meets no corner of a window.
ASKEW = np.array([1.0, 0.1234, 0.0567])


@dataclass(frozen=True)
class Windowed:
    """The windows of one run's m mirrors, with directions in the camera: right, down, forward.

    Attributes:
        ball: that stands in, (m,).
        stop: at which it does, (m,).
        side: unit directions along the sides of all windows, mirror after mirror, (e, SAMPLES, 3).
        first: where each mirror's sides begin, (m + 1,).
        middle: unit directions of the mirrors' apices, (m, 3).
        across: directions from there to the outline, away from the seam where it halves, (m, 3).
        halved: mirrors that the seam halves, (m,).
    """

    ball: Ints
    stop: Ints
    side: Floats
    first: Ints
    middle: Floats
    across: Floats
    halved: Bools


@dataclass(frozen=True)
class Designed:
    """The prototype as designed, as the fast model needs it.

    Attributes:
        pinhole: mm, (3,).
        axes: the camera's right, down and forward, (3, 3).
        plan: balls on the base, and its stops.
        runs: for camera a's mirrors and for camera b's.
        virtual: number of each mirror's virtual camera, a's mirrors, then b's, (2 m,).
    """

    pinhole: Floats
    axes: Floats
    plan: Plan
    runs: tuple[Windowed, Windowed]
    virtual: Ints

    @property
    def cap(self) -> Bools:
        """Which balls are made, not bought, (k,)."""
        made: Bools = self.plan.body_radius < self.plan.radius
        return made


def designed(reflectors: tuple[Reflector, Reflector], plan: Plan) -> Designed:
    """What the fast model needs of both cameras and the plan."""
    a, b = prototype_runs(reflectors, plan)
    view = reflectors[0].camera
    axes = np.stack([view.right, np.cross(view.forward, view.right), view.forward])
    both = _windowed(a, axes), _windowed(b, axes * HALF_TURN)
    return Designed(view.pinhole, axes, plan, both, _virtual(*both))


def _windowed(run: PrototypeRun, axes: Floats) -> Windowed:
    sides, m = cell_windows(run.at.cells, run.view.pinhole), len(run.at)
    order = np.argsort(sides.mirror, kind="stable")
    mirror = sides.mirror[order]
    t = np.broadcast_to(np.linspace(0, 1, SAMPLES), (len(mirror), SAMPLES))
    still = np.broadcast_to(run.at.u, (m, 3)), np.zeros(m)
    side = sides.rays(t, *still)[order] @ run.turn[mirror] @ axes.T
    apex = unit(run.at.mirrors.apex - run.view.pinhole)
    middle = np.einsum("mx,mxy->my", apex, run.turn) @ axes.T
    first = np.searchsorted(mirror, np.arange(m + 1))
    halved = run.at.mirrors.apex[:, 0] == 0
    outline = np.add.reduceat(side.mean(axis=1), first[:-1]) / np.diff(first)[:, None]
    across = np.where(halved[:, None], outline - middle, ASKEW)
    return Windowed(run.ball, run.stop, side, first, middle, across, halved)


def _virtual(a: Windowed, b: Windowed) -> Ints:
    """Both halves of a mirror on the seam have the number of camera a's (tbcad.optics.trace)."""
    here = np.arange(len(a.ball))
    return np.concatenate([here, np.where(b.halved, here, len(here) - 1 + np.cumsum(~b.halved))])


@dataclass(frozen=True)
class Posed:
    """Camera and balls of one run of one machine as they really are, in the machine's frame.

    Attributes:
        pinhole: mm, (3,).
        lens: what turns directions in the designed camera, as rows, into those in which the
            window's pixels really look, (m, 3, 3).
        centre: of the ball in each window, mm, (m, 3).
        radius: of each, mm, (m,).
        highlight: unit directions in which they show the object's middle, (m, 3).
    """

    pinhole: Floats
    lens: Floats
    centre: Floats
    radius: Floats
    highlight: Floats


def posed(at: Designed, draws: PrototypeDraws, machine: int, half: int) -> Posed:
    """Where camera and balls are when each mirror of one run gets its photograph."""
    run, plan = at.runs[half], at.plan
    on_base = plan.centre[run.ball] + draws.seat[machine, run.ball]
    angle = plan.angle[run.stop] + draws.angle[machine, half, run.stop]
    tilt = Rotation.from_rotvec(draws.tilt[machine] @ plan.frame[1:])
    aside = draws.runout[machine, half, run.stop] @ plan.frame[1:]
    centre = tilt.apply(rotated(on_base, plan.frame[0], angle)) + aside
    radius = plan.radius[run.ball] + draws.radius[machine, run.ball]
    pinhole = at.pinhole + draws.camera_shift[machine]
    lens = _lens(at, draws.camera_tilt[machine], float(draws.focal[machine]))
    lenses = np.repeat(lens[None], len(radius), axis=0)
    return Posed(pinhole, lenses, centre, radius, highlights(pinhole, centre, radius))


def _lens(at: Designed, tilt: Floats, focal: float) -> Floats:
    """A longer focal length makes pictures larger: a pixel's ray lies nearer to the axis."""
    nearer = np.array([[1 / focal], [1 / focal], [1.0]])
    lens: Floats = nearer * Rotation.from_rotvec(tilt).apply(at.axes)
    return lens


def calibrated(at: Designed, half: int, pose: Posed) -> Posed:
    """The same with windows that the software has moved to where the balls really are.

    It knows the camera then, and turns every window about the pinhole, until its middle shows the
    middle of the object.
    """
    run = at.runs[half]
    lens = at.axes @ _turned_onto(unit(run.middle @ at.axes), pose.highlight)
    return replace(pose, lens=lens)


def _turned_onto(here: Floats, there: Floats) -> Floats:
    """Matrices (m, 3, 3) that turn unit vectors (m, 3), as rows, onto others the shortest way."""
    axis = np.cross(here, there)
    skew = np.cross(np.eye(3), axis[:, None])  # row x becomes x cross axis
    turn: Floats = np.eye(3) - skew + skew @ skew / (1 + dot(here, there))[:, None, None]
    return turn


def seen(at: Designed, draws: PrototypeDraws, known: bool = False) -> tuple[Floats, Floats]:
    """What s prototypes see, with the windows as designed, or moved as far as errors are known.

    Returns:
        Coverage diameter of v virtual cameras, mm, (s, v): twice the least distance from the
        object's middle of all rays camera -> edge of the window -> reflected; zero where the
        window does not hold the middle's image; the lesser of a mirror's halves at the seam.
        Then by how much the ray in the middle of each window is off at the object, square to the
        designed ray, mm; infinite without a ball, (s, 2 m).
    """
    diameter = np.full((len(draws), int(at.virtual.max()) + 1), np.inf)
    offset = np.empty((len(draws), len(at.virtual)))
    exact = draw(Errors(), 0, [0], at.cap, len(at.plan.angle))
    aim = [_through(run, posed(at, exact, 0, half)) for half, run in enumerate(at.runs)]
    for machine in range(len(draws)):
        here = [posed(at, draws, machine, half) for half in range(2)]
        if known:
            here = [calibrated(at, half, pose) for half, pose in enumerate(here)]
        pairs = list(zip(at.runs, here, strict=True))
        np.minimum.at(diameter[machine], at.virtual, np.concatenate([_covered(*p) for p in pairs]))
        rays = [_through(*pair) for pair in pairs]
        offset[machine] = np.concatenate([_off(*two) for two in zip(rays, aim, strict=True)])
    return diameter, offset


def _covered(run: Windowed, pose: Posed) -> Floats:
    return 2 * least_misses(
        run.side,
        run.first,
        run.across,
        pose.highlight,
        pose.lens,
        pose.pinhole,
        pose.centre,
        pose.radius,
    )


def _through(run: Windowed, pose: Posed) -> tuple[Floats, Floats]:
    """Points on the balls and unit directions after them of the windows' middle rays, (m, 3) each.

    NaN where there is no ball.
    """
    ray = unit((run.middle[:, None] @ pose.lens)[:, 0])
    to_centre = pose.centre - pose.pinhole
    along = dot(ray, to_centre)
    inside = pose.radius**2 - dot(to_centre, to_centre) + along**2
    half = np.sqrt(np.where(inside < 0, np.nan, inside))
    point = pose.pinhole + (along - half)[:, None] * ray
    return point, reflected_rays(pose.pinhole, point, (point - pose.centre) / pose.radius[:, None])


def _off(ray: tuple[Floats, Floats], aim: tuple[Floats, Floats]) -> Floats:
    """Distance (m,) of rays from those aimed at, in planes through the origin square to these."""
    (point, way), (start, wanted) = ray, aim
    at_plane = point - (dot(point, wanted) / dot(way, wanted))[:, None] * way
    apart = norm(at_plane - start + dot(start, wanted)[:, None] * wanted)
    return np.where(np.isnan(apart), np.inf, apart)
