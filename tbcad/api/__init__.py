"""The public functions of `import tbcad`: design, build, verify, photograph, calibrate, analyse.

The commands of `tbcad` call the same functions. Heavy libraries are imported inside them, so that
bad input is refused before they are loaded.
"""

from tbcad.api.builds import Build, as_made, build, report_page
from tbcad.api.captures import (
    Photographs,
    capture,
    photograph,
    relight,
    write_photographs,
)
from tbcad.api.datasets import dataset, export
from tbcad.api.designs import design, optimize, to_cadquery
from tbcad.api.machines import as_built, calibrate, intrinsics, merge, run, simulate_run
from tbcad.api.reconstructions import reconstruct
from tbcad.api.tolerances import analyse, inspect, tolerance
from tbcad.api.verification import verify, verify_as_built
from tbcad.api.views import Views, refocus, view

__all__ = [
    "Build",
    "Photographs",
    "Views",
    "analyse",
    "as_built",
    "as_made",
    "build",
    "calibrate",
    "capture",
    "dataset",
    "design",
    "export",
    "inspect",
    "intrinsics",
    "merge",
    "optimize",
    "photograph",
    "reconstruct",
    "refocus",
    "relight",
    "report_page",
    "run",
    "simulate_run",
    "to_cadquery",
    "tolerance",
    "verify",
    "verify_as_built",
    "view",
    "write_photographs",
]
