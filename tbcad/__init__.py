"""CAD and verification for a light-field camera made of convex mirrors.

>>> import tbcad
>>> small = tbcad.design(n=4)               # poses and exact radii of all mirrors
>>> small
<Design 'turtleback': n = 4, 49 + 49 mirrors, minimum coverage 60.60 mm>
>>> shell = small.shell("a")                # a build123d part, mm
>>> shell.is_valid
True

The names in `__all__` are the public interface: they change only with an entry in CHANGELOG.md,
and until version 1.0 only in minor releases (0.1 -> 0.2). Every other name may change at any
time. Loading this module is quick; each name is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from tbcad.version import __version__

if TYPE_CHECKING:
    from tbcad_verify.report.report import Report

    from tbcad.app.api import (
        Build,
        Views,
        analyse,
        build,
        calibrate,
        capture,
        dataset,
        design,
        intrinsics,
        merge,
        optimize,
        reconstruct,
        refocus,
        relight,
        run,
        simulate_run,
        to_cadquery,
        tolerance,
        verify,
        view,
    )
    from tbcad.app.whole_design import Design
    from tbcad.core.mirrors.array import MirrorArray
    from tbcad.core.spec.design import Spec
    from tbcad.core.spec.load import load_spec
    from tbcad.errors import InputError
    from tbcad.light.simulate.capture.light_field import LightField
    from tbcad.tolerancing.analysis import Analysis

__all__ = [
    "Analysis",
    "Build",
    "Design",
    "InputError",
    "LightField",
    "MirrorArray",
    "Report",
    "Spec",
    "Views",
    "__version__",
    "analyse",
    "build",
    "calibrate",
    "capture",
    "dataset",
    "design",
    "intrinsics",
    "load_spec",
    "merge",
    "optimize",
    "reconstruct",
    "refocus",
    "relight",
    "run",
    "simulate_run",
    "to_cadquery",
    "tolerance",
    "verify",
    "view",
]

_MODULES = {
    "Analysis": "tbcad.tolerancing.analysis",
    "Design": "tbcad.app.whole_design",
    "InputError": "tbcad.errors",
    "LightField": "tbcad.light.simulate.capture.light_field",
    "MirrorArray": "tbcad.core.mirrors.array",
    "Report": "tbcad_verify.report.report",
    "Spec": "tbcad.core.spec.design",
    "load_spec": "tbcad.core.spec.load",
}


def __getattr__(name: str) -> object:
    """Load a public name when it is first used (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_MODULES.get(name, "tbcad.app.api")), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
