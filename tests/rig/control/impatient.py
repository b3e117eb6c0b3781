"""`tbcad` with shorter waits: the double answers at once, and what is lost is noticed earlier.

python -m tests.rig.control.impatient WORDS... is the command in a process of its own.
"""

import os
import signal
from importlib import import_module

WAITS_S = {
    "grbl.STATUS_S": 0.02,
    "grbl.LOST_OK_S": 0.3,
    "grbl.BANNER_S": 1.0,
    "grbl.LATE_S": 0.05,
    "klipper.LOOK_S": 0.01,
    "klipper.AGAIN_S": 0.01,
    "klipper.STARTING_S": {"startup": 1.0, "disconnected": 0.1},
    "klipper.BACK_S": 1.0,
    "cameras.POLL_S": 0.01,
    "cameras.QUIET_S": 0.05,
}
"""By name below `tbcad.rig.control`."""


def main() -> None:
    from tbcad.app.cli import main as tbcad

    for name, seconds in WAITS_S.items():
        module, _, constant = name.rpartition(".")
        setattr(import_module(f"tbcad.rig.control.{module}"), constant, seconds)
    os.fsync = lambda _: None  # which only a power cut could tell from the real one
    # A shell lets what it starts in the background ignore it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    tbcad()


if __name__ == "__main__":
    main()
