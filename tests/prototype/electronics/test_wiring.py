"""The lines of the controller: each light its output, each wire its way through the bore."""

from dataclasses import replace

import numpy as np
import pytest

from tbcad.prototype.electronics.wiring import COLUMNS, Wiring, wiring_layout, wiring_rows
from tbcad.prototype.purchased.parts import load_parts
from tbcad.prototype.stage.layout import StageLayout
from tbcad.spec.errors import SpecError
from tbcad.spec.prototype import PrototypeSpec

PARTS = load_parts()


@pytest.fixture(scope="module")
def wiring(spec: PrototypeSpec, stage: StageLayout) -> Wiring:
    return wiring_layout(spec, stage, PARTS)


def test_a_line_for_each_light_and_the_release(wiring: Wiring) -> None:
    rows = wiring_rows(wiring)
    assert all(set(row) == set(COLUMNS) for row in rows)
    signals = ["lamp", "led_1", "led_2", "led_3", "led_4", "release", "home"]
    assert [row["signal"] for row in rows] == signals
    assert [row["on"] for row in rows] == [*(f"M64 P{i}" for i in range(5)), "M8", None]
    assert [row["off"] for row in rows] == [*(f"M65 P{i}" for i in range(5)), "M9", None]
    pins = " ".join(str(row["pins"]) for row in rows[1:-2])
    assert pins == "1 2 3 4 5 6 7 8"


def test_without_outputs_lights_are_switched_by_hand(
    spec: PrototypeSpec, stage: StageLayout
) -> None:
    plain = spec.model_copy(
        update={"motion": spec.motion.model_copy(update={"controller": "grbl"})}
    )
    wiring = wiring_layout(plain, stage, PARTS)
    assert {row["output"] for row in wiring_rows(wiring)} == {"by hand", "coolant", "limit X"}
    assert "MOSFET" not in wiring.purchased


def test_wires_reach_the_controller_and_are_bought(
    spec: PrototypeSpec, stage: StageLayout, wiring: Wiring
) -> None:
    way = np.hypot(*stage.leds[:, :2].T) + stage.leds[:, 2] - spec.frame.floor_mm
    assert np.all(np.array(wiring.lengths) > way + 1000)
    assert np.all(np.array(wiring.lengths) < way + 1150)
    assert wiring.wire
    assert wiring.purchased[wiring.wire.name] >= 2 * sum(wiring.lengths) / 1000
    assert wiring.purchased["LED-3"] == wiring.leds == 4
    assert wiring.purchased["MOSFET"] == 5


def test_a_stage_without_leds(spec: PrototypeSpec, stage: StageLayout) -> None:
    bare = replace(stage, leds=np.zeros((0, 3)))
    wiring = wiring_layout(spec, bare, PARTS)
    assert [row["signal"] for row in wiring_rows(wiring)] == ["lamp", "release", "home"]
    assert wiring.purchased == {"MOSFET": 1, "CABLE-2x0.25": 5}


def test_wires_that_do_not_fit(spec: PrototypeSpec, stage: StageLayout) -> None:
    narrow = replace(stage, sizes=replace(stage.sizes, wire=0.9))
    with pytest.raises(SpecError, match=r"8 wires of LEDs do not fit .* bore of 1\.8 mm"):
        wiring_layout(spec, narrow, PARTS)
