"""The process that reads the meshes: `python -m tbcad_verify.worker DIR [PROFILE ...]`.

It writes what it finds to stdout, a line each.
Native code may crash and a foreign file may make it run for ever; the process that waits for this
one then knows which stage it was, and calls it and all that follow unknown.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from tbcad_verify.errors import BadExport
from tbcad_verify.run.results import JsonLinesSink
from tbcad_verify.run.stages import run_stages


def main(folder: Path, printers: list[str]) -> None:
    """Prove one folder; what libraries chatter goes to stderr."""
    lines = JsonLinesSink(os.fdopen(os.dup(1), "w", encoding="utf-8"))
    os.dup2(2, 1)
    try:
        run_stages(folder, lines, printers)
        lines.send({"done": True})
    except BadExport as error:
        lines.send({"refused": str(error)})


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
