"""How far a cap can tilt on its pads: by the play of its spigot in the pocket behind it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tbcad_verify.prototype.context import PrototypeContext
from tbcad_verify.prototype.holding_checks import cylinders
from tbcad_verify.record.prototype import RECORD
from tbcad_verify.report.checks import Check, CheckName, Unknown, each_at_most
from tbcad_verify.step.solids_text import TextSolid

# Once the LEDs have shown it, a degree takes 0.06 mm of the 60: so much tilt takes what a design's
# balls have to spare (0.04 mm at n = 18), a tenth of its share of the margin (docs/prototype.md).
TILT_DEG = 0.5
FILE = RECORD
CHECKS = {"cap tilt": "deg"}


def checks(
    names: list[CheckName],
    context: PrototypeContext,
    carriers: list[TextSolid],
    cap_solids: list[TextSolid],
) -> list[Check]:
    """Largest tilt of each cap about its body's centre, by its spigot in the carrier's pocket."""
    balls = context.prototype.balls
    which = np.flatnonzero(balls.cap)
    if not which.size:
        return []
    tilts = [
        math.degrees(math.asin(play / end)) for play, end in spigots(context, carriers, cap_solids)
    ]
    return [each_at_most(names[0], balls.names(which), np.array(tilts), TILT_DEG, "deg", "tilts: ")]


def spigots(
    context: PrototypeContext, carriers: list[TextSolid], cap_solids: list[TextSolid]
) -> Iterator[tuple[float, float]]:
    """Of each cap the play of its spigot to a side, and the end's distance from its centre, mm.

    Unknown: there is no spigot, or none that goes into a pocket.
    """
    which = np.flatnonzero(context.prototype.balls.cap)
    for k, cap in zip(which.tolist(), cap_solids, strict=True):
        own = [*cylinders(context, [cap], k, hollow=False)]
        if len({round(radius, 6) for radius, *_ in own}) != 1:
            raise Unknown(f"the cap of ball {k + 1} has no spigot")
        sockets = cylinders(context, carriers, k, hollow=True)
        play = min((socket for socket, *_ in sockets), default=np.nan) - own[0][0]
        if not play > 0:
            raise Unknown(f"the spigot of ball {k + 1} does not go into a pocket")
        yield play, max(end for *_, end in own)
