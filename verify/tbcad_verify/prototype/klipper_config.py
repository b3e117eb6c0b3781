"""klipper.cfg by a closed grammar, and what in it lets the motor, and so the base, go.

Klipper obeys all that it reads: an include, a macro with the name of a command, a section twice. So
a section, option or line that has no use here is refused, whatever it would do.
Sources: idle_timeout.py, stepper_enable.py and static_digital_output.py of Klipper: without
[idle_timeout], or without its gcode, M84 comes after 600 s at rest; a shutdown takes the enable_pin
of a stepper back, and leaves a static output as it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

Sections = dict[str, dict[str, str]]
NUMBER, PIN = r"\d+(?:\.\d+)?", r"[!^~]{0,2}[\w.:]+"
STEPPER, OUTPUT = "manual_stepper base", "output_pin "
IDLE, ENABLE = "idle_timeout", "static_digital_output base_enable"
FORMS: Mapping[str, Mapping[str, str]] = {
    "printer": {"kinematics": "none", "max_velocity": NUMBER, "max_accel": NUMBER},
    "pause_resume": {},
    "respond": {},
    IDLE: {"timeout": NUMBER, "gcode": ""},
    ENABLE: {"pins": PIN},
    STEPPER: {
        **dict.fromkeys(("step_pin", "dir_pin", "endstop_pin"), PIN),
        **dict.fromkeys(("rotation_distance", "full_steps_per_rotation", "microsteps"), NUMBER),
        **dict.fromkeys(("velocity", "accel"), NUMBER),
        "gear_ratio": rf"{NUMBER}:1",
    },
    OUTPUT: {"pin": PIN, "value": "0"},
}
COMMENT = re.compile(r"# .*|")  # "#*#" is a saved configuration, which counts
HEADER = re.compile(r"\[([^\]]+)\]")
OPTION = re.compile(r"(\w+):(?: (\S+))?")
CONTINUED = re.compile(r"[ \t]+(\S.*)")
HARMLESS = re.compile(r'RESPOND MSG="[\w ,.:-]{1,70}"|TURN_OFF_HEATERS')
"""Commands that the idle timeout may give: no others are known to keep the motor on."""


def parsed_config(text: str) -> tuple[Sections, list[str]]:
    """Options by section, the lines of a gcode with newlines between; what is wrong with lines."""
    sections: Sections = {}
    faults, name, option = [], "", ""
    for number, line in enumerate(text.splitlines(), 1):
        if COMMENT.fullmatch(line):
            continue
        if found := HEADER.fullmatch(line):
            name, option = found[1], ""
            if name in sections or _forms(name) is None:
                faults.append(f"line {number}: [{name}] is twice, or none that the base has")
            sections.setdefault(name, {})
        elif found := OPTION.fullmatch(line):
            option = found[1]
            faults += _misplaced(sections, name, option, found[2] or "", number)
        elif option == "gcode" and (found := CONTINUED.fullmatch(line)):
            sections[name][option] += f"{found[1]}\n"
        else:
            faults.append(f"line {number} is none that a configuration has")
    return sections, faults


def _forms(section: str) -> Mapping[str, str] | None:
    return FORMS.get(OUTPUT if re.fullmatch(rf"{OUTPUT}\w+", section) else section)


def _misplaced(
    sections: Sections, name: str, option: str, value: str, number: int
) -> Iterator[str]:
    """Keep an option; what is wrong with it, if anything."""
    form = (_forms(name) or {}).get(option)
    known = sections.setdefault(name, {})
    if form is None or option in known or not re.fullmatch(form, value):
        yield f"line {number}: {option} of [{name}] is twice, or none that the base has"
    known[option] = value


def lets_go(sections: Sections) -> Iterator[str]:
    """By what the holding torque goes away."""
    gcode = sections.get(IDLE, {}).get("gcode")
    if gcode is None:
        yield "no [idle_timeout] with a gcode: after 600 s at rest the motor lets go"
    for command in (gcode or "").splitlines():
        if not HARMLESS.fullmatch(command):
            yield f"the idle timeout does {command[:40]!r}, which may let the motor go"
    if "pins" not in sections.get(ENABLE, {}):
        yield f"no [{ENABLE}]: a shutdown lets the motor go"
