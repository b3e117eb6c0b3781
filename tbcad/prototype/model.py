"""The whole prototype: an arrangement with its printed parts as solids."""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

from tbcad.prototype.arrangement import Arrangement
from tbcad.prototype.base.cap_solids import cap_magnets
from tbcad.prototype.base.fasteners import base_fasteners
from tbcad.prototype.fasteners import Fastener, numbered
from tbcad.prototype.frame.camera_gauge import CameraGauge
from tbcad.prototype.frame.layout import frame_purchased_parts
from tbcad.prototype.printing.placing import PrintedPart
from tbcad.prototype.stage.layout import stage_fasteners


@dataclass(frozen=True)
class PrototypeModel(Arrangement):
    """All of the prototype; the balance has the masses of its solids.

    Attributes:
        gauge: that shows where the camera's pinhole is; None without a camera.
        printed: all printed parts.
    """

    gauge: CameraGauge | None
    printed: tuple[PrintedPart, ...]

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
