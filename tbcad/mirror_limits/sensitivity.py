"""What a deviation of a mirror or half costs the virtual cameras, and limits of each mirror.

By finite differences: only a mirror and those that touch it see a small deviation, so mirrors that
share no neighbour deviate in the same simulated build.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm as normal

from tbcad.core.geometry.vectors import unit
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.tolerancing.montecarlo.coverage import coverage, virtual_camera_numbers
from tbcad.tolerancing.montecarlo.draws import ShellDraws, draw
from tbcad.tolerancing.montecarlo.edge_model import CURVATURE, EdgeModel, EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.types import Floats, Ints

MM_PER_UM = 1e-3
RAD_PER_MRAD = 1e-3
KINDS = ("offset", "tilt", "radius", "wall")
STEP = np.array([1.0, 0.02, 0.05, 1.0])  # um, mrad, mm, um: edges move by some micrometres
SEAT_STEP_UM = 10.0
SMALLEST_LIMIT = 1e-3  # um, mrad or mm, where nothing is left after rounding down
PLACES = np.array([3, 4, 5, 3])  # decimals of limits: a nanometre, or what turns or bends by less


@dataclass(frozen=True)
class Deviation:
    """Deviations of all mirrors of one half, the apex being the point that stays in its place."""

    offset: Floats  # of the apex along the normal, toward the light, micrometres, (..., m)
    tilt: Floats  # of the normal about two axes across it, mrad, (..., m, 2)
    radius: Floats  # by which the sphere is too large, its apex in place, mm, (..., m)
    wall: Floats  # of all walls of the mirror's pedestal out of it, micrometres, (..., m)

    @classmethod
    def none(cls, builds: int, mirrors: int) -> "Deviation":
        """No deviation in some builds."""
        shape = (builds, mirrors)
        return cls(np.zeros(shape), np.zeros((*shape, 2)), np.zeros(shape), np.zeros(shape))

    def __neg__(self) -> "Deviation":
        return Deviation(-self.offset, -self.tilt, -self.radius, -self.wall)

    def draws(self, model: EdgeModel) -> ShellDraws:
        """The deviations as errors of simulated builds, everything else being as designed."""
        builds, m = self.offset.shape
        return replace(
            draw(Errors(), 0, range(builds), m, walls=len(model.walls))[0],
            centre=self._centre(model),
            radius=self.radius,
            wall=-MM_PER_UM * self.wall[..., model.walls.mirror],
        )

    def _centre(self, model: EdgeModel) -> Floats:
        """How far the spheres' centres are off, mm, (s, m, 3)."""
        radius = 1 / model.table[: len(model), CURVATURE]
        along = self.offset * MM_PER_UM - self.radius
        across = np.einsum("smk,mkd->smd", self.tilt * RAD_PER_MRAD, tilt_axes(model.normal))
        moved: Floats = along[..., None] * model.normal - radius[:, None] * across
        return moved


def tilt_axes(normal: Floats) -> Floats:
    """Two unit vectors across each normal (m, 3) toward which it tilts, (m, 2, 3)."""
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = unit(np.cross(normal, least))
    return np.stack([first, np.cross(normal, first)], axis=1)


def independent_classes(neighbours: list[Ints]) -> Ints:
    """Class of each mirror, (m,): no two touch each other or the same third mirror."""
    colour = np.full(len(neighbours), -1)
    for mirror, near in enumerate(neighbours):
        reach = np.concatenate([near, *(neighbours[one] for one in near)])
        taken = set(colour[reach].tolist())
        colour[mirror] = next(c for c in range(len(neighbours)) if c not in taken)
    return colour


@dataclass(frozen=True)
class Sensitivities:
    """Coverage that k pairs of a virtual camera and a mirror lose for a deviation of the mirror."""

    camera: Ints  # number of the virtual camera, (k,)
    mirror: Ints  # number of the mirror, a's first, (k,)
    loss: Floats  # of each kind, the worse way: mm/um, mm/mrad, mm/mm, mm/um, (k, kinds)
    seat: Floats  # lost when both halves sit wrong by a micrometre, mm/um, (v,)
    coverage: Floats  # of each virtual camera as designed, mm, (v,)

    def total(self, power: int = 1) -> Floats:
        """Sum over a virtual camera's mirrors of the powers of its losses, (v, kinds)."""
        summed = np.zeros((len(self.coverage), self.loss.shape[1]))
        np.add.at(summed, self.camera, self.loss**power)
        return summed


