"""A program's arguments, and what one must know to read the figures of a run."""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tbcad.version import __version__

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

RESULTS = Path(__file__).parent / "results"


def asked(
    about: str, name: str, *own: tuple[str, Mapping[str, Any]], rounds: int | None = None
) -> argparse.Namespace:
    """Arguments of a program: its own, and `out`, by default results/NAME.json.

    With `rounds` where they have a default, and the circumstances before any work as `about`.
    """
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for flag, how in own:
        parser.add_argument(flag, **how)
    if rounds is not None:
        parser.add_argument("--rounds", type=int, default=rounds, help="how often each is run")
    parser.add_argument("--out", type=Path, default=RESULTS / f"{name}.json", help="file to write")
    found = parser.parse_args(namespace=argparse.Namespace(rounds=1))
    found.about = {**circumstances(), "rounds": found.rounds}
    return found


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
