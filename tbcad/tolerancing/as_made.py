"""Yields that come with every build: a few simulated ones of its shells and of its prototype."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from tbcad_verify.report.as_made import FEW, AsMade, ProcessYield, enough_bad

from tbcad.common.reuse import kept
from tbcad.core.spec.design import Spec
from tbcad.errors import InputError
from tbcad.light.simulate.prototype.run import read_plan
from tbcad.light.simulate.scene.reflector import ExportedDesign, Reflector
from tbcad.tolerancing.montecarlo.builds import CameraCoverage, Case, CoverageCase, simulate
from tbcad.tolerancing.montecarlo.edge_model import edge_models
from tbcad.tolerancing.montecarlo.error_kinds import Errors
from tbcad.tolerancing.process.process import BUILT_IN, load_process, process_errors
from tbcad.tolerancing.prototype.gravity import read_gravity
from tbcad.tolerancing.prototype.windows import PrototypeCase, PrototypeWindows, prototype_model
from tbcad.types import Progress

BUILDS = FEW  # by a process that may be good; others end when enough of them have failed
AT_ONCE = 5
SEED = 1
PRINTED_BY = "fdm"  # as the verification takes the prototype's parts to be


def as_made(
    cameras: tuple[Reflector, Reflector], spec: Spec, detail: Progress = lambda _: None
) -> AsMade:
    """Simulate builds of both shells by every built-in process; the same answer every time."""
    if not all((one.mirrors.curvature > 0).all() for one in cameras):
        return AsMade(BUILDS, reason="the mirrors are planar")
    coating, target = spec.mirrors.coating_um, spec.optics.capture_diameter_mm
    errors = {name: process_errors(load_process(name), coating) for name in BUILT_IN}
    yields = _shell_yields(cameras, errors, target, detail)
    return AsMade(BUILDS, tuple(sorted(yields, key=lambda one: -one.coverage_mm)))


def prototype_as_made(export: ExportedDesign) -> ProcessYield:
    """Simulate printed prototypes, each with camera and balls known from its calibration.

    The same answer every time. InputError: the prototype's files cannot be read.
    """
    spec, plan = export.spec, read_plan(export)
    model = prototype_model(export.reflectors, plan, read_gravity(export, plan))
    errors = process_errors(load_process(PRINTED_BY), spec.mirrors.coating_um, spec.prototype.caps)
    return _prototype_yield(model, errors, export.capture_mm)


@kept("simulated builds")
def _prototype_yield(model: PrototypeWindows, errors: Errors, target_mm: float) -> ProcessYield:
    return _yield(PrototypeCase(model, errors, SEED).calibrated, PRINTED_BY, target_mm)


@kept("simulated builds", heard=True)
def _shell_yields(
    cameras: tuple[Reflector, Reflector],
    errors: Mapping[str, Errors],
    target_mm: float,
    detail: Progress,
) -> list[ProcessYield]:
    models, yields = edge_models(cameras), []
    for name, own in errors.items():
        detail(name)
        case = CoverageCase(models, own, SEED, worst_only=True)
        yields.append(_yield(case, name, target_mm))
    return yields


def _yield(case: "Case[Any]", name: str, target_mm: float) -> ProcessYield:
    """Yield of few builds, and of fewer where enough are bad."""
    worst = np.empty(0)
    try:
        while len(worst) < BUILDS and (worst < target_mm).sum() < enough_bad(BUILDS):
            found: CameraCoverage = simulate(case, AT_ONCE, first=len(worst))
            worst = np.append(worst, found.worst)
    except InputError:  # errors larger than the radius of a mirror
        return ProcessYield(name, 0.0, 0.0, len(worst))
    share = float((worst >= target_mm).mean())
    return ProcessYield(name, share, float(np.median(worst)), len(worst))
