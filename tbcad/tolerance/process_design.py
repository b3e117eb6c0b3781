"""The design for a process: the same but for the margin that the process needs."""

from tbcad import schedule
from tbcad.errors import InputError
from tbcad.mirrors.array import MirrorDesign
from tbcad.simulate.scene.reflector import reflectors
from tbcad.spec.design import Spec
from tbcad.tolerance.margin import check_yield, margin, with_margin
from tbcad.tolerance.montecarlo.builds import MonteCarloCase, simulate
from tbcad.tolerance.montecarlo.draws import Errors
from tbcad.tolerance.montecarlo.edge_model import edge_models
from tbcad.tolerance.process.process import Process, process_errors
from tbcad.types import Floats, Progress

# Simulated builds that the margin is computed from, and their seed.
BUILDS = 400
SEED = 1


def spec_for_process(
    spec: Spec, process: Process, wanted_yield: float, progress: Progress = lambda _: None
) -> Spec:
    """The design with the minimum margin with which a process reaches a yield.

    Args:
        spec: the design.
        process: how it is made.
        wanted_yield: share of the builds that are to be good.
        progress: called with each margin that is tried.

    Raises:
        InputError: no margin is enough, or the radii do not follow a target.
    """
    check_yield(wanted_yield)
    if spec.mirrors.radius_rule != "traced":
        raise InputError(
            f"--for-process sets mirrors.margin_mm, which radii of rule "
            f"{spec.mirrors.radius_rule} do not follow: use --radius-rule traced"
        )
    errors = process_errors(process, spec.mirrors.coating_um)
    needed = margin(spec, errors, wanted_yield, _worst_coverage, progress)
    if needed.mm is None:
        raise InputError(
            f"process {process.name} does not make {wanted_yield:.1%} of the builds good with any "
            f"margin ({needed.reason}): choose a more exact one, or see tbcad tolerance"
        )
    return with_margin(spec, needed.mm)


def _worst_coverage(design: MirrorDesign, errors: Errors) -> Floats:
    case = MonteCarloCase(edge_models(reflectors(design)), errors, SEED)
    return simulate(case, BUILDS, schedule.run_units).worst
