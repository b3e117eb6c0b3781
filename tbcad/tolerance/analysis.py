"""What a process makes of a design: yield, sensitivity, what may be looser, what would do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from tbcad import schedule
from tbcad.errors import InputError
from tbcad.mirrors.array import MirrorDesign
from tbcad.simulate.prototype.plan import read_plan
from tbcad.simulate.scene.exported import Exported
from tbcad.simulate.scene.object import SceneObject
from tbcad.simulate.scene.ray_casting import prepared_scene
from tbcad.simulate.scene.reflector import Reflector, reflectors
from tbcad.simulate.study.viewpoints import ground_truths, viewpoints_around
from tbcad.tolerance.margin import Margin, check_share, margin
from tbcad.tolerance.montecarlo.builds import MonteCarloCase, Result, Yield, simulate, yielded
from tbcad.tolerance.montecarlo.draws import Errors, draw
from tbcad.tolerance.montecarlo.edge_model import EdgeModel, nominals
from tbcad.tolerance.montecarlo.sensitivity import SingleErrorEffect, kinds, one_at_a_time
from tbcad.tolerance.montecarlo.sharpness import Sharpness, Wanted, sharpness
from tbcad.tolerance.process.process import BUILT_IN, Process, errors, load_process
from tbcad.tolerance.prototype import builds
from tbcad.tolerance.prototype.windows import designed
from tbcad.types import Floats, Progress

Halves = tuple[EdgeModel, EdgeModel]

# Machines for each step of a search; what is told of the process itself has as many as asked for.
TRIED = 100
# Machines whose pictures are taken, and viewpoints of each.
PICTURED = 2
VIEWPOINTS = ((20.0, 60.0), 2, 640.0)
# Kinds of error that a shell can have; the others are the prototype's.
SHELL = (
    *("sphere_centre", "sphere_radius", "scale_isotropic", "scale_axis", "shell_shift"),
    *("shell_tilt", "camera_shift", "camera_tilt", "camera_focal", "coating", "facets"),
)


@dataclass(frozen=True)
class Options:
    """What is asked.

    Attributes:
        machines: how many.
        seed: of all of them.
        wanted: share that is to be good.
        left: what a calibration leaves of a mirror's direction, radians.
        scheduler: address of a Dask scheduler; None for this machine's cores.
    """

    machines: int = 1000
    seed: int = 1
    wanted: float = 0.99
    left: float = 0.5e-3
    scheduler: str | None = None

    def checked(self) -> Options:
        """These wishes.

        Raises:
            InputError: what cannot be asked.
        """
        if not 10 <= self.machines <= 1_000_000:
            raise InputError(f"--builds {self.machines}: allowed is 10 to 1000000")
        check_share(self.wanted)
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: allowed is 0 or more")
        if not 0 <= self.left < 0.1:
            raise InputError(f"--calibrated-mrad {1000 * self.left:g}: allowed is 0 to 100")
        return self


@dataclass(frozen=True)
class ProcessOption:
    """A process as a choice for this design.

    Attributes:
        name: of the process.
        yielded: with the design as it is.
        margin: that it needs for the wanted yield.
    """

    name: str
    yielded: Yield
    margin: Margin


@dataclass(frozen=True)
class PrototypeYield:
    """The prototype, made by the process.

    Attributes:
        plain: its machines, taken for the designed ones.
        known: the same machines, calibrated: windows are where the balls really are.
    """

    plain: builds.PrototypeResult
    known: builds.PrototypeResult


@dataclass(frozen=True)
class Analysis:
    """All that is told.

    Attributes:
        process: that makes the machines.
        wishes: what was asked.
        target: coverage of a good machine, mm.
        cameras: camera a and b as designed.
        halves: the same for the fast model.
        result: the machines.
        single_errors: each kind of error by itself, the worst first.
        choices: every built-in process.
        margin: that this process needs.
        sharpness: of pictures.
        stands: the prototype; None where the export has none.
    """

    process: Process
    wishes: Options
    target: float
    cameras: tuple[Reflector, Reflector]
    halves: Halves
    result: Result
    single_errors: tuple[SingleErrorEffect, ...]
    choices: tuple[ProcessOption, ...]
    margin: Margin
    sharpness: Sharpness
    stands: PrototypeYield | None

    @property
    def yielded(self) -> Yield:
        """Share of good machines."""
        return yielded(self.result.worst, self.target)


def analyse(
    export: Exported,
    process: Process,
    subject: SceneObject,
    wishes: Options,
    stage: Progress,
    detail: Progress,
) -> Analysis:
    """Make many machines after an export by a process, and search what would do.

    Args:
        export: the design as it was written.
        process: how it is made.
        subject: what is photographed for the sharpness.
        wishes: what is asked.
        stage: told of each stage.
        detail: told how far a stage has come.

    Raises:
        InputError: mirrors are planar, or the scheduler cannot be reached.
    """
    if not (export.reflectors[0].mirrors.curvature > 0).all():
        raise InputError(
            f"{export.folder} has planar mirrors, whose tolerances are not told: build it with "
            "--radius-rule traced"
        )
    made = _errors(export, process)
    halves = nominals(export.reflectors)
    each = partial(_each, wishes.scheduler)
    target = export.capture_mm
    stage(f"{wishes.machines} machines by {process.name}")
    result = simulate(MonteCarloCase(halves, made, wishes.seed), wishes.machines, each)

    def worst_of(halves: Halves, errors: Errors) -> Floats:
        return simulate(MonteCarloCase(halves, errors, wishes.seed), TRIED, each).worst

    # Every kind is held against no error at all, and each search begins where its loss was told.
    @cache
    def worst(errors: Errors) -> Floats:
        return worst_of(halves, errors)

    stage("each kind of error alone")
    found = [
        one_at_a_time(made, kind, wishes.wanted, target, _told(worst, detail, kind))
        for kind in kinds(made)
        if kind in SHELL
    ]
    stage("every process, and the margin it needs")

    def after(design: MirrorDesign, errors: Errors) -> Floats:
        return worst_of(nominals(reflectors(design)), errors)

    choices = tuple(_choice(export, one, worst, after, wishes, detail) for one in BUILT_IN)
    own = next((one.margin for one in choices if load_process(one.name) == process), None)
    needed = own or margin(export.spec, made, wishes.wanted, after, detail)
    stage("pictures")
    sharp = _sharpness(export, made, subject, wishes, detail)
    stands = None
    if (export.folder / "prototype.json").is_file():
        stage("prototypes")
        stands = _stands(export, made, wishes, each)
    order = sorted(found, key=lambda one: -one.loss)
    return Analysis(
        process, wishes, target, export.reflectors, halves, result, tuple(order), choices, needed,
        sharp, stands,
    )  # fmt: skip


def _errors(export: Exported, process: Process) -> Errors:
    return errors(process, export.spec.mirrors.coating_um)


def _each(scheduler: str | None, work: Any, batches: Sequence[range]) -> list[Any]:
    return schedule.run(work, batches, scheduler)


def _told(
    worst: Callable[[Errors], Floats], detail: Progress, kind: str
) -> Callable[[Errors], Floats]:
    def asked(errors: Errors) -> Floats:
        detail(kind)
        return worst(errors)

    return asked


def _choice(
    export: Exported,
    name: str,
    worst: Callable[[Errors], Floats],
    after: Callable[[MirrorDesign, Errors], Floats],
    wishes: Options,
    detail: Progress,
) -> ProcessOption:
    made = _errors(export, load_process(name))
    detail(name)
    share = yielded(worst(made), export.capture_mm)
    needed = margin(export.spec, made, wishes.wanted, after, lambda text: detail(f"{name}: {text}"))
    return ProcessOption(name, share, needed)


def _sharpness(
    export: Exported, made: Errors, subject: SceneObject, wishes: Options, detail: Progress
) -> Sharpness:
    scene, m = prepared_scene(subject), len(export.reflectors[0])
    views = viewpoints_around(*VIEWPOINTS).cameras(export.capture_mm)
    wanted = Wanted(export.capture_mm, views, ground_truths(scene, views, detail))
    machines = draw(made, wishes.seed, range(PICTURED), m)
    return sharpness(
        export.reflectors, machines, scene, wanted, wishes.left, wishes.seed, "nearest", detail
    )


def _stands(export: Exported, made: Errors, wishes: Options, each: Any) -> PrototypeYield:
    at = designed(export.reflectors, read_plan(export))
    plain, known = (
        builds.simulate(
            builds.PrototypeWork(at, made, wishes.seed, calibrated), wishes.machines, each
        )
        for calibrated in (False, True)
    )
    return PrototypeYield(plain, known)
