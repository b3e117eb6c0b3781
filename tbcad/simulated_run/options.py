"""How a run is simulated."""

from dataclasses import dataclass, field

from tbcad.records.exposure import PhaseTimes


@dataclass(frozen=True)
class RunOptions:
    """How a run is simulated.

    Attributes:
        seed: of the build and of all noise.
        stops: numbers of the stops, from 1; None for all.
        phases: that are photographed at each; None for all.
        perfect: a build without errors before a lens without distortion.
        noise: factor of all noise.
        bits: of a pixel's number, 8 or 16.
        shell: both cameras of the shell in place of the prototype.
        led_brightness: of the LEDs, over what fills nine tenths of a pixel in an exposure of 1 s.
        times: of exposure; 1 s where they are not said.
    """

    seed: int = 0
    stops: tuple[int, ...] | None = None
    phases: tuple[str, ...] | None = None
    perfect: bool = False
    noise: float = 1.0
    bits: int = 8
    shell: bool = False
    led_brightness: float = 1.0
    times: PhaseTimes = field(default_factory=PhaseTimes)
