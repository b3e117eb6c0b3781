"""What one must know to read the figures of a run."""

from __future__ import annotations

import os
import platform
from pathlib import Path

from tbcad.version import __version__

RESULTS = Path(__file__).parent / "results"


def circumstances() -> dict[str, object]:
    """Version, processor and load."""
    return {
        "tbcad": __version__,
        "cores": os.cpu_count(),
        "processor": processor(),
        "python": platform.python_version(),
        "load_before": round(os.getloadavg()[0], 1),
    }


def processor() -> str:
    """The processor's name, where the system tells it."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
