"""Effect of a manufacturing process on a design: yield, sensitivity, and the margin needed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from tbcad.common import schedule
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.real_camera import real_optics
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.real_scene import scene_by
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.options.builds import ToleranceOptions
from tbcad.tolerancing.margin import Margin, SolvedDesigns, margin, solved_designs
from tbcad.tolerancing.montecarlo.builds import (
    AnyResult,
    Case,
    CoverageCase,
    CoverageResult,
    MonteCarloCase,
    SingleErrorEffect,
    YieldEstimate,
    estimate_yield,
    one_at_a_time,
    shell_kinds,
    simulate,
    yield_sentence,
)
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.montecarlo.sharpness import Sharpness, reference_views, sharpness
from tbcad.tolerancing.process.process import BUILT_IN, Process, load_process, process_errors
from tbcad.tolerancing.prototype.gravity import read_gravity
from tbcad.tolerancing.prototype.windows import (
    PrototypeCase,
    PrototypeResult,
    prototype_model,
)
from tbcad.types import Floats

NOT_SEARCHED = Margin(None, 0.0, "not searched for: add --margins")
SEARCH_BUILDS = 100  # in each step of a search; the process itself has as many as asked for
PHOTOGRAPHED_BUILDS = 2  # builds whose pictures are simulated


@dataclass(frozen=True)
class ProcessOption:
    """A process as an alternative for this design."""

    name: str
    estimate: YieldEstimate  # yield with the design as it is
    margin: Margin = NOT_SEARCHED  # that it needs for the wanted yield
    builds: int = SEARCH_BUILDS


@dataclass(frozen=True)
class Analysis:
    """Results of simulated builds: yield, causes, margins, sharpness of pictures."""

    process: Process
    options: ToleranceOptions
    target: float  # minimum coverage that a build must have, mm
    cameras: tuple[Reflector, Reflector]  # camera a and b as designed
    edge_models: EdgeModels  # the same for the fast model
    result: CoverageResult
    single_errors: tuple[SingleErrorEffect, ...]  # each kind by itself, the largest loss first
    process_options: tuple[ProcessOption, ...]  # every built-in process, or this one alone
    margin: Margin | None  # that this process needs; None where it was not searched for
    sharpness: Sharpness
    prototype: PrototypeResult | None  # None where the export has none

    def __repr__(self) -> str:
        made = f"yield {self.estimate.share:.1%} of {len(self.result)} builds"
        return f"<Analysis of {self.process.name}: {made}>"

    @property
    def estimate(self) -> YieldEstimate:
        """Yield: share of the builds whose every virtual camera sees the target."""
        return estimate_yield(self.result.worst, self.target)


def analyse(
    export: ExportedDesign, process: Process, scene_object: SceneObject, options: ToleranceOptions
) -> Analysis:
    """Simulate many builds of a design by a process, and find what limits their yield.

    InputError if mirrors are planar, or the scheduler cannot be reached.
    """
    if not (export.reflectors[0].mirrors.curvature > 0).all():
        raise InputError(
            f"{export.folder} has planar mirrors, whose tolerances cannot be analysed: build it "
            "with --radius-rule traced"
        )
    simulator = _Simulator(export, options, edge_models(export.reflectors))
    errors, target = simulator.errors_of(process), export.capture_mm
    options.progress(f"{options.builds} simulated builds by {process.name}")
    case = MonteCarloCase(simulator.edge_models, errors, options.seed)
    result = simulator.all_builds(case)
    options.answer(yield_sentence(process, result.worst, target))
    options.progress("each kind of error by itself")
    # All searches share the builds without errors, and each begins with the builds of its loss.
    worst = cache(simulator.worst_coverage)
    effects = []
    for kind in shell_kinds(errors, len(simulator.edge_models[0].walls)):
        options.detail(kind)
        effects.append(one_at_a_time(errors, kind, options.wanted_yield, target, worst))
    effects.sort(key=lambda one: -one.loss)
    estimate = estimate_yield(result.worst, target)
    compared = [ProcessOption(process.name, estimate, builds=options.builds)]
    if options.process is None:
        options.progress("every process")
        compared = []
        for name in BUILT_IN:
            options.detail(name)
            seen = worst(simulator.errors_of(load_process(name)))
            compared.append(ProcessOption(name, estimate_yield(seen, target)))
    own = None
    if options.margins:
        options.progress("the margins needed")
        margin_of = cache(partial(simulator.margin, solved_designs()))
        own = margin_of(process)
        asked = options.process is not None
        compared = [
            replace(one, margin=margin_of(process if asked else load_process(one.name)))
            for one in compared
        ]
    options.progress("pictures")
    sharp = simulator.sharpness(case, scene_object)
    prototype = None
    if (export.folder / "prototype.json").is_file():
        options.progress("prototypes")
        plan = read_plan(export)
        model = prototype_model(export.reflectors, plan, read_gravity(export, plan))
        prototype = simulator.all_builds(PrototypeCase(model, errors, options.seed))
    return Analysis(
        process, options, target, export.reflectors, simulator.edge_models, result,
        tuple(effects), tuple(compared), own, sharp, prototype,
    )  # fmt: skip


@dataclass(frozen=True)
class _Simulator:
    """Simulates builds of one design, all with the same seed and scheduler."""

    export: ExportedDesign
    options: ToleranceOptions
    edge_models: EdgeModels

    def errors_of(self, process: Process) -> Errors:
        """Errors of a process, but for the coating that the design allows for."""
        spec = self.export.spec
        return process_errors(process, spec.mirrors.coating_um, spec.prototype.caps)

    def all_builds(self, case: Case[AnyResult]) -> AnyResult:
        """Result of as many builds as asked for."""
        total, done = self.options.builds, 0

        def report(batch: range) -> None:
            nonlocal done
            done += len(batch)
            self.options.detail(f"{done} of {total}")

        return simulate(case, total, partial(self._run_batches, report=report))

    def worst_coverage(self, errors: Errors, models: EdgeModels | None = None) -> Floats:
        """Minimum coverage of the builds of a search, of this design or of another."""
        case = CoverageCase(models or self.edge_models, errors, self.options.seed, worst_only=True)
        return simulate(case, SEARCH_BUILDS, self._run_batches).worst

    def _run_batches(
        self, case: Any, batches: Sequence[range], report: Callable[[range], None] = lambda _: None
    ) -> list[Any]:
        return schedule.run_units(case, batches, self.options.scheduler, report)

    def margin(self, designs: SolvedDesigns, process: Process) -> Margin:
        """The margin that a process needs."""
        return margin(
            self.export.spec, self.errors_of(process), self.options.wanted_yield,
            self.worst_coverage, lambda text: self.options.detail(f"{process.name}: {text}"),
            designs,
        )  # fmt: skip

    def sharpness(self, case: MonteCarloCase, scene_object: SceneObject) -> Sharpness:
        """Sharpness of a few builds' pictures."""
        export, options = self.export, self.options
        scene = scene_by(options.optics, scene_object)
        taken_by = real_optics(export)[0] if options.optics == "real" else 1
        reference = reference_views(scene, export.capture_mm, options.detail, taken_by)
        builds, residual = case.draws(range(PHOTOGRAPHED_BUILDS)), options.calibrated_mrad / 1000
        return sharpness(
            export.reflectors, builds, scene, reference, residual, options.seed, options.detail
        )
