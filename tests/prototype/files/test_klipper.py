"""The program for Klipper is the same plan in Klipper's words."""

from tbcad.core.spec.prototype import MotionSpec
from tbcad.prototype.drive.drive import load_drives
from tbcad.prototype.drive.loads import BaseTorques, choose_drive
from tbcad.prototype.drive.travel import HomeAngles
from tbcad.prototype.electronics import lights
from tbcad.prototype.files.controllers import klipper_config, klipper_program
from tbcad.prototype.purchased.parts import load_parts

MOTION = MotionSpec(home_trim_deg=0.5)
ANGLES = HomeAngles(-98.5, -96.5, 191.0)


def test_every_command_has_its_translation() -> None:
    lines = [
        *("(a title)", "M0 (MSG, zero pin out, object straight? Then resume)", "$H"),
        *(
            "G21 G90 G94 G54 (modes)",
            "G92 X-96.0000",
            "G1 X-5.0000 F900",
            "(stop 1 of 2: 3 mirrors)",
        ),
        *("G4 P0.500", "M64 P0", "M64 P3", "M8", "M9", "M65 P3", "G92.1", "M2"),
    ]
    assert list(klipper_program(lines, MOTION, ANGLES)) == [
        'RESPOND MSG="zero pin out, object straight"',
        "PAUSE",
        "MANUAL_STEPPER STEPPER=base ENABLE=1 SET_POSITION=0",
        "MANUAL_STEPPER STEPPER=base MOVE=-286.5000 SPEED=6 STOP_ON_ENDSTOP=1",
        "MANUAL_STEPPER STEPPER=base SET_POSITION=-98.0000",
        "MANUAL_STEPPER STEPPER=base MOVE=-96.0000 SPEED=6",
        "MANUAL_STEPPER STEPPER=base MOVE=-5.0000 SPEED=15",
        "; stop 1 of 2: 3 mirrors",
        "G4 P500",
        "SET_PIN PIN=lamp VALUE=1",
        "SET_PIN PIN=led_3 VALUE=1",
        "SET_PIN PIN=release VALUE=1",
        "SET_PIN PIN=release VALUE=0",
        "SET_PIN PIN=led_3 VALUE=0",
    ]


def test_configuration() -> None:
    drive = choose_drive(
        "nema17-belt", BaseTorques(450.0, 500.0, 1000.0), load_drives(load_parts())
    )
    lines = list(klipper_config(drive, MOTION, lights(2, MOTION)))
    assert f"gear_ratio: {drive.ratio:g}:1" in lines
    idle = lines.index("[idle_timeout]")
    assert lines[idle + 2 : idle + 4] == ["gcode:", '    RESPOND MSG="idle, the motor stays on"']
    assert "[static_digital_output base_enable]" in lines
    assert not any(line.startswith("enable_pin") for line in lines)  # a shutdown takes it back
    pins = [line for line in lines if line.startswith("[output_pin")]
    assert pins == [f"[output_pin {name}]" for name in ("release", "lamp", "led_1", "led_2")]
