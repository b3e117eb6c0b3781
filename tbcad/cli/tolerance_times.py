"""How long each stage of an analysis takes, for the estimate of the time left.

Measured as in tbcad.cli.stage_times: the paper's design on two cores, 1,000 builds.
"""

from pathlib import Path

from tbcad.cli.stage_times import Seconds, look_at, scaled
from tbcad.output.parts import PARTS
from tbcad.tolerance.stages import (
    EVERY_PROCESS,
    MARGINS,
    PICTURES,
    PROTOTYPES,
    RECORD,
    SINGLE_ERRORS,
    TABLES,
    builds_stage,
)

BUILDS = 1000  # of the analysis that was measured
BUILDS_SECONDS = 12.0
PROTOTYPES_SECONDS = 7.0
SEARCHES: Seconds = {SINGLE_ERRORS: 14.0, EVERY_PROCESS: 5.0, MARGINS: 35.0}
PICTURES_SECONDS = 9.0  # of a sensor, whatever the mirrors
TABLES_SECONDS = 2.0


def tolerance_times(
    folder: Path, process: str, builds: int, every_process: bool, margins: bool
) -> Seconds:
    """Expected seconds of each stage of an analysis.

    Args:
        folder: the export.
        process: that makes the builds, by name.
        builds: how many.
        every_process: whether all processes are compared.
        margins: whether margins are searched for.
    """
    n, parts = look_at(folder)
    asked = {SINGLE_ERRORS: True, EVERY_PROCESS: every_process, MARGINS: margins}
    searches = {stage: seconds for stage, seconds in SEARCHES.items() if asked[stage]}
    more = builds / BUILDS
    prototypes = {PROTOTYPES: more * PROTOTYPES_SECONDS} if set(PARTS) <= {*parts} else {}
    return (
        scaled({RECORD: 1.0, builds_stage(builds, process): more * BUILDS_SECONDS} | searches, n)
        | {PICTURES: PICTURES_SECONDS}
        | scaled(prototypes, n)
        | {TABLES: TABLES_SECONDS}
    )
