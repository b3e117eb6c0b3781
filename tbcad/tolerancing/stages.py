"""Titles of an analysis' stages: reported as they begin, and known to the estimate of the time."""

RECORD = "record of the export"
SINGLE_ERRORS = "each kind of error by itself"
EVERY_PROCESS = "every process"
MARGINS = "the margins needed"
PICTURES = "pictures"
PROTOTYPES = "prototypes"
TABLES = "tables and plots"


def builds_stage(builds: int, process: str) -> str:
    """Title of the simulated builds by a process, by its name."""
    return f"{builds} simulated builds by {process}"
