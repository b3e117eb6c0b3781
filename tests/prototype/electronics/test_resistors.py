"""Series resistors against IEC 60063 and Ohm's law."""

import numpy as np
import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.prototype.electronics import E24, e24_at_least, series_resistor
from tbcad.prototype.purchased.parts import load_parts

PARTS = load_parts()
LED = PARTS["LED-3"]


def test_the_series_has_24_values_that_rise_evenly() -> None:
    assert len(E24) == 24
    ratio = np.diff(np.log10([*E24, 100]))
    assert ratio == pytest.approx(np.full(24, 1 / 24), abs=0.025)


@pytest.mark.parametrize(
    ("ohm", "expected"),
    [(180, 180), (181, 200), (2080, 2200), (9.1, 9.1), (92, 100), (0.99, 1), (1e5, 1e5)],
)
def test_next_value(ohm: float, expected: float) -> None:
    assert e24_at_least(ohm) == pytest.approx(expected)


@pytest.mark.parametrize(("supply", "current"), [(5.0, 10.0), (12.0, 20.0), (24.0, 10.0), (24, 3)])
def test_current_is_no_more_than_asked_for_and_a_step_less_at_most(
    supply: float, current: float
) -> None:
    found = series_resistor(LED, current, supply, PARTS)
    drop = supply - LED["forward_v"]
    assert found.current_ma * found.ohm == pytest.approx(1e3 * drop)
    assert 0.9 * current < found.current_ma <= current
    assert found.dissipation_w == pytest.approx(drop**2 / found.ohm)
    assert found.part["power_w"] >= 2 * found.dissipation_w
    assert found.part.name == f"R-{found.part['power_w']:g}W-{found.ohm:g}"


def test_no_circuit() -> None:
    with pytest.raises(SpecError, match="led_ma 25 is more than LED-3 bears: make it 20"):
        series_resistor(LED, 25.0, 24.0, PARTS)
    with pytest.raises(SpecError, match="led_supply_v 3 does not light LED-3"):
        series_resistor(LED, 10.0, 3.0, PARTS)
    none = {name: part for name, part in PARTS.items() if not name.startswith("R-")}
    with pytest.raises(SpecError, match=r"no resistor of 0\.4 W is in resistors\.csv"):
        series_resistor(LED, 10.0, 24.0, none)
