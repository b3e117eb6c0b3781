"""Settings against the drive and GRBL's own rules; the same plan in Klipper's words."""

import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as tries
from hypothesis import strategies as st

from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.balance import HomeAngles
from tbcad.prototype.drive.drive import BaseTorques, choose_drive, load_drives
from tbcad.prototype.electronics import lights
from tbcad.prototype.files.controllers import klipper_config, klipper_program, settings, wired
from tbcad.prototype.purchased.parts import load_parts

MOTION = MotionSpec(home_trim_deg=0.5)
ANGLES = HomeAngles(-98.5, -96.5, 191.0)
DRIVE = choose_drive("nema17-belt", BaseTorques(450.0, 500.0, 1000.0), load_drives(load_parts()))


@tries(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    axis=st.sampled_from("XA"),
    controller=st.sampled_from(["grblhal", "grbl"]),
    feed=st.sampled_from([40.0, 900.0]),
)
def test_settings(axis: str, controller: str, feed: float) -> None:
    motion = MotionSpec(axis=axis, controller=controller, feed_deg_min=feed)
    values = settings(DRIVE, motion, ANGLES)
    found = {number: value for number, value, _ in values}
    index, bit = (0, 1) if axis == "X" else (3, 8)
    assert found[100 + index] == pytest.approx(200 * 16 * DRIVE.ratio / 360)
    assert [found[number + index] for number in (110, 120, 130)] == [feed, 50, 191]
    assert (found[1], found[13], found[32]) == (255, 0, 0)  # motor on; inches; laser or lathe
    assert int(found[10]) & 1
    if controller == "grbl":  # it has $0 to $32 and those of X, Y and Z; it does not home
        assert {found[number] for number in (20, 21, 22)} == {0}
        assert all(number <= 32 or number >= 100 for number in found)
        assert found[10] == 1
        return
    order = list(found)
    assert order.index(22) < order.index(20)  # GRBL refuses soft limits before homing
    assert (found[23], found[44]) == (bit, bit)
    # A high input is a pressed switch unless its bit of $5 is set (grblHAL core, config.h). All are
    # high: this switch is open, the others are empty.
    assert {1, 2, 4, bit} - {one for one in (1, 2, 4, 8) if int(found[5]) & one} == {bit}
    # $37 keeps motors on in alarms, bit 12 of $10 reports while it homes.
    assert (found[37], found[62], int(found[10]) & 1 << 12) == (bit, 0, 1 << 12)
    assert found[24] <= found[25] <= feed


def test_every_command_has_its_translation() -> None:
    lines = [
        *("(a title)", "M0 (MSG, zero pin out, object straight? Then resume)", "$H"),
        *("G21 G90 G94 G54 (modes)", "G92 X-96.0000", "G1 X-5.0000 F900"),
        *("(stop 1 of 2: 3 mirrors)", "G4 P0.500", "M64 P0", "M64 P3", "M8", "M9", "M65 P3"),
        *("G92.1", "M2"),
    ]
    base, pin = "MANUAL_STEPPER STEPPER=base", "SET_PIN PIN="
    assert list(klipper_program(lines, MOTION, ANGLES)) == [
        *('RESPOND MSG="zero pin out, object straight"', "PAUSE"),
        f"{base} ENABLE=1 SET_POSITION=0",
        f"{base} MOVE=-286.5000 SPEED=6 STOP_ON_ENDSTOP=1",
        *(f"{base} SET_POSITION=-98.0000", f"{base} MOVE=-96.0000 SPEED=6"),
        *(f"{base} MOVE=-5.0000 SPEED=15", "; stop 1 of 2: 3 mirrors", "G4 P500"),
        *(f"{pin}lamp VALUE=1", f"{pin}led_3 VALUE=1"),
        *(f"{pin}release VALUE=1", f"{pin}release VALUE=0", f"{pin}led_3 VALUE=0"),
    ]


def test_wiring_has_the_names_of_the_configuration() -> None:
    light = {"signal": "led_2", "output": "digital 2", "on": "M64 P2", "off": "M65 P2"}
    klipper = MOTION.model_copy(update={"controller": "klipper"})
    assert wired(light, MOTION) == light
    found = wired(light, klipper)
    assert found["output"] == "digital [output_pin led_2]"
    assert (found["on"], found["off"]) == tuple(f"SET_PIN PIN=led_2 VALUE={on}" for on in "10")
    release = {"signal": "release", "output": "coolant", "on": "M8", "off": "M9"}
    assert wired(release, klipper)["output"] == "[output_pin release]"
    assert wired({"signal": "home", "output": "limit X", "on": None}, klipper)["output"] == (
        "endstop_pin"
    )


def test_configuration() -> None:
    lines = list(klipper_config(DRIVE, MOTION, lights(2, MOTION)))
    assert f"gear_ratio: {DRIVE.ratio:g}:1" in lines
    idle = lines.index("[idle_timeout]")
    assert lines[idle + 2 : idle + 4] == ["gcode:", '    RESPOND MSG="idle, the motor stays on"']
    assert "[static_digital_output base_enable]" in lines
    assert not any(line.startswith("enable_pin") for line in lines)  # a shutdown takes it back
    pins = [line for line in lines if line.startswith("[output_pin")]
    assert pins == [f"[output_pin {name}]" for name in ("release", "lamp", "led_1", "led_2")]
