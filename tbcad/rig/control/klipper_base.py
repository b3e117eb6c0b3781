"""The base and its lights, driven by Klipper as a build's files say.

Motions are sent in pieces and each is waited for, so that a run that is stopped is at rest after
the present one. SET_PIN is done in the order of motions, 0.3 s after it is sent: lights are waited
for once, before a photograph.
"""

import re
from collections.abc import Iterator
from configparser import Error, RawConfigParser
from dataclasses import dataclass
from math import ceil, isclose
from pathlib import Path
from typing import Any, TypeAlias

from tbcad.cad.formats.checked_files import REBUILD
from tbcad.errors import InputError
from tbcad.rig.control.base import Base, travel_s
from tbcad.rig.control.klipper import HOLD_FIRST, MOTOR, READY, Klipper
from tbcad.rig.control.plan import STEPPER, ControllerReset, ControlPlan, MachineFault, Move
from tbcad.types import Progress

PROGRAM, CONFIG = "rotation_plan_klipper.gcode", "klipper.cfg"
FILL_IN = "FILL_IN"
OTHER = "build again with --set prototype.motion.controller=klipper"
_NUMBER = r"-?\d+(?:\.\d+)?"
_SEARCH = re.compile(rf"{STEPPER} MOVE=(-{_NUMBER}) SPEED=({_NUMBER}) STOP_ON_ENDSTOP=(1|home)$")
_SWITCH = re.compile(rf"{STEPPER} SET_POSITION=({_NUMBER})$")
TRY = {"1": "2", "home": "try_home"}
"""Words of STOP_ON_ENDSTOP for which a switch that is not reached is no error."""
SAME = 1e-5
LETS_GO = re.compile(r"\b(?:M84|M18|SET_STEPPER_ENABLE|MANUAL_STEPPER)\b", re.IGNORECASE)
DEFAULT_IDLE_S = 600.0
LEAST_IDLE_S = 86_400.0  # a run pauses for as long as the operator likes
RELEASE = "SET_PIN PIN=release VALUE="
MILLISECONDS = 1000
PIECE_S = 1.5  # of a motion, which no stop ends sooner
SECURE_S = 20.0  # for the end of a piece, and for lights
DONE = "M400"
SHOWN = 4
BUSY = ("printing", "paused")
INCLUDE = f"include the build's {CONFIG} in printer.cfg, zero pin in first, and restart Klipper"


@dataclass(frozen=True)
class Homing:
    """Search for the home switch."""

    travel_deg: float  # of the search, negative
    speed_deg_s: float  # of the search
    word: str  # of STOP_ON_ENDSTOP, for a part of the search
    switch_deg: float  # base angle of the switch


@dataclass(frozen=True)
class KlipperFiles:
    """Files of a build for Klipper."""

    homing: Homing
    config: dict[str, dict[str, str]]  # values of klipper.cfg, by section and option


def read_klipper_files(folder: Path) -> KlipperFiles:
    """Read a build, or an InputError: it has not the files for Klipper that tbcad writes."""
    return KlipperFiles(_homing(folder / PROGRAM), _config(folder / CONFIG))


def _homing(path: Path) -> Homing:
    lines = _text(path).splitlines()
    searches = [match for line in lines if (match := _SEARCH.match(line))]
    switches = [match for line in lines if (match := _SWITCH.match(line))]
    if len(searches) != 1 or len(switches) != 1:
        raise InputError(f"{path} does not home once: {REBUILD}")
    travel, speed, word = searches[0].groups()
    return Homing(float(travel), float(speed), TRY[word], float(switches[0][1]))


def _config(path: Path) -> dict[str, dict[str, str]]:
    parser = RawConfigParser(strict=False, inline_comment_prefixes=(";", "#"))
    try:
        parser.read_string(_text(path))
    except Error:
        raise InputError(f"{path} is no configuration: {REBUILD}") from None
    return {name: dict(parser.items(name)) for name in parser.sections()}


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii")
    except FileNotFoundError:
        raise InputError(f"{path} is not there: {OTHER}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read: {error}: {REBUILD}") from None


def differences(wanted: dict[str, dict[str, str]], found: dict[str, Any]) -> Iterator[str]:
    """Differences of a printer from klipper.cfg, by its configfile as Klipper parsed it."""
    for section, options in wanted.items():
        if not isinstance(has := found.get(section), dict):
            yield f"[{section}] is missing"
            continue
        for option, value in options.items():
            if not _same(value, has.get(option)):
                shown = "missing" if option not in has else repr(has[option])[:40]
                yield f"{option} of [{section}] is {shown}, not {value:.40}"


def _same(wanted: str, found: Any) -> bool:
    if FILL_IN in wanted:
        return _same_pin(wanted, str(found))
    if isinstance(found, bool):
        return RawConfigParser.BOOLEAN_STATES.get(wanted.lower()) is found
    numbers = _numbers(re.split(r"[,:]", wanted))
    if numbers is not None and (has := _numbers(found)) is not None:
        return len(numbers) == len(has) and all(
            isclose(a, b, rel_tol=SAME) for a, b in zip(numbers, has, strict=True)
        )
    return wanted.split() == str(found).split()


def _same_pin(wanted: str, found: str) -> bool:
    """Whether a pin is filled in, with the signs of the build if that has some."""
    name = found.lstrip("!^~ ")
    signs = found.removesuffix(name).replace(" ", "")
    expected = wanted.removesuffix(FILL_IN).strip()
    return name not in ("", "None") and FILL_IN not in name and expected in ("", signs)


def _numbers(value: Any) -> list[float] | None:
    """Numbers of a value, or of a list of lists; None if it has others."""
    if isinstance(value, list):
        parts = [_numbers(one) for one in value]
        return None if None in parts else [number for part in parts for number in part or ()]
    try:
        return [float(value)]
    except (TypeError, ValueError):
        return None


def idle_that_lets_go(settings: dict[str, Any], status: dict[str, Any]) -> float | None:
    """Seconds after which an idle printer switches its motor off; None: not within a day.

    The status of its object idle_timeout, as far as this Klipper has one, counts before settings.
    """
    set_up = settings.get("idle_timeout", {})
    seconds = float(status.get("idle_timeout", set_up.get("timeout", DEFAULT_IDLE_S)))
    stays = LETS_GO.search(str(set_up.get("gcode", "M84"))) is None
    return None if stays or seconds >= LEAST_IDLE_S else seconds


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


DrivenMachine: TypeAlias = Base | KlipperBase
"""Motions and lights of one machine; all but `secure` raise MachineFault when it fails."""


def _pin(output: int, *, on: bool) -> str:
    return f"SET_PIN PIN={f'led_{output}' if output else 'lamp'} VALUE={int(on)}"


def _dwell(seconds: float) -> str:
    return f"G4 P{seconds * MILLISECONDS:.0f}"
