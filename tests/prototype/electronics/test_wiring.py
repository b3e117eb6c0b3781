"""The lines of the controller: each light its output, each wire its way through the bore."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.electronics import Wiring, wiring_layout, wiring_rows
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout

PARTS = load_parts()
DRIVE = load_drives(PARTS)[0]


@pytest.fixture(scope="module")
def wiring(spec: PrototypeSpec, stage: StageLayout) -> Wiring:
    return wiring_layout(spec, stage, PARTS)


def test_a_stage_without_leds(spec: PrototypeSpec, stage: StageLayout) -> None:
    bare = replace(stage, leds=np.zeros((0, 3)))
    wiring = wiring_layout(spec, bare, PARTS)
    assert [row["signal"] for row in wiring_rows(wiring, None, DRIVE)] == [
        "lamp",
        "release",
        "home",
        "motor",
        "supply",
    ]
    assert wiring.purchased(None) == {"MOSFET": 1, "CABLE-2x0.25": 6}


def test_wires_that_do_not_fit(spec: PrototypeSpec, stage: StageLayout) -> None:
    narrow = replace(stage, sizes=replace(stage.sizes, wire=0.9))
    with pytest.raises(SpecError, match=r"8 wires of LEDs do not fit .* bore of 1\.8 mm"):
        wiring_layout(spec, narrow, PARTS)


@pytest.mark.parametrize("one", load_drives(PARTS), ids=str)
def test_the_supply_bears_motor_and_lights(wiring: Wiring, one: Drive) -> None:
    """Heat of two phases with rated current, as much work, lamps and LEDs: of 24 V and 2 A."""
    heat = 2 * one.rated_current**2 * one.resistance
    lights = 4 * 2 * 0.05 * PARTS["STRIP-COB-24V"]["watt_m"] + 24 * 0.02 * wiring.leds
    assert 2 * heat + lights < 24 * 2
