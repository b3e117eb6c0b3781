"""Whether the controller's board has the outputs that the program switches.

Outputs by the boards' maps, read in the sources of the firmware, coolant beside them: grblHAL
STM32F4xx boards/btt_octopus_pro_map.h built without a spindle (AUXOUTPUT0 to 4; its AUXOUTPUT5 is
on another pin than FAN5 in Klipper's file of the board and is not counted); grblHAL RP2040
boards/pico_cnc_map.h (AUX_N_OUT); GRBL 1.1 cpu_map.h.
"""

from __future__ import annotations

import re

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.record.prototype import PROGRAM
from tbcad_verify.report.checks import Check, CheckName, at_most, require

OUTPUTS = {"UNO-CNC-SHIELD": 0, "OCTOPUS-PRO-1.1": 5, "PICOCNC": 8}
SWITCHED = re.compile(r"^M64 P(\d)$", re.MULTILINE)
FILE = PROGRAM
CHECKS = {"board outputs": "outputs"}


def checks(names: list[CheckName], context: PrototypeContext) -> list[Check]:
    """The highest digital output of the program, counted from one, against those of the board."""
    board = context.prototype.controller.board
    outputs = require(OUTPUTS.get(board), f"{board} is no board that is known")
    used = max((int(one) + 1 for one in SWITCHED.findall(context.prototype.program)), default=0)
    return [at_most(names[0], used, outputs, f"of {board}")]
