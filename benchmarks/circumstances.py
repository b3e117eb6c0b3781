"""What one must know to read the figures of a run."""

from __future__ import annotations

import json
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from tbcad.version import __version__

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

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


def show_and_write(
    out: Path, about: Mapping[str, object], rows: Sequence[DataclassInstance]
) -> None:
    """Print rows and the load after them, and write them with their circumstances as JSON."""
    sys.stdout.writelines(f"{row}\n" for row in rows)
    print(f"load after: {os.getloadavg()[0]:.1f}")
    record = {**about, "rows": [asdict(row) for row in rows]}
    out.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def processor() -> str:
    """The processor's name, where the system tells it."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
