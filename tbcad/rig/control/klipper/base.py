"""The base and its lights, driven by Klipper.

Motions are sent in pieces and each is waited for, so that a run that is stopped is at rest after
the present one. SET_PIN is done in the order of motions, 0.3 s after it is sent: lights are waited
for once, before a photograph.
"""

from collections.abc import Iterator
from math import ceil

from tbcad.errors import InputError
from tbcad.rig.control.base import travel_s
from tbcad.rig.control.klipper.files import (
    CONFIG,
    STEPPER,
    KlipperFiles,
    differences,
    idle_that_lets_go,
)
from tbcad.rig.control.klipper.host import HOLD_FIRST, MOTOR, READY, Klipper
from tbcad.rig.control.machine import ControllerReset, MachineFault
from tbcad.rig.control.plan import ControlPlan
from tbcad.rig.control.program import Move
from tbcad.types import Progress

RELEASE = "SET_PIN PIN=release VALUE="
MILLISECONDS = 1000
PIECE_S = 1.5  # of a motion, which no stop ends sooner
SECURE_S = 20.0  # for the end of a piece, and for lights
DONE = "M400"
SHOWN = 4
BUSY = ("printing", "paused")
INCLUDE = f"include the build's {CONFIG} in printer.cfg, zero pin in first, and restart Klipper"


class KlipperBase:
    """Motions and lights of one machine."""

    switch_s = 0.5  # as measured, with Klipper on the same computer

    def __init__(self, klipper: Klipper, plan: ControlPlan, files: KlipperFiles) -> None:
        """Drive a machine as its build says."""
        self._klipper, self._plan, self._files = klipper, plan, files
        self._at = plan.program.start.angle_deg

    def connect(self) -> None:
        """Wait until Klipper is ready, and refuse a printer that is printing."""
        self._klipper.connect()
        if self._klipper.objects("print_stats")["print_stats"].get("state") in BUSY:
            raise MachineFault("the printer prints a file: wait for its end, or cancel it")

    def check_settings(self, note: Progress, *, send: bool) -> None:
        """Compare the printer's configuration with the build's; none can be sent."""
        if send:
            raise InputError(f"Klipper takes no settings: {INCLUDE}; leave --send-settings out")
        objects = self._klipper.objects("configfile", "idle_timeout", "stepper_enable")
        settings = objects["configfile"].get("settings", {})
        if found := [*differences(self._files.config, settings)]:
            more = " ..." if len(found) > SHOWN else ""
            raise InputError(
                f"the printer is not configured as {CONFIG} says: "
                f"{', '.join(found[:SHOWN])}{more}: {INCLUDE}"
            )
        if (idle_s := idle_that_lets_go(settings, objects["idle_timeout"])) is not None:
            raise InputError(
                f"timeout of [idle_timeout] lets the motor go after {idle_s:g} s, and the base "
                f"would fall: {INCLUDE}"
            )
        if MOTOR not in objects["stepper_enable"].get("steppers", {}):
            raise InputError("Klipper does not tell whether its motor is on: update Klipper")

    def home(self) -> None:
        """Bring the base to a known angle, all lights off."""
        homing, known = self._files.homing, self._plan.program.known_deg
        self._klipper.script(f"{STEPPER} ENABLE=1 SET_POSITION=0", DONE, held=False)
        self._search()
        self._klipper.script(f"{STEPPER} SET_POSITION={homing.switch_deg:.4f}")
        self._klipper.script(f"{STEPPER} MOVE={known:.4f} SPEED={homing.speed_deg_s:g}", DONE)
        self._at = known
        if self._klipper.switch_pressed():
            raise MachineFault(
                "homing: the pull-off did not release the switch: look at its wiring, and at "
                "endstop_pin"
            )
        self.lights_off()
        self._klipper.script(DONE)

    def _search(self) -> None:
        """Turn down until the switch is pressed."""
        homing = self._files.homing
        for angle in self._pieces(0.0, homing.travel_deg, homing.speed_deg_s):
            if self._klipper.switch_pressed():
                return
            move = f"{STEPPER} MOVE={angle:.4f} SPEED={homing.speed_deg_s:g}"
            self._klipper.script(f"{move} STOP_ON_ENDSTOP={homing.word}", DONE, expected_s=PIECE_S)
        if not self._klipper.switch_pressed():
            raise MachineFault(
                f"homing: the switch was not found within {-homing.travel_deg:.0f} degrees: look "
                "at its wiring, and at dir_pin"
            )

    def _pieces(self, begin: float, end: float, speed: float) -> Iterator[float]:
        """Where the pieces of a motion in degrees end; each takes PIECE_S at most."""
        rise = self._plan.motion.acceleration_deg_s2
        top = min(speed, rise * PIECE_S / 2)
        count = max(1, ceil(abs(end - begin) / (top * (PIECE_S - top / rise))))
        return (begin + (end - begin) * k / count for k in range(1, count + 1))

    def drive(self, move: Move, settle_s: float = 0.0) -> None:
        """Drive to a place and rest there; MachineFault: the motor was let go before."""
        self._klipper.check_held()
        speed = self._plan.motion.feed_deg_min / 60
        for angle in self._pieces(self._at, move.angle_deg, speed):
            expected = travel_s(abs(angle - self._at), self._plan)
            line = f"{STEPPER} MOVE={angle:.4f} SPEED={speed:g}"
            self._klipper.script(line, DONE, expected_s=expected)
            self._at = angle
        if settle_s:
            self.wait(settle_s)

    def light(self, output: int, *, on: bool) -> None:
        """Switch a light, soon: `wait` comes before a photograph."""
        self._klipper.script(_pin(output, on=on), held=False)

    def lights_off(self) -> None:
        """Switch all lights off, soon."""
        for output in self._plan.outputs:
            self.light(output, on=False)

    def wait(self, seconds: float) -> None:
        """Wait until all was done that was sent, and then for lights or base to settle."""
        self._klipper.script(_dwell(seconds), DONE, expected_s=seconds)

    def release(self) -> None:
        """Close the camera's relay for as long as it needs."""
        seconds = self._plan.motion.trigger_s
        lines = (f"{RELEASE}1", _dwell(seconds), f"{RELEASE}0", DONE)
        self._klipper.script(*lines, expected_s=seconds)

    def secure(self) -> str:
        """Let the present piece end and switch all lights off; return what could not be done."""
        off = (_pin(output, on=False) for output in self._plan.outputs)
        try:
            if (state := self._klipper.state()).name != READY:
                return f"{state.what}: {state.safe}"
            self._klipper.script(*off, f"{RELEASE}0", DONE, held=False, limit_s=SECURE_S)
            self._klipper.check_held()
        except ControllerReset as fault:
            return f"{fault}: {HOLD_FIRST}"
        except MachineFault as fault:
            return f"lights may be on: {fault}: before any supply is cut, {HOLD_FIRST}"
        return ""


def _pin(output: int, *, on: bool) -> str:
    return f"SET_PIN PIN={f'led_{output}' if output else 'lamp'} VALUE={int(on)}"


def _dwell(seconds: float) -> str:
    return f"G4 P{seconds * MILLISECONDS:.0f}"
