"""The section `holding` of prototype.json: what holds each ball, against what it needs."""

from typing import Any

from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.fasteners import seat_magnets
from tbcad.prototype.base.held import held_balls
from tbcad.prototype.base.holding import (
    DERATING,
    GLUE_MPA,
    MIN_RATIO,
    REMANENCE_T,
    WIDER_GAP_MM,
    base_motion,
)
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.purchased.parts import Parts
from tbcad.spec.design import Spec


def holding_record(
    spec: Spec, base: BaseLayout, layout: PrototypeLayout, parts: Parts
) -> dict[str, Any]:
    """Assumptions, and a row for each ball in the order of their numbers.

    Raises:
        SpecError: when a magnet is in no list.
    """
    held, magnets = held_balls(base, layout, base_motion(spec)), seat_magnets(base, parts)
    return {
        "min_ratio": MIN_RATIO,
        "remanence_t": REMANENCE_T,
        "derating": DERATING,
        "glue_mpa": GLUE_MPA,
        "wider_gap_mm": WIDER_GAP_MM,
        "balls": [
            {
                "ball": k + 1,
                "by": "glue" if held.glued[k] else "magnet",
                "magnet": magnet.name if magnet else None,
                "force_needed_n": float(held.needed[k]),
                "force_available_n": float(held.available[k]),
                "ratio": float(held.available[k] / held.needed[k]),
                "wider_gap_n": float(held.wider[k]),
            }
            for k, magnet in enumerate(magnets)
        ],
    }
