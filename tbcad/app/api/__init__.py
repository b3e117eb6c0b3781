"""The public functions of `import tbcad`: design, build, verify, photograph, calibrate, analyse.

The commands of `tbcad` call the same functions. Heavy libraries are imported inside them, so that
bad input is refused before they are loaded.
"""

from tbcad.app.api.builds import Build, as_made, build, report_page
from tbcad.app.api.captures import (
    Photographs,
    capture,
    dataset,
    photograph,
    relight,
    write_photographs,
)
from tbcad.app.api.designs import design, optimize, to_cadquery
from tbcad.app.api.machines import as_built, calibrate, intrinsics, merge, run, simulate_run
from tbcad.app.api.reconstructions import reconstruct
from tbcad.app.api.verification import analyse, order, tolerance, verify, verify_as_built
from tbcad.app.api.views import Views, refocus, view

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
    "intrinsics",
    "merge",
    "optimize",
    "order",
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
