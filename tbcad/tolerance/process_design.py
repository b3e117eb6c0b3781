"""The design that a process needs: the same but for its margin."""

from tbcad import schedule
from tbcad.errors import InputError
from tbcad.mirrors.array import MirrorDesign
from tbcad.simulate.scene.reflector import reflectors
from tbcad.spec.design import Spec
from tbcad.tolerance.margin import check_share, margin, with_margin
from tbcad.tolerance.montecarlo.builds import MonteCarloCase, simulate
from tbcad.tolerance.montecarlo.draws import Errors
from tbcad.tolerance.montecarlo.edge_model import nominals
from tbcad.tolerance.process.process import Process, errors
from tbcad.types import Floats, Progress

# Machines on which the margin rests, and their seed.
MACHINES = 400
SEED = 1


def for_process(
    spec: Spec, process: Process, wanted: float, progress: Progress = lambda _: None
) -> Spec:
    """The design with the least margin with which a process makes so many machines good.

    Args:
        spec: the design.
        process: how it is made.
        wanted: share of the machines that is to be good.
        progress: told of each margin that is tried.

    Raises:
        InputError: no margin is enough, or the radii do not follow a target.
    """
    check_share(wanted)
    if spec.mirrors.radius_rule != "traced":
        raise InputError(
            f"--for-process sets mirrors.margin_mm, which radii of rule "
            f"{spec.mirrors.radius_rule} do not follow: use --radius-rule traced"
        )
    needed = margin(spec, errors(process, spec.mirrors.coating_um), wanted, _worst, progress)
    if needed.mm is None:
        raise InputError(
            f"process {process.name} does not make {wanted:.1%} of the machines good with any "
            f"margin ({needed.reason}): choose a more exact one, or see tbcad tolerance"
        )
    return with_margin(spec, needed.mm)


def _worst(design: MirrorDesign, errors: Errors) -> Floats:
    task = MonteCarloCase(nominals(reflectors(design)), errors, SEED)
    return simulate(task, MACHINES, schedule.run).worst
