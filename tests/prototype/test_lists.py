"""Lists and wiring of random designs: what people read is right where it is made."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tbcad.core.spec.errors import SpecError
from tbcad.core.spec.prototype import PrototypeSpec
from tbcad.prototype.balls.layout import PrototypeLayout
from tbcad.prototype.drive.drive import Drive, load_drives
from tbcad.prototype.electronics import led_circuit, wiring_layout
from tbcad.prototype.files.bom import ALWAYS, PrintedItem, bom_rows, totals
from tbcad.prototype.part import FrameLayout, Site
from tbcad.prototype.purchased.parts import Prices, load_parts, load_prices, of_kind
from tbcad.prototype.resistors import e24_at_least, series_resistor
from tbcad.prototype.stage.layout import StageLayout

PARTS = load_parts()
DRIVES = load_drives(PARTS)
E24 = (10, 11, 12, 13, 15, 16, 18, 20, 22, 24, 27, 30, 33, 36, 39, 43, 47, 51, 56, 62, 68, 75, 82)
E24 += (91,)  # IEC 60063
STEP = 15 / 13 + 1e-9  # of two neighbours, at most
STANDARDS = {  # by the kind of part
    **{"M3x": "ISO 4762", "SET-": "ISO 4026", "WASHER-": "ISO 7089", "DOWEL-": "ISO 8734"},
    **{"COLLAR-": "DIN 705 A", "ROD-": "ISO 286-2", "SHAFT-": "ISO 286-2", "UNC": "ASME B18.3"},
    "608-2Z": "ISO 15",
}
SHARED = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


MOTION = st.fixed_dictionaries(
    {
        "controller": st.sampled_from(["grbl", "grblhal"]),
        "trigger": st.sampled_from(["coolant", "pause"]),
        "axis": st.sampled_from("XA"),
    }
)
LIGHT = st.fixed_dictionaries({"led_ma": st.floats(1, 20), "led_supply_v": st.floats(5, 30)})


@settings(SHARED, max_examples=30)
@given(leds=st.integers(0, 6), motion=MOTION, light=LIGHT, drive=st.sampled_from(DRIVES))
def test_every_line_of_the_wiring(
    site: Site, leds: int, motion: dict[str, str], light: dict[str, float], drive: Drive
) -> None:
    spec, stage = site.spec.prototype, site.stage
    changes = {
        "motion": spec.motion.model_copy(update=motion),
        "stage": spec.stage.model_copy(update=light),
    }
    chosen = site.spec.model_copy(update={"prototype": spec.model_copy(update=changes)})
    hand, axis = motion["controller"] == "grbl", motion["axis"]
    milliampere, volt = light["led_ma"], light["led_supply_v"]
    places = np.column_stack([np.linspace(3, 25, leds), np.zeros(leds), np.full(leds, -5.0)])
    try:
        lit = replace(site, spec=chosen, drive=drive, stage=replace(stage, leds=places))
        wiring = wiring_layout(lit, FrameLayout(()))
    except SpecError:  # no resistor is rated for it, or the wires have no room
        return
    rows = wiring.rows
    of = {row["signal"]: row for row in rows}
    switched = ["lamp", *(f"led_{k + 1}" for k in range(leds))]
    home = [] if hand else ["home"]
    released = ["release"] if motion["trigger"] == "coolant" else []
    assert [row["signal"] for row in rows] == [*switched, *released, *home, "motor", "supply"]
    assert [row["line"] for row in rows] == [*range(1, len(rows) + 1)]
    for output, name in enumerate(switched):
        module = float(of[name]["current_ma"] or math.inf) > wiring.board["output_ma"]
        by = " by a switch module" if module else ""
        commands = (f"digital {output}{by}", f"M64 P{output}", f"M65 P{output}")
        told = tuple(of[name][key] for key in ("output", "on", "off"))
        assert told == (("by hand", None, None) if hand else commands)
    for k, name in enumerate(switched[1:]):
        row = of[name]
        ohm, current = float(row["resistor_ohm"]), float(row["current_ma"])
        decade = 10 ** math.floor(math.log10(ohm) - 1 + 1e-9)
        assert min(abs(ohm / decade - one) for one in E24) < 1e-9
        assert current == pytest.approx(1e3 * (volt - PARTS["LED-3"]["forward_v"]) / ohm)
        assert milliampere / STEP <= current <= milliampere * (1 + 1e-9)
        rating = float(str(row["resistor"]).removeprefix("R-").partition("W-")[0])
        assert rating >= 2 * (current / 1e3) ** 2 * ohm == pytest.approx(2 * row["dissipation_w"])
        assert row["pins"] == f"{2 * k + 1} {2 * k + 2}"
        assert int(str(row["connector"]).removeprefix("PLUG-")) >= 2 * leds
        assert 2 * leds * PARTS[row["wire"]]["outer_mm"] ** 2 <= 0.5 * (2 * stage.sizes.wire) ** 2
        assert float(row["length_mm"]) >= places[k, 0] + places[k, 2] - spec.frame.floor_mm + 500
    assert hand or of["home"]["output"] == f"limit {axis}"
    assert (of["motor"]["output"], of["motor"]["part"]) == (f"driver {axis}", drive.motor.name)
    assert (of["supply"]["connector"], of["supply"]["supply_v"]) == ("FUSE-2A", 24.0)
    bought = wiring.listed
    by_module = ["module" in str(row["output"]) for row in rows]
    assert bought.get("MOSFET", 0) == (0 if hand else sum(by_module))
    assert bought.get("RELAY", 0) == len(released)
    needed = 1 if hand else leds + 2  # lamp, and coolant that releases the camera
    enough = [one for one in of_kind(PARTS, "boards") if one["outputs"] >= needed]
    assert wiring.board == min(enough, key=lambda one: one["outputs"])
    assert bought[wiring.board.name] == 1
    metres = Counter[str]()
    for row in rows:
        if row["wire"]:
            strands = 2 if str(row["signal"]).startswith("led_") else 1
            metres[str(row["wire"])] += strands * float(row["length_mm"]) / 1e3
    assert {name: math.ceil(one - 1e-9) for name, one in metres.items()} == {
        name: count for name, count in bought.items() if name in metres
    }


def test_circuits_that_there_are_not(spec: PrototypeSpec, stage: StageLayout) -> None:
    values = [(180, 180), (181, 200), (2080, 2200), (9.1, 9.1), (92, 100), (0.99, 1), (1e5, 1e5)]
    assert [e24_at_least(ohm) for ohm, _ in values] == pytest.approx([one for _, one in values])
    led = PARTS["LED-3"]
    with pytest.raises(SpecError, match="led_ma 25 is more than LED-3 bears: make it 20"):
        series_resistor(led, 25.0, 24.0, PARTS)
    with pytest.raises(SpecError, match="led_supply_v 3 does not light LED-3"):
        series_resistor(led, 10.0, 3.0, PARTS)
    none = {name: part for name, part in PARTS.items() if not name.startswith("R-")}
    with pytest.raises(SpecError, match=r"no resistor of 0\.4 W is in resistors\.csv"):
        series_resistor(led, 10.0, 24.0, none)
    narrow = replace(stage, sizes=replace(stage.sizes, wire=0.9))
    with pytest.raises(SpecError, match=r"8 wires of LEDs do not fit .* bore of 1\.8 mm"):
        led_circuit(spec, narrow, PARTS)


def test_the_supply_bears_motor_and_lights() -> None:
    """Heat of two phases with rated current, as much work, lamps and LEDs: of 24 V and 2 A."""
    lights = 4 * 2 * 0.05 * PARTS["STRIP-COB-24V"]["watt_m"] + 24 * 0.02 * 7
    for one in DRIVES:
        heat = 4 * one.of_motor("rated_a") ** 2 * one.of_motor("resistance_ohm")
        assert heat + lights < 24 * 2


@settings(SHARED, max_examples=30)
@given(
    counts=st.dictionaries(st.sampled_from(sorted(PARTS)), st.integers(0, 40), max_size=30),
    volumes=st.lists(st.floats(10, 1e6), max_size=5),
    density=st.floats(0.9, 3),
    priced=st.booleans(),
)
def test_every_row_of_the_list(
    layout: PrototypeLayout,
    counts: dict[str, int],
    volumes: list[float],
    density: float,
    priced: bool,
) -> None:
    drive, prices = DRIVES[0], load_prices(["estimates"]) if priced else Prices(())
    printed = [
        PrintedItem(f"part_{k}", "a part", volume, (volume / 2, volume / 1e4))
        for k, volume in enumerate(volumes)
    ]
    rows = bom_rows(layout, drive, counts, printed, density, PARTS, prices)
    assert [row["item"] for row in rows] == [*range(1, len(rows) + 1)]
    quantity = Counter[str]()
    for row in rows:
        quantity[str(row["part"])] += int(row["quantity"])
    asked = Counter(counts) + Counter(ALWAYS) + Counter(part.name for part in drive.parts)
    asked += Counter(f"ball {layout.balls.size[k]}" for k in np.flatnonzero(~layout.balls.cap))
    assert quantity == asked + Counter(item.name for item in printed)
    for row in rows:
        assert row["total_mass_g"] == pytest.approx(row["quantity"] * row["mass_g"], abs=1e-4)
        assert str(row["standard"]) in str(row["what"])
        for beginning, standard in STANDARDS.items():
            if str(row["part"]).startswith(beginning):
                assert row["standard"] == standard
        if row["unit_price"] is None:
            assert row["currency"] is row["price_date"] is row["total_price"] is None
        else:
            whole = row["quantity"] * row["unit_price"]
            assert row["total_price"] == pytest.approx(whole, abs=0.005 + 1e-9)
            assert row["price_date"]
            assert row["price_source"]
    for row, item in zip(rows[len(rows) - len(printed) :], printed, strict=True):
        assert row["mass_g"] == pytest.approx(item.volume * density / 1e3, rel=0.06, abs=0.005)
        assert row["filament_g"] == pytest.approx(row["mass_g"] / 2, rel=0.12)
    summed = totals(rows)
    bought = [row for row in rows if row["from"] == "bought"]
    assert summed["without_price"] == (0 if priced else len(bought))
    assert summed["mass_g"] == pytest.approx(sum(row["total_mass_g"] for row in rows), abs=0.006)
    euro = sum(row["total_price"] or 0 for row in bought)
    assert summed["bought_price"].get("EUR", 0) == pytest.approx(euro, abs=0.006)
