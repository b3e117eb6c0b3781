"""What each process would make of a design: a few simulated builds, without search for margins."""

import numpy as np
from tbcad_verify.report.as_made import AsMade, ProcessYield

from tbcad.errors import InputError
from tbcad.light.simulate.scene.reflector import Reflector
from tbcad.tolerancing.montecarlo.builds import CoverageCase, estimate_yield, simulate
from tbcad.tolerancing.montecarlo.edge_model import EdgeModels, edge_models
from tbcad.tolerancing.process.process import BUILT_IN, load_process, process_errors
from tbcad.types import Progress

# As many as cost about 3 % of the processor time of a whole build.
BUILDS = 50
SEED = 1


def as_made(
    cameras: tuple[Reflector, Reflector],
    capture_mm: float,
    coating_um: float,
    detail: Progress = lambda _: None,
) -> AsMade:
    """Simulate builds of both shells by every built-in process; the same answer every time."""
    if not all((one.mirrors.curvature > 0).all() for one in cameras):
        return AsMade(reason="the mirrors are planar")
    models, yields = edge_models(cameras), []
    for name in BUILT_IN:
        detail(name)
        yields.append(_process_yield(models, name, capture_mm, coating_um))
    return AsMade(BUILDS, tuple(sorted(yields, key=lambda one: -one.coverage_mm)))


def _process_yield(
    models: EdgeModels, name: str, capture_mm: float, coating_um: float
) -> ProcessYield:
    errors = process_errors(load_process(name), coating_um)
    try:
        worst = simulate(CoverageCase(models, errors, SEED, worst_only=True), BUILDS).worst
    except InputError:  # errors larger than the radius of a mirror
        return ProcessYield(name, 0.0, 0.0)
    share = estimate_yield(worst, capture_mm).share
    return ProcessYield(name, share, float(np.median(worst)))
