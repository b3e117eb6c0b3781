"""What a controller's program does: where the base goes, and where it waits for a photograph.

Words are read as GRBL 1.1 reads them: comments in brackets and after semicolons are dropped, case
and blanks mean nothing.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from tbcad_verify.types import Floats

COMMENT = re.compile(r"\([^)]*\)|;.*")
WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")
AXES = ("X", "A")
MODES = frozenset({20.0, 91.0})  # inches and steps from where one is: not what the plan is in


@dataclass(frozen=True)
class ProgramRun:
    """A program, run once.

    Attributes:
        moves: (V,) base angles gone to, degrees, in order.
        photographs: (P,) base angles at which a photograph is taken.
        faults: what no such program may have, a few words each.
    """

    moves: Floats
    photographs: Floats
    faults: tuple[str, ...]


def run(text: str) -> ProgramRun:
    """Follow a program from its first line to its last.

    A photograph is taken by M8; in a program without M8 by every M0 after the first move, but for
    the middle one, at which the object is turned.
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
        found = [(letter, float(value)) for letter, value in words]
        codes = {value for letter, value in found if letter == "G"}
        if codes & MODES:
            faults.append(f"line {number} is in inches or relative")
        places = [value for letter, value in found if letter in AXES]
        if places and 92.0 not in codes:
            moves += places
        if moves and ("M", 8.0) in found:
            coolant.append(moves[-1])
        if moves and ("M", 0.0) in found:
            pauses.append(moves[-1])
    middle = len(pauses) // 2
    taken = coolant or pauses[:middle] + pauses[middle + 1 :]
    return ProgramRun(np.array(moves), np.array(taken), tuple(faults))
