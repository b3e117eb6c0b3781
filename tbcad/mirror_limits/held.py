"""What a process chain can hold, next to what a design allows, and what a workshop measures."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot, inf, sqrt
from typing import Any

import numpy as np

from tbcad.core.geometry.vectors import norm
from tbcad.core.optics.zernike import TERMS
from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import ExportedDesign
from tbcad.mirror_limits.sensitivity import MM_PER_UM, SMALLEST_LIMIT, MirrorLimits
from tbcad.tolerancing.montecarlo.builds import CoverageCase, simulate, tolerable_factor
from tbcad.tolerancing.montecarlo.edge_model import cell_radii, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.montecarlo.form import term_shares
from tbcad.tolerancing.process.chain import ChainStep
from tbcad.tolerancing.process.process import Process, process_errors
from tbcad.types import Floats, Ints

HELD, IN_STATISTICS, NOT_HELD = "held", "held in statistics", "not held"
NAMES = ("offset", "tilt", "radius, apex in place", "walls of pedestals")
UNITS = ("um", "mrad", "mm", "um")
TWO_SIGMA = 2.0
BUILDS, SEED = 100, 1
# What is tried in multiples where a chain has nothing of a kind.
PROBES = {
    "warp": Error(MM_PER_UM, length=80.0),
    "waviness": Error(MM_PER_UM),
    "ridge_rounding": Error(mean=0.01),
    "cutter_radius": Error(mean=0.01),
}
ADDED = ("sphere_centre_um", "sphere_radius_um", "warp_um", "waviness_um", "groove_wall_um")
DEFOCUS = (2, 0)
MM_PER_UNIT = {"um": MM_PER_UM, "mm": 1.0}
SAMPLES = 30  # of each half: a day of measuring, a judgement
GOOD = 0.99  # share of the mirrors that is said to be within limits
UNCERTAINTY_SHARE = 0.25  # of a limit that the expanded uncertainty may have: a judgement


def radii_and_halves(export: ExportedDesign) -> tuple[Floats, Floats]:
    """Radius R of mirrors, a's first, and distance h of each one's farthest corner, mm, (m,)."""
    radius = np.concatenate([one.mirrors.radius for one in export.reflectors])
    return radius, np.concatenate([cell_radii(one.cells) for one in export.reflectors])


@dataclass(frozen=True)
class Figure:
    """One figure of a shell: what is allowed, and what the chain holds."""

    name: str
    unit: str
    limit: float | None  # of the mirror that passes it first, or of a shell; None: any
    statistics: float | None  # two standard deviations that give the wanted yield, or any
    chain: float  # two standard deviations of the chain, of that mirror; a fillet as it is
    verdict: str

    @property
    def text(self) -> str:
        """In words."""
        allowed = "any" if self.limit is None else f"{self.limit:.3g} {self.unit}"
        return f"{self.chain:.3g} of {allowed}: {self.verdict}"


@dataclass(frozen=True)
class Chain:
    """A chain as it is asked for, and what its builds of a design show."""

    name: str  # as --process has it
    process: Process
    wanted: float  # yield
    good: float  # yield of the simulated builds
    figures: tuple[Figure, ...]
    each: Floats  # two standard deviations for each mirror, um, mrad, mm, um, (2 m, kinds)
    mandrel_share: Floats  # of what mandrel and replica have together, the mandrel's, (2 m, kinds)

    @property
    def holds(self) -> bool:
        """Whether its yield is the wanted one or more."""
        return self.good >= self.wanted

    @property
    def verdict(self) -> str:
        """Whether it holds the design, in words, and what to do where it does not."""
        word = HELD if self.holds else f"{refused(self.name)}, or another chain"
        share = f"yield {100 * self.good:.3g} % of {BUILDS} simulated pairs of shells"
        return f"{share}, wanted {100 * self.wanted:.4g} %: {word}"


def refused(name: str) -> str:
    """The verdict on what a chain does not hold."""
    return f"{NOT_HELD}: tbcad build --process {name} has larger margins"


def chain_of(
    export: ExportedDesign, process: Process, name: str, found: MirrorLimits, wanted: float
) -> Chain:
    """What a chain holds of the limits of a design, for a wanted yield.

    InputError where the mandrel's cutter does not fit into its smallest pocket, or errors are
    larger than a mirror.
    """
    radius, half = radii_and_halves(export)
    cutter, smallest = process.mandrel_cutter_mm, float(radius.min())
    if cutter is not None and cutter >= smallest:
        raise InputError(
            f"--process {name}: the mandrel's cutter has a radius of {cutter:g} mm, allowed is "
            f"less than that of the smallest mirror, {smallest:.3g} mm: name a smaller one"
        )
    length, kinds = process.warp_um.length_mm, found.each.shape[1]
    each, mandrel, replica = (
        two_sigma(parts, radius, half, length)[:, :kinds]
        for parts in ([process], *mandrel_and_replica(process.made))
    )
    whole = mandrel + replica
    share = np.divide(mandrel, whole, out=np.ones_like(whole), where=whole > 0)
    builds = _Builds(export, process_errors(process, export.spec.mirrors.coating_um), wanted)
    good = float((builds.worst(builds.errors) >= export.capture_mm).mean())
    kind, unit = ("ridge_rounding", "um") if cutter is not None else ("cutter_radius", "mm")
    figures = (
        *_of_mirrors(found, each, name),
        builds.figure("warp, shared", "warp", "um", name),
        builds.figure("waviness, rms", "waviness", "um", name),
        builds.figure("fillet in valleys, radius", kind, unit, name),
    )
    return Chain(name, process, wanted, good, figures, each, share)


def two_sigma(
    parts: Sequence[Process | ChainStep], radius: Floats, half: Floats, warp_length: float
) -> Floats:
    """Two standard deviations of m mirrors by all parts together, (m, 4).

    As a fit of each patch finds them. Offset (um): what centre, radius and defocus of the waviness
    do along the normal. Tilt (mrad) about each axis: the centre across, seen from the apex, and the
    slope of the warp, whose field has the covariance exp(-d^2 / (2 L^2)), L in mm. Radius (mm): its
    own, and that of a defocus d, sqrt(3) d (2 r^2 / h^2 - 1), against a sphere's r^2 / (2 R^2) for
    each mm. Walls (um).
    """
    centre, grown, warp, waviness, wall = (
        hypot(*(getattr(part, kind).sigma for part in parts if getattr(part, kind)))
        for kind in ADDED
    )
    even = np.ones_like(radius)
    defocus = sqrt(3 * term_shares()[TERMS.index(DEFOCUS)]) * waviness
    columns = (
        hypot(centre, grown, defocus) * even,
        np.hypot(centre / radius, warp / warp_length),
        MM_PER_UM * np.hypot(grown, 4 * defocus * (radius / half) ** 2),
        wall * even,
    )
    return TWO_SIGMA * np.stack(columns, axis=1)


def mandrel_and_replica(
    steps: Sequence[ChainStep],
) -> tuple[Sequence[ChainStep], Sequence[ChainStep]]:
    """Steps that make the mandrel, and those from the first on that makes another part of it."""
    first = next((k for k, step in enumerate(steps) if step.mandrel), None)
    if first is None:
        return (), steps
    later = (k for k in range(first + 1, len(steps)) if steps[k].material)
    end = next(later, first + 1)
    return steps[:end], steps[end:]


def _of_mirrors(found: MirrorLimits, each: Floats, name: str) -> list[Figure]:
    """Figures of single mirrors: limits are for all at once, standard deviations for a yield."""
    figures = []
    for k in range(each.shape[1]):
        limit, chain, statistics = found.each[:, k], each[:, k], TWO_SIGMA * found.sigma[:, k]
        tried = ((limit, HELD), (statistics, IN_STATISTICS))
        verdict = next((word for most, word in tried if (chain <= most).all()), refused(name))
        first = int((chain / np.maximum(limit, SMALLEST_LIMIT)).argmax())
        most, spread, holds = (float(of[first]) for of in (limit, statistics, chain))
        figures.append(Figure(NAMES[k], UNITS[k], most, spread, holds, verdict))
    return figures


@dataclass(frozen=True)
class _Builds:
    """Simulated builds of a design, and the yield that is wanted."""

    export: ExportedDesign
    errors: Errors  # of the chain
    wanted: float

    def worst(self, errors: Errors) -> Floats:
        """Minimum coverage of each build with some errors, mm, (s,)."""
        case = CoverageCase(edge_models(self.export.reflectors), errors, SEED, worst_only=True)
        return simulate(case, BUILDS).worst

    def figure(self, words: str, kind: str, unit: str, name: str) -> Figure:
        """How large one kind of error may be beside all others of the chain, by its name.

        0 where the others miss the yield without it.
        """
        own: Error = getattr(self.errors, kind)
        single = replace(Errors(), **{kind: own if own.spread or own.mean else PROBES[kind]})

        def beside(single: Errors) -> Floats:
            return self.worst(replace(self.errors, **{kind: getattr(single, kind)}))

        factor = tolerable_factor(single, self.wanted, self.export.capture_mm, beside)
        sizes = (one.mean or TWO_SIGMA * one.sigma for one in (getattr(single, kind), own))
        probe, chain = (size / MM_PER_UNIT[unit] for size in sizes)
        limit = None if factor == inf else factor * probe
        verdict = HELD if limit is None or chain <= limit else refused(name)
        return Figure(words, unit, limit, limit, chain, verdict)


def sampled(apex: Floats, limits: MirrorLimits, count: int = SAMPLES) -> Ints:
    """Numbers of the mirrors to measure in each half, rising, (k,): tight ones all over the shell.

    Apices are those of one half, mm, (m, 3). Each place is the farthest from all before, the first
    the tightest mirror's; of the mirrors nearest to a place the one with the smallest limits is
    measured, of both halves' by any kind against its median.
    """
    tight = (limits.each / np.median(limits.each, axis=0)).min(axis=1)
    tight = tight.reshape(2, -1).min(axis=0)
    nearest, owner = np.full(len(apex), np.inf), np.zeros(len(apex), dtype=np.int64)
    place = int(tight.argmin())
    for k in range(min(count, len(apex))):
        away = norm(apex - apex[place])
        owner = np.where(away < nearest, k, owner)
        nearest = np.minimum(nearest, away)
        place = int(nearest.argmax())
    groups = (np.flatnonzero(owner == k) for k in range(owner.max() + 1))
    return np.sort([mirrors[tight[mirrors].argmin()] for mirrors in groups])


def confidence(count: int, good: float = GOOD) -> float:
    """Confidence that a share of the mirrors is within limits when a number of random ones are."""
    return float(1 - good**count)


def height_uncertainty(export: ExportedDesign, limits: MirrorLimits) -> float:
    """Largest expanded uncertainty of heights with which all limits can be told, um.

    Of a cell of the half width h a tilt t lifts the rim by h t, a radius that is off by r by
    r h^2 / (2 R^2).
    """
    radius, half = radii_and_halves(export)
    ones = np.ones_like(half)
    lifted = np.stack([ones, half, (half / radius) ** 2 / (2 * MM_PER_UM), ones], axis=1)
    return UNCERTAINTY_SHARE * float((limits.each * lifted[:, : limits.each.shape[1]]).min())


def measurements(
    export: ExportedDesign, limits: MirrorLimits, steps: Sequence[ChainStep], share: Floats
) -> list[dict[str, Any]]:
    """The last instrument that steps name for the mandrel, if there is one, and for the shell.

    With the uncertainty that is required (um), and whether it has that. The mandrel may use a share
    (2 m, kinds) of the limits.
    """
    mandrel, replica = mandrel_and_replica(steps)
    parts = [("Mandrel", mandrel, limits.part(share))] if mandrel else []
    plan = []
    for solid, some, allowed in (*parts, ("Shell", replica, limits)):
        required = height_uncertainty(export, allowed)
        words, verdict = "No instrument is named", "agree on one"
        for one in (step.measured_with for step in some if step.measured_with):
            words = f"{one.value}, U {one.uncertainty_um:g} um"
            fine = one.uncertainty_um <= required
            verdict = "it does" if fine else "too coarse, name another in measured_with"
        row = {"solid": solid, "instrument": words, "required_um": required, "verdict": verdict}
        plan.append(row)
    return plan
