"""Effect of a manufacturing process on a design: yield, sensitivity, and the margin needed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from tbcad.common import schedule
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.object import SceneObject
from tbcad.light.simulate.scene.ray_casting import prepared_scene
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.options.builds import ToleranceOptions
from tbcad.tolerancing.margin import Margin, SolvedDesigns, margin, solved_designs
from tbcad.tolerancing.montecarlo.builds import (
    AnyResult,
    Case,
    CoverageCase,
    MonteCarloCase,
    ShellResult,
    YieldEstimate,
    estimate_yield,
    simulate,
    yield_sentence,
)
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.montecarlo.sensitivity import (
    SingleErrorEffect,
    WorstCoverage,
    one_at_a_time,
    shell_kinds,
)
from tbcad.tolerancing.montecarlo.sharpness import Sharpness, reference_views, sharpness
from tbcad.tolerancing.process.process import BUILT_IN, Process, load_process, process_errors
from tbcad.tolerancing.prototype.windows import (
    PrototypeCase,
    PrototypeResult,
    prototype_model,
    read_wind_up,
)
from tbcad.types import Floats

SEARCH_BUILDS = 100  # in each step of a search; the process itself has as many as asked for
PHOTOGRAPHED_BUILDS = 2  # builds whose pictures are simulated


@dataclass(frozen=True)
class ProcessOption:
    """A process as an alternative for this design."""

    name: str
    estimate: YieldEstimate  # yield with the design as it is
    margin: Margin | None  # that it needs for the wanted yield; None where it was not searched for
    builds: int = SEARCH_BUILDS


@dataclass(frozen=True)
class Analysis:
    """What simulated builds say of a design: yield, causes, margins, sharpness of pictures."""

    process: Process
    options: ToleranceOptions
    target: float  # minimum coverage of a good build, mm
    cameras: tuple[Reflector, Reflector]  # camera a and b as designed
    edge_models: EdgeModels  # the same for the fast model
    result: ShellResult
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
        """Share of good builds."""
        return estimate_yield(self.result.worst, self.target)


def analyse(
    export: ExportedDesign, process: Process, scene_object: SceneObject, options: ToleranceOptions
) -> Analysis:
    """Simulate many builds of an export by a process, and find what limits their yield.

    InputError if mirrors are planar, or the scheduler cannot be reached.
    """
    if not (export.reflectors[0].mirrors.curvature > 0).all():
        raise InputError(
            f"{export.folder} has planar mirrors, whose tolerances cannot be analysed: build it "
            "with --radius-rule traced"
        )
    errors = process_errors(process, export.spec.mirrors.coating_um)
    simulator = _Simulator(export, options, edge_models(export.reflectors))
    options.progress(f"{options.builds} simulated builds by {process.name}")
    result = simulator.all_builds(MonteCarloCase(simulator.edge_models, errors, options.seed))
    options.answer(yield_sentence(process, result.worst, export.capture_mm))
    options.progress("each kind of error by itself")
    # All searches share the builds without errors, and each begins with the builds of its loss.
    worst = cache(simulator.worst_coverage)
    single_errors = _single_errors(simulator, errors, worst)
    chosen = ProcessOption(
        process.name, estimate_yield(result.worst, export.capture_mm), None, options.builds
    )
    process_options = _process_options(simulator, chosen, worst)
    own_margin = None
    if options.margins:
        options.progress("the margins needed")
        process_options, own_margin = _margins(simulator, process, process_options)
    options.progress("pictures")
    sharp = _sharpness(simulator, errors, scene_object)
    prototype = None
    if (export.folder / "prototype.json").is_file():
        options.progress("prototypes")
        plan = read_plan(export)
        model = prototype_model(export.reflectors, plan, read_wind_up(export, plan))
        prototype = simulator.all_builds(PrototypeCase(model, errors, options.seed))
    return Analysis(
        process, options, export.capture_mm, export.reflectors, simulator.edge_models, result,
        single_errors, process_options, own_margin, sharp, prototype,
    )  # fmt: skip


@dataclass(frozen=True)
class _Simulator:
    """Simulates builds of one export, all with the same seed and scheduler."""

    export: ExportedDesign
    options: ToleranceOptions
    edge_models: EdgeModels

    def all_builds(self, case: Case[AnyResult]) -> AnyResult:
        """Result of as many builds as asked for."""
        total, done = self.options.builds, 0

        def report(batch: range) -> None:
            nonlocal done
            done += len(batch)
            self.options.detail(f"{done} of {total}")

        return simulate(case, total, partial(self._run_batches, report=report))

    def worst_coverage(self, errors: Errors, models: EdgeModels | None = None) -> Floats:
        """Minimum coverage of the builds of a search, of the export or of another design."""
        case = CoverageCase(models or self.edge_models, errors, self.options.seed, worst_only=True)
        return simulate(case, SEARCH_BUILDS, self._run_batches).worst

    def _run_batches(
        self, case: Any, batches: Sequence[range], report: Callable[[range], None] = lambda _: None
    ) -> list[Any]:
        return schedule.run_units(case, batches, self.options.scheduler, report)


def _single_errors(
    simulator: _Simulator, errors: Errors, worst: WorstCoverage
) -> tuple[SingleErrorEffect, ...]:
    wanted, target = simulator.options.wanted_yield, simulator.export.capture_mm
    effects = []
    for kind in shell_kinds(errors, len(simulator.edge_models[0].walls)):
        simulator.options.detail(kind)
        effects.append(one_at_a_time(errors, kind, wanted, target, worst))
    return tuple(sorted(effects, key=lambda one: -one.loss))


def _process_options(
    simulator: _Simulator, chosen: ProcessOption, worst: WorstCoverage
) -> tuple[ProcessOption, ...]:
    """Every process with its yield, or the one that was asked for."""
    if simulator.options.process is not None:
        return (chosen,)
    simulator.options.progress("every process")
    export, options = simulator.export, []
    for name in BUILT_IN:
        simulator.options.detail(name)
        errors = process_errors(load_process(name), export.spec.mirrors.coating_um)
        options.append(ProcessOption(name, estimate_yield(worst(errors), export.capture_mm), None))
    return tuple(options)


def _margins(
    simulator: _Simulator, process: Process, compared: Sequence[ProcessOption]
) -> tuple[tuple[ProcessOption, ...], Margin]:
    """The same processes with the margins that they need, and the margin of the one asked for."""
    asked, designs = simulator.options.process is not None, solved_designs()
    own = _margin(simulator, process, designs)

    def margin_of(name: str) -> Margin:
        one = process if asked else load_process(name)
        return own if one == process else _margin(simulator, one, designs)

    return tuple(replace(option, margin=margin_of(option.name)) for option in compared), own


def _margin(simulator: _Simulator, process: Process, designs: SolvedDesigns) -> Margin:
    spec, wanted = simulator.export.spec, simulator.options.wanted_yield
    errors = process_errors(process, spec.mirrors.coating_um)
    return margin(
        spec, errors, wanted, simulator.worst_coverage,
        lambda text: simulator.options.detail(f"{process.name}: {text}"), designs,
    )  # fmt: skip


def _sharpness(simulator: _Simulator, errors: Errors, scene_object: SceneObject) -> Sharpness:
    export, options = simulator.export, simulator.options
    scene = prepared_scene(scene_object)
    reference = reference_views(scene, export.capture_mm, options.detail)
    case = MonteCarloCase(simulator.edge_models, errors, options.seed)
    builds = case.draws(range(PHOTOGRAPHED_BUILDS))
    residual = options.calibrated_mrad / 1000
    return sharpness(
        export.reflectors, builds, scene, reference, residual, options.seed, progress=options.detail
    )