def sensitivities(
    cameras: tuple[Reflector, Reflector], steps: Floats | None = None
) -> Sensitivities:
    """Losses of all virtual cameras by all that they depend on.

    Steps are the deviation of each mirror, a's first, whose loss is taken, (2 m, kinds); without
    them small ones. Mirrors are spheres.
    """
    models = edge_models(cameras)
    designed = _coverage(models, Deviation.none(1, len(models[0])))[0]
    if steps is None:
        kinds = len(KINDS) if len(models[0].walls) else KINDS.index("wall")
        steps = np.tile(STEP[:kinds], (2 * len(models[0]), 1))
    halves = [
        _half(models, half, camera, designed, of_half)
        for half, (camera, of_half) in enumerate(zip(cameras, np.split(steps, 2), strict=True))
    ]
    camera, mirror, loss = map(np.concatenate, zip(*halves, strict=True))
    seat = sum(_seat_losses(models, half, designed) for half in (0, 1))
    return Sensitivities(camera, mirror, loss, np.asarray(seat), designed)


def touching(camera: Reflector) -> list[Ints]:
    """Numbers of the mirrors that share an edge with each."""
    m, faces = len(camera), camera.cells.arcs.faces
    both = np.concatenate([faces, faces[:, ::-1]])
    both = np.unique(both[(both < m).all(axis=1)], axis=0)
    return np.split(both[:, 1], np.searchsorted(both[:, 0], np.arange(1, m)))


def _half(
    models: EdgeModels, half: int, camera: Reflector, designed: Floats, steps: Floats
) -> tuple[Ints, Ints, Floats]:
    """Virtual cameras (k,), mirrors (k,) and losses (k, kinds) by the mirrors of one half."""
    near, m = touching(camera), len(camera)
    seen_by = np.split(virtual_camera_numbers(models[1].halved), 2)[half]
    mirror = np.repeat(np.arange(m), [len(one) + 1 for one in near])
    seen = seen_by[np.concatenate([np.append(one, i) for i, one in enumerate(near)])]
    seen, mirror = np.unique(np.column_stack([seen, mirror]), axis=0).T
    classes = independent_classes(near)
    of_class = classes == np.arange(classes.max() + 1)[:, None]
    lost = [
        _losses(models, half, of_class * step, kind, designed) for kind, step in enumerate(steps.T)
    ]
    loss = np.stack([one[classes[mirror], seen] for one in lost], axis=1) / steps[mirror]
    return seen, mirror + half * m, loss


def _losses(models: EdgeModels, half: int, step: Floats, kind: int, designed: Floats) -> Floats:
    """Coverage lost by one kind of deviation of each class of mirrors (c, m), (c, v)."""
    axes = [_only(kind, step)]
    if KINDS[kind] == "tilt":
        axes.append(replace(axes[0], tilt=axes[0].tilt[..., ::-1]))
    worse = [_worse(designed, (_coverage(models, one, half) for one in (a, -a))) for a in axes]
    return np.asarray(np.sqrt(sum(one**2 for one in worse)))


def _only(kind: int, amount: Floats) -> Deviation:
    """One kind of deviation: amounts (s, m); a tilt is about its first axis."""
    none = Deviation.none(*amount.shape)
    if KINDS[kind] == "tilt":
        return replace(none, tilt=np.stack([amount, np.zeros_like(amount)], axis=-1))
    return replace(none, **{KINDS[kind]: amount})


def _coverage(models: EdgeModels, deviation: Deviation, half: int = 0) -> Floats:
    """Coverage of all virtual cameras when one half deviates, (s, v)."""
    builds, m = deviation.offset.shape
    none = Deviation.none(builds, m)
    draws = [(deviation if k == half else none).draws(model) for k, model in enumerate(models)]
    return coverage(models, (draws[0], draws[1]))


def _worse(designed: Floats, coverages: Iterable[Floats]) -> Floats:
    lowest = np.min(list(coverages), axis=0)
    return np.asarray(np.maximum(designed - lowest, 0.0))


