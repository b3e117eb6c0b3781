"""What may be asked of a reconstruction; light, so that bad values are refused at once."""

from dataclasses import dataclass
from math import isfinite
from typing import Literal

from tbcad.errors import InputError

Order = Literal["0", "1", "auto"]

NODES, EPOCHS = 144, 5  # of the finest grid
LEAST_NODES, MOST_NODES = 16, 512
MOST_EPOCHS = 100
MOST_BLUR_PX = 5.0
MOST_RAYS = 64


@dataclass(frozen=True)
class Options:
    """How a light field is reconstructed.

    Attributes:
        nodes: along each edge of the finest grid.
        epochs: how often each ray is used on the finest grid, and in proportion on others.
        order: of the view dependence of colours; "auto": by rays that are left out.
        rays: of a pixel, on the finest grid; 1: its central ray.
        blur_px: standard deviation of the lens' spread, pixels, on top of the pixel's area, for
            several rays a pixel; None: what the light field says, else 0.
        seed: of all that is random.
    """

    nodes: int = NODES
    epochs: int = EPOCHS
    order: Order = "auto"
    rays: int = 1
    blur_px: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises:
            InputError: a value is out of range.
        """
        ranges = {
            "nodes": (self.nodes, LEAST_NODES, MOST_NODES),
            "epochs": (self.epochs, 1, MOST_EPOCHS),
            "rays": (self.rays, 1, MOST_RAYS),
            "seed": (self.seed, 0, 2**63 - 1),
            "blur": (self.blur_px or 0, 0, MOST_BLUR_PX),
        }
        for name, (value, least, most) in ranges.items():
            if not (isfinite(value) and least <= value <= most):
                raise InputError(
                    f"--{name} is {value:g}, allowed is {least} to {most:g}: change it"
                )
        if self.blur_px and self.rays == 1:
            raise InputError(
                f"--blur {self.blur_px:g} is for several rays a pixel: add --rays 12, or leave "
                "it out"
            )
        if self.order not in ("0", "1", "auto"):
            raise InputError(f"--order is {self.order!r:.40}, allowed is 0, 1 or auto: change it")
