"""The process that reads the meshes: `python -m tbcad_verify.run.worker DIR [PROFILE ...]`.

It sends what it measures to the pipe that is its stdout: `Results`, then None or a `BadExport`.
Native code may crash, and a foreign file may make it run for ever. The process that waits for this
one then knows which stage it was, and reports it and those after it as unknown.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path

from tbcad_verify.errors import BadExport
from tbcad_verify.run.fork import meanwhile
from tbcad_verify.run.stages import run_stages


def main(folder: Path, printers: list[str]) -> None:
    """Run all stages on a folder; what libraries print goes to stderr."""
    pipe = Connection(os.dup(1), readable=False)
    os.dup2(2, 1)
    gc.freeze()  # what the libraries brought stays: no garbage is looked for among it
    send_stages(folder, printers, pipe)


def send_stages(folder: Path, printers: Sequence[str], pipe: Connection) -> None:
    """Run all stages on a folder and send what they measure."""
    try:
        run_stages(folder, pipe.send, printers, meanwhile)
        pipe.send(None)
    except BadExport as error:
        pipe.send(error)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
