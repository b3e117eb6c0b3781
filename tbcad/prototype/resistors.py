"""Resistors in series with LEDs: values of the series E24 (IEC 60063), by power."""

import math
from dataclasses import dataclass, replace

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.purchased.parts import Parts, PurchasedPart, of_kind

# Two digits of each decade.
E24 = (
    *(10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30),
    *(33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82, 91),
)
DERATING = 2.0  # rated power over dissipated power, so that a resistor stays below 100 degrees C
ROUNDING = 1e-9


@dataclass(frozen=True)
class SeriesResistor:
    """A resistor in series with an LED."""

    part: PurchasedPart  # to buy; its name has value and rating
    ohm: float  # value
    current_ma: float  # that the LED gets, mA
    dissipation_w: float  # of the resistor while the LED is on, W


def e24_at_least(ohm: float) -> float:
    """The smallest value of the series that is no smaller than a resistance (ohm)."""
    decade = 10.0 ** (math.floor(math.log10(ohm)) - 1)
    values = (round(digits * step, 9) for step in (decade, 10 * decade) for digits in E24)
    return next(value for value in values if value >= ohm * (1 - ROUNDING))


def series_resistor(
    led: PurchasedPart, max_ma: float, supply_v: float, parts: Parts, number: int = 1
) -> SeriesResistor:
    """The resistor with which LEDs in series get a current (mA), or less, from a supply (V).

    SpecError when the LED bears less, the supply is too low, or no resistor is large enough.
    """
    forward = number * led["forward_v"]
    if max_ma > led["max_ma"]:
        raise SpecError(
            f"prototype.stage.led_ma {max_ma:g} is more than {led.name} bears: make it "
            f"{led['max_ma']:g} or less"
        )
    if supply_v <= forward:
        raise SpecError(
            f"prototype.stage.led_supply_v {supply_v:g} does not light {led.name} of {forward:g} "
            f"V: make it greater than {forward:g}"
        )
    ohm = e24_at_least((supply_v - forward) / max_ma * 1e3)
    current = (supply_v - forward) / ohm
    dissipation = current**2 * ohm
    rated = _rated(DERATING * dissipation, parts)
    part = replace(
        rated, name=f"{rated.name}-{ohm:g}", what=f"{rated.what}, {ohm:g} ohm of the series E24"
    )
    return SeriesResistor(part, ohm, current * 1e3, dissipation)


def _rated(watts: float, parts: Parts) -> PurchasedPart:
    """The smallest resistor that is rated for a power."""
    enough = [part for part in of_kind(parts, "resistors") if part["power_w"] >= watts]
    if not enough:
        raise SpecError(
            f"no resistor of {watts:.1f} W is in resistors.csv: make prototype.stage.led_ma or "
            "prototype.stage.led_supply_v smaller"
        )
    return min(enough, key=lambda part: part["power_w"])
