"""What a controller's program does: where the base goes, and where photographs are taken.

Words are read as GRBL 1.1 reads them: comments in brackets and after semicolons are dropped, case
and blanks have no meaning.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from tbcad_verify.types import Floats

COMMENT = re.compile(r"\([^)]*\)|;.*")
WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")
AXES = ("X", "A")
FOREIGN_MODES = frozenset({20.0, 91.0})  # inches, and relative moves


@dataclass(frozen=True)
class ProgramRun:
    """A program, run once.

    Attributes:
        moves: (V,) base angles that are driven to, degrees, in order.
        photographs: (P,) base angles at which a photograph is taken.
        faults: what no such program may contain, a few words each.
    """

    moves: Floats
    photographs: Floats
    faults: tuple[str, ...]


def run_program(text: str) -> ProgramRun:
    """Run a program from its first line to its last.

    A photograph is taken by M8; in a program without M8 by every M0 after the first move, except
    for the middle one, at which the object is rotated.
    """
    moves: list[float] = []
    coolant: list[float] = []
    pauses: list[float] = []
    faults: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        plain = re.sub(r"\s", "", COMMENT.sub("", line)).upper()
        words = WORD.findall(plain)
        if "".join(letter + value for letter, value in words) != plain:
            faults.append(f"line {number} is no G-code")
            continue
        numbers = [(letter, float(value)) for letter, value in words]
        codes = {value for letter, value in numbers if letter == "G"}
        if codes & FOREIGN_MODES:
            faults.append(f"line {number} is in inches or relative")
        targets = [value for letter, value in numbers if letter in AXES]
        if targets and 92.0 not in codes:
            moves += targets
        if moves and ("M", 8.0) in numbers:
            coolant.append(moves[-1])
        if moves and ("M", 0.0) in numbers:
            pauses.append(moves[-1])
    middle = len(pauses) // 2
    photographs = coolant or pauses[:middle] + pauses[middle + 1 :]
    return ProgramRun(np.array(moves), np.array(photographs), tuple(faults))
