"""The whole prototype: its layouts, its printed parts as solids, and the drive that turns them."""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.base.cap_solids import cap_magnets
from tbcad.prototype.base.fasteners import base_fasteners
from tbcad.prototype.base.layout import BaseLayout
from tbcad.prototype.base.split import BaseSplit
from tbcad.prototype.drive.balance import BaseBalance
from tbcad.prototype.drive.drive import Drive
from tbcad.prototype.electronics.wiring import Wiring
from tbcad.prototype.fasteners.fastener import Fastener, numbered
from tbcad.prototype.frame.camera_gauge import CameraGauge
from tbcad.prototype.frame.layout import FrameLayout, frame_purchased_parts
from tbcad.prototype.light.shroud import ShroudLayout
from tbcad.prototype.printing.parts import PrintedPart
from tbcad.prototype.purchased.parts import Parts
from tbcad.prototype.stage.fasteners import stage_fasteners
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.design import Spec


@dataclass(frozen=True)
class PrototypeModel:
    """All of the prototype.

    Attributes:
        spec: of the design, with a value for every key.
        layout: balls, their places, the plan of the stops.
        base: layout of the carrier.
        split: how the carrier is cut to fit the bed.
        stage: layout of the object stage.
        wiring: of lamp and LEDs.
        frame: layout of what holds stage, base and camera.
        gauge: that shows where the camera's pinhole is; None without a camera.
        shroud: round the rig, None without.
        printed: all printed parts.
        balance: of what turns with the base.
        drive: that turns it.
        parts: lists of purchased parts.
        capture_radius: of the capture sphere, mm.
    """

    spec: Spec
    layout: PrototypeLayout
    base: BaseLayout
    split: BaseSplit
    stage: StageLayout
    wiring: Wiring
    frame: FrameLayout
    gauge: CameraGauge | None
    shroud: ShroudLayout | None
    printed: tuple[PrintedPart, ...]
    balance: BaseBalance
    drive: Drive
    parts: Parts
    capture_radius: float

    @cached_property
    def fasteners(self) -> tuple[Fastener, ...]:
        """All fasteners in their places, named."""
        base, parts = self.base, self.parts
        return numbered(
            (
                *base_fasteners(base, self.split, self.drive, parts),
                *cap_magnets(base, self.layout, parts),
                *self.frame.fasteners,
                *stage_fasteners(self.stage, parts),
            )
        )

    @property
    def purchased(self) -> dict[str, int]:
        """Quantity of purchased parts by name, without balls and drive."""
        counts = Counter(one.part.name for one in self.fasteners)
        counts.update(frame_purchased_parts(self.frame))
        counts.update(self.wiring.purchased(self.frame.lamps))
        if self.shroud:
            counts[self.shroud.sheet.name] += self.shroud.sheets
        return counts
