"""klipper.cfg as a user may have it, and as none may."""

import pytest
from tbcad_verify.prototype.klipper_config import lets_go, parsed_config

GOOD = """# a comment
[respond]

[idle_timeout]
timeout: 86400
gcode:
    RESPOND MSG="idle, the motor stays on"
[static_digital_output base_enable]
pins: !PA1
[manual_stepper base]
step_pin: mcu:gpio11
endstop_pin: ^!PB2
gear_ratio: 3.5:1
[output_pin led_1]
pin: FILL_IN
value: 0
"""


def faults(text: str) -> list[str]:
    sections, found = parsed_config(text)
    return [*found, *lets_go(sections)]


@pytest.mark.parametrize(
    "gcode", ["gcode:", "gcode:\n    TURN_OFF_HEATERS", 'gcode:\n\tRESPOND MSG="a"\n\n']
)
def test_pins_are_the_users_and_idle_may_do_nothing(gcode: str) -> None:
    own = 'gcode:\n    RESPOND MSG="idle, the motor stays on"'
    assert not faults(GOOD.replace(own, gcode))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("    RESPOND", "    M84\n    RESPOND", "does 'M84'"),
        ('stays on"', 'stays on {% M84 %}"', "may let the motor go"),
        ("gcode:\n", "gcode: M18\n", "gcode of [idle_timeout]"),
        ("[respond]", "[gcode_macro RESPOND]", "[gcode_macro RESPOND]"),
        ("[respond]", "[include other.cfg]", "[include other.cfg]"),
        ("[respond]", "[idle_timeout]", "[idle_timeout] is twice"),
        ("pins: !PA1", "", "a shutdown lets the motor go"),
        ("step_pin: ", "enable_pin: PA1\nstep_pin: ", "enable_pin of [manual_stepper base]"),
        ("value: 0", "value: 1", "value of [output_pin led_1]"),
        ("# a comment", "#*# [idle_timeout]", "line 1 is none"),
        ("timeout: 86400", "timeout=86400", "is none that a configuration has"),
    ],
)
def test_what_may_let_the_motor_go(old: str, new: str, says: str) -> None:
    assert GOOD.count(old) == 1
    assert any(says in one for one in faults(GOOD.replace(old, new)))
