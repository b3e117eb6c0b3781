"""What GRBL's numbers mean.

Sources: doc/csv/error_codes_en_US.csv and alarm_codes_en_US.csv of GRBL 1.1h; errors.c and alarms.c
of grblHAL core, from 18 of the errors and 10 of the alarms on.
"""

ERRORS = {
    1: "a word without its letter",
    2: "a number is missing or badly written",
    3: "the $ command is not known",
    4: "a negative value where none is allowed",
    5: "homing is not enabled: set $22=1",
    6: "the step pulse is too short",
    7: "the settings in the memory were damaged: defaults are in use, send grbl_settings.txt",
    8: "$ commands are for an idle controller only",
    9: "G-code is locked: the controller is in alarm",
    10: "soft limits need homing: set $22=1",
    11: "the line is too long",
    12: "steps and speed are more than the controller can do",
    13: "the safety door is open",
    14: "the line is too long to be stored",
    15: "the jog is beyond the travel",
    16: "the jog is no jog",
    17: "laser mode needs PWM",
    18: "reset is asserted",
    19: "the value must be above zero",
    20: "the command is not supported: is this the controller that the export was built for?",
    21: "two commands of one group",
    22: "no feed is set",
    23: "a whole number is needed",
    24: "two commands want the axis words",
    25: "a word is there twice",
    26: "no axis word",
    27: "the line number is not allowed",
    28: "a value is missing",
    29: "G59.x is not supported",
    30: "G53 goes with G0 and G1 only",
    31: "axis words that nothing uses",
    33: "the target is not allowed",
    36: "words that nothing uses",
    39: "the value is out of range: has the board so many outputs?",
    45: "a limit switch is pressed: only homing is allowed",
    46: "the controller must be homed",
    49: "the self test failed: zero pin in, then switch the controller off and on",
    50: "the emergency stop is pressed: zero pin in before it is released",
    51: "the motor's driver reports a fault and may let go: zero pin in before you touch it",
    52: "the setting is out of range",
    53: "the setting is not available on this board",
    58: "the board has no such output",
    79: "not allowed before the alarm is cleared",
    85: "the output cannot be used",
}
ALARMS = {
    1: "a limit switch was pressed in mid-motion: the angle is lost",
    2: "the target is beyond the soft limits",
    3: "reset in mid-motion: the angle is lost",
    4: "the probe was pressed before",
    5: "the probe was not pressed",
    6: "homing was interrupted by a reset",
    7: "homing was interrupted by the safety door",
    8: "homing: the pull-off did not release the switch; look at its wiring, or enlarge $27",
    9: "homing: the switch was not found; look at its wiring, $5 and $23",
    10: "the emergency stop is pressed: zero pin in before it is released",
    11: "the controller must be homed",
    12: "a limit switch is pressed",
    16: "the self test failed: zero pin in, then switch the controller off and on",
    17: "the motor's driver reports a fault and may let go: zero pin in before you touch it",
    18: "homing is set wrongly",
    20: "an output expander does not answer",
    21: "the memory of the settings failed",
    22: "a buffer overflowed",
}
STATES = {
    "Idle": "look at its cable",
    "Alarm": "it is locked, and takes $X or $H only",
    "Check": "it moves nothing in check mode: reset it",
    "Sleep": "its motor is off, and the base may have fallen: zero pin in, then start again",
}
"""What a controller that rests, and answers a line by nothing, wants."""
UNKNOWN = "its meaning is in the manual of the controller's firmware"


def error_meaning(code: int) -> str:
    """What `error:code` means."""
    return ERRORS.get(code, UNKNOWN)


def alarm_meaning(code: int) -> str:
    """What `ALARM:code` means."""
    return ALARMS.get(code, UNKNOWN)
