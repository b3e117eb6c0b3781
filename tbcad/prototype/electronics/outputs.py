"""Which output of the controller switches which light, and in which order they are lit at a stop.

GRBL 1.1 has two outputs only, for spindle and coolant. grblHAL, FluidNC and LinuxCNC number digital
outputs from 0 and switch them by M64 P (on) and M65 P (off), at once when the line is read; a dwell
before makes the line wait until the base is at rest.
Sources: grblHAL core gcode.c and issue 633; LinuxCNC M-codes, M62 to M65.
"""

from dataclasses import dataclass

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import MotionSpec
from tbcad.records.prototype_drive import Phase

LAMP_OUTPUT, LAMP = 0, "lamp"
MAX_OUTPUTS = 8  # digital outputs that FluidNC has, and boards with grblHAL have at most
DARK, LIT = "dark", "lit"


@dataclass(frozen=True)
class Light:
    """A light, and the digital output that switches it."""

    name: str
    output: int


def lights(leds: int, motion: MotionSpec) -> tuple[Light, ...]:
    """Lamp and LEDs by rising output; none with GRBL 1.1, which cannot switch them.

    Raises:
        SpecError: when no controller has so many outputs.
    """
    if motion.controller == "grbl":
        return ()
    if leds >= MAX_OUTPUTS:
        raise SpecError(
            f"prototype.stage.leds_mm has {leds} LEDs, but a controller switches {MAX_OUTPUTS} "
            f"outputs, one of them for the lamp: use at most {MAX_OUTPUTS - 1} LEDs, or set "
            "prototype.motion.controller to grbl and switch them by hand"
        )
    named = [Light(f"led_{i}", LAMP_OUTPUT + i) for i in range(1, leds + 1)]
    return (Light(LAMP, LAMP_OUTPUT), *named)


def phases(leds: int, motion: MotionSpec) -> tuple[Phase, ...]:
    """The photographs of a stop in order: dark, every LED alone, the object lit.

    Without outputs there is one, with the lamp on all the time.

    Raises:
        SpecError: when no controller has so many outputs.
    """
    if not (switched := lights(leds, motion)):
        return (Phase(name=LIT, output=None),)
    lamp, *others = switched
    alone = [Phase(name=light.name, output=light.output) for light in others]
    return (Phase(name=DARK, output=None), *alone, Phase(name=LIT, output=lamp.output))
