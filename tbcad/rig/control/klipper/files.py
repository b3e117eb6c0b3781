"""What a run reads of a build for Klipper: how it homes, and how the printer must be configured."""

import re
from collections.abc import Iterator
from configparser import Error, RawConfigParser
from dataclasses import dataclass
from math import isclose
from pathlib import Path
from typing import Any

from tbcad.cad.formats.checked_files import REBUILD
from tbcad.errors import InputError

PROGRAM, CONFIG = "rotation_plan_klipper.gcode", "klipper.cfg"
FILL_IN = "FILL_IN"
OTHER = "build for grblHAL, prototype.motion.controller, whose program Klipper's is written from"
STEPPER = "MANUAL_STEPPER STEPPER=base"
_NUMBER = r"-?\d+(?:\.\d+)?"
_SEARCH = re.compile(rf"{STEPPER} MOVE=(-{_NUMBER}) SPEED=({_NUMBER}) STOP_ON_ENDSTOP=(1|home)$")
_SWITCH = re.compile(rf"{STEPPER} SET_POSITION=({_NUMBER})$")
TRY = {"1": "2", "home": "try_home"}
"""Words of STOP_ON_ENDSTOP for which a switch that is not reached is no error."""
SAME = 1e-5
LETS_GO = re.compile(r"\b(?:M84|M18|SET_STEPPER_ENABLE|MANUAL_STEPPER)\b", re.IGNORECASE)
DEFAULT_IDLE_S = 600.0
LEAST_IDLE_S = 86_400.0  # a run pauses for as long as the operator likes


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
    """What a printer has otherwise than klipper.cfg, by its configfile as Klipper parsed it."""
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