def _seat_losses(models: EdgeModels, half: int, designed: Floats) -> Floats:
    """Coverage lost by a half for a micrometre of its seat, mm/um, (v,).

    The half is moved, and turned about the object's centre by as much over its own width.
    """
    y = models[half].apex[:, 1]
    moved = SEAT_STEP_UM * MM_PER_UM * np.eye(3)
    total = np.zeros_like(designed)
    for field, step in (("shell_shift", moved), ("shell_tilt", moved / np.ptp(y))):
        both = []
        for rows in (step, -step):
            draws = [Deviation.none(len(rows), len(one)).draws(one) for one in models]
            draws[half] = replace(draws[half], **{field: rows})
            both.append(coverage(models, (draws[0], draws[1])))
        total += np.sqrt((_worse(designed, both) ** 2).sum(axis=0)) / SEAT_STEP_UM
    return total


@dataclass(frozen=True)
class MirrorLimits:
    """Limits of all mirrors, a first: offset (um), tilt (mrad), radius (mm), walls (um) if any."""

    each: Floats  # a mirror may be off by this, whatever others do within theirs, (2 m, kinds)
    sigma: Floats  # standard deviations with which the yield is as wanted, (2 m, kinds)
    seat_um: float  # by which each half may sit wrong, also with all mirrors at their limits

    def part(self, share: Floats) -> "MirrorLimits":
        """The same for what may use a share (2 m, kinds) of each limit, rounded down."""
        return replace(self, each=_floor(self.each * share, PLACES[: share.shape[1]]))

    def within(self, steps: Floats, found: Sensitivities) -> "MirrorLimits":
        """The same, no limit more than its part of the deviation whose loss is known."""
        largest = _floor(steps / kinds_and_seat(found), PLACES[: steps.shape[1]])
        return replace(self, each=np.minimum(self.each, largest))


def mirror_limits(found: Sensitivities, target_mm: float, wanted: float) -> MirrorLimits:
    """Share each virtual camera's margin out to the mirrors that it depends on.

    Each kind of deviation, and the seat of the halves, gets an equal part of the margin, and each
    mirror of a virtual camera the same limit; a mirror keeps the smallest limit that its virtual
    cameras ask for. Sums are linear for `each`, and of squares for `sigma`, with which the wanted
    share of the pairs of shells sees all. InputError if a virtual camera sees too little as
    designed.
    """
    margin = found.coverage - target_mm
    if margin.min() <= 0:
        raise InputError(
            f"a virtual camera sees {found.coverage.min():.2f} mm as designed, of {target_mm:g} mm "
            "that are asked for: no deviation is allowed; enlarge mirrors.margin_mm"
        )
    parts = kinds_and_seat(found)
    deviations = normal.ppf(wanted ** (1 / len(margin)))
    each = margin[:, None] / parts / _positive(found.total())
    variance = (margin / deviations)[:, None] ** 2 / parts
    sigma = np.sqrt(variance / _positive(found.total(power=2)))
    seat = margin / parts / _positive(found.seat)
    each, sigma = (_smallest(found.mirror, of[found.camera]) for of in (each, sigma))
    places = PLACES[: found.loss.shape[1]]
    return MirrorLimits(_floor(each, places), _floor(sigma, places), float(_floor(seat.min(), 1)))


def whole_margin_steps(found: Sensitivities, limits: MirrorLimits, radius: Floats) -> Floats:
    """Deviations (2 m, kinds) that would linearly take a whole margin; radii (2 m,), mm."""
    steps = kinds_and_seat(found) * np.maximum(limits.each, SMALLEST_LIMIT)
    column = KINDS.index("radius")
    steps[:, column] = np.minimum(steps[:, column], radius / 2)
    return np.asarray(steps)


def kinds_and_seat(found: Sensitivities) -> int:
    """Number of parts that a margin is shared out in."""
    return int(found.loss.shape[1]) + 1


def _positive(loss: Floats) -> Floats:
    return np.where(loss > 0, loss, np.finfo(float).tiny)


def _floor(limits: Floats, places: Ints | int) -> Floats:
    """Round down to decimal places, as the files have them."""
    scale = 10.0 ** np.asarray(places)
    return np.asarray(np.floor(limits * scale) / scale)


def _smallest(mirror: Ints, allowed: Floats) -> Floats:
    result = np.full((int(mirror.max()) + 1, allowed.shape[1]), np.inf)
    np.minimum.at(result, mirror, allowed)
    return result
