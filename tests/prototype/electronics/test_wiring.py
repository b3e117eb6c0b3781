"""The lines of the controller: each light its output, each wire its way through the bore."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.electronics.wiring import COLUMNS, Wiring, wiring_layout, wiring_rows
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import PrototypeSpec

PARTS = load_parts()
DRIVE = load_drives(PARTS)[0]
OUTPUTS = {"by hand", "coolant", "limit X", "driver X", "supply"}


@pytest.fixture(scope="module")
def wiring(spec: PrototypeSpec, stage: StageLayout) -> Wiring:
    return wiring_layout(spec, stage, PARTS)


def test_a_line_for_each_light_and_the_release(wiring: Wiring) -> None:
    rows = wiring_rows(wiring, None, DRIVE)
    assert all(set(row) == set(COLUMNS) for row in rows)
    signals = ["lamp", "led_1", "led_2", "led_3", "led_4", "release", "home", "motor", "supply"]
    assert [row["signal"] for row in rows] == signals
    assert [row["on"] for row in rows] == [*(f"M64 P{i}" for i in range(5)), "M8", None, None, None]
    assert [row["off"] for row in rows] == [
        *(f"M65 P{i}" for i in range(5)),
        "M9",
        None,
        None,
        None,
    ]
    pins = " ".join(str(row["pins"]) for row in rows[1:5])
    assert pins == "1 2 3 4 5 6 7 8"


def test_without_outputs_lights_are_switched_by_hand(
    spec: PrototypeSpec, stage: StageLayout
) -> None:
    plain = spec.model_copy(
        update={"motion": spec.motion.model_copy(update={"controller": "grbl"})}
    )
    wiring = wiring_layout(plain, stage, PARTS)
    assert {row["output"] for row in wiring_rows(wiring, None, DRIVE)} == OUTPUTS
    assert "MOSFET" not in wiring.purchased(None)


def test_wires_reach_the_controller_and_are_bought(
    spec: PrototypeSpec, stage: StageLayout, wiring: Wiring
) -> None:
    way = np.hypot(*stage.leds[:, :2].T) + stage.leds[:, 2] - spec.frame.floor_mm
    assert np.all(np.array(wiring.lengths) > way + 1000)
    assert np.all(np.array(wiring.lengths) < way + 1150)
    assert wiring.wire
    assert wiring.purchased(None)[wiring.wire.name] >= 2 * sum(wiring.lengths) / 1000
    assert wiring.leds == 4  # which are fasteners of the stage
    assert "LED-3" not in wiring.purchased(None)
    assert wiring.purchased(None)["MOSFET"] == 5


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


def test_motor_and_supply_have_their_lines(wiring: Wiring) -> None:
    motor, supply = wiring_rows(wiring, None, DRIVE)[-2:]
    assert (motor["part"], motor["current_ma"]) == ("NEMA17-40", 2000)
    assert str(motor["pins"]).split() == ["A+", "A-", "B+", "B-"]
    assert supply["connector"] == "FUSE-2A"


@pytest.mark.parametrize("one", load_drives(PARTS), ids=str)
def test_the_supply_bears_motor_and_lights(wiring: Wiring, one: Drive) -> None:
    """Heat of two phases with rated current, as much work, lamps and LEDs: of 24 V and 2 A."""
    heat = 2 * one.rated_current**2 * one.resistance
    lights = 4 * 2 * 0.05 * PARTS["STRIP-COB-24V"]["watt_m"] + 24 * 0.02 * wiring.leds
    assert 2 * heat + lights < 24 * 2
