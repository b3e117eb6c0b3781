"""Fasteners of the stage in their places: the set screw that holds the plug, and the LEDs."""

from collections.abc import Iterator

import numpy as np

from tbcad.prototype.fasteners.fastener import Fastener
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, of_kind
from tbcad.prototype.stage.arms import UP
from tbcad.prototype.stage.crown import PLUG_MM, SCREW_DIRECTION, SEAT_MM, CrownSizes
from tbcad.prototype.stage.layout import StageLayout

THREAD_MM = 3.0
BEYOND_POST_MM = 0.5  # that the set screw may stand out of the post


def stage_fasteners(stage: StageLayout, parts: Parts) -> Iterator[Fastener]:
    """The plug's set screw through the post, and the LEDs in their pockets."""
    screw, tip = _set_screw(stage.sizes, parts), stage.sizes.plug - SEAT_MM
    height = np.array([0.0, 0.0, stage.sizes.joint - PLUG_MM / 2])
    place = (tip + screw["length_mm"]) * SCREW_DIRECTION + height
    yield Fastener(screw, place, -SCREW_DIRECTION, ("stage_post", "stage_crown"))
    below = stage.led["height_mm"] - stage.led["diameter_mm"] / 2
    for dome in stage.leds:
        yield Fastener(stage.led, dome - below * UP, UP, ("stage_crown",))


def _set_screw(sizes: CrownSizes, parts: Parts) -> PurchasedPart:
    """The longest set screw that does not stand out of the post; else the shortest."""
    room = sizes.post - (sizes.plug - SEAT_MM) + BEYOND_POST_MM
    screws = sorted(
        of_kind(parts, "setscrews", thread_mm=THREAD_MM), key=lambda one: one["length_mm"]
    )
    fitting = [screw for screw in screws if screw["length_mm"] <= room]
    return fitting[-1] if fitting else screws[0]
