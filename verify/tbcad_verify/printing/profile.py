"""What a printer or a mill can make, read strictly from TOML; users can add theirs."""

from __future__ import annotations

import os
import stat
import tomllib
from difflib import get_close_matches
from importlib import resources
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from tbcad_verify.errors import BadExport

MAX_BYTES = 100_000  # a profile is one or two thousand
FOLDER = "profiles"
_ORDER = {Gt: "above", Ge: "from", Le: "to"}
_SHORT = 60  # characters of a refused value that are shown
_PATH = 200  # and of a path, the last ones


class BadProfile(BadExport):
    """A profile that cannot be used; one line: where, what, what is allowed, what to do."""


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


_Side = Annotated[float, Field(gt=0, le=100_000)]


class Profile(BaseModel):
    """One machine with one material. Lengths in mm; a file that leaves a key out has its default.

    Every key that is given must be known, of its type and in its range.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,39}$")
    """In the names of checks."""
    process: Literal["FDM", "SLA", "SLS", "machined"]
    """How parts come about."""
    bed_mm: Annotated[tuple[_Side, _Side, _Side], BeforeValidator(_as_tuple)]
    """Width, depth and height of what can be made; for a mill its travel."""
    spot_mm: float = Field(gt=0, le=100)
    """Diameter of the nozzle, the light's or laser's spot, or the milling tool."""
    wall_mm: float = Field(ge=0, le=1000)
    """Least wall thickness."""
    hole_mm: float = Field(ge=0, le=1000)
    """Least diameter of a round hole."""
    clearance_mm: float = Field(ge=0, le=100)
    """Gap between parts that must not stick; also kept free at the rim of the bed."""
    tolerance_mm: float = Field(ge=0, le=100)
    """How far a measure may be off, plus or minus."""
    overhang_deg: float | None = Field(None, ge=0, le=90)
    """Lean from the vertical beyond which a face needs support; left out where none does."""
    cavities: bool = True
    """Whether a closed cavity may stay: powder or resin is trapped in it, no tool gets in."""
    material: str = Field(pattern=r"^[^\x00-\x1f\x7f]{1,60}$")
    """In words."""
    density_g_cm3: float = Field(gt=0, le=30)
    """Of the made part, solid."""
    max_triangles: int | None = Field(None, ge=1, le=10**9)
    """What the machine's software takes; left out where nothing is known."""


def built_in() -> tuple[str, ...]:
    """Names of the profiles that come along, sorted."""
    files = resources.files(__package__).joinpath(FOLDER).iterdir()
    return tuple(sorted(f.name[:-5] for f in files if f.name.endswith(".toml")))


def load(name_or_path: str) -> Profile:
    """A built-in profile by name, else the one in a TOML file.

    Args:
        name_or_path: one of `built_in()`, or the path of a .toml file.

    Raises:
        BadProfile: neither; or the file is no regular UTF-8 text, too large, no TOML, or has a
            key that is unknown, missing, of the wrong type or out of range.
    """
    if name_or_path in built_in():
        text = resources.files(__package__).joinpath(FOLDER, f"{name_or_path}.toml").read_text()
        return parse(name_or_path, text)
    return parse(_path(name_or_path), _read(name_or_path))


def parse(where: str, text: str) -> Profile:
    """A profile from TOML text.

    Args:
        where: named in errors.
        text: the TOML.

    Raises:
        BadProfile: as `load`.
    """
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadProfile(f"profile {where}: no TOML ({_line(error)}); correct it") from error
    try:
        return _fitting(where, Profile.model_validate(table))
    except ValidationError as error:
        # An unknown key first: it is often why another is missing.
        faults = error.errors(include_url=False)
        first, *others = sorted(faults, key=lambda fault: fault["type"] != "extra_forbidden")
        more = f" (and {len(others)} more)" if others else ""
        raise BadProfile(f"profile {where}: {_fault(first)}{more}") from error


def _fitting(where: str, profile: Profile) -> Profile:
    if 2 * profile.clearance_mm >= min(profile.bed_mm[:2]):
        raise BadProfile(
            f"profile {where}: clearance_mm is {profile.clearance_mm:g}, allowed is less than half "
            f"the bed's {min(profile.bed_mm[:2]):g}: change one of them"
        )
    return profile


def _read(path: str) -> str:
    where = _path(path)
    try:
        # Not blocking: a pipe that nobody writes to is refused, not waited for.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    except (OSError, ValueError) as error:
        raise BadProfile(_no_such(path)) from error
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise BadProfile(f"profile {where}: not a regular file; give a .toml file")
        data = os.read(handle, MAX_BYTES + 1)
    finally:
        os.close(handle)
    return _text(where, data)


def _text(where: str, data: bytes) -> str:
    if len(data) > MAX_BYTES:
        raise BadProfile(
            f"profile {where}: larger than the {MAX_BYTES} bytes allowed; give a profile"
        )
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise BadProfile(
            f"profile {where}: not UTF-8 text (byte {error.start}); save it as UTF-8"
        ) from error


def _no_such(path: str) -> str:
    likely = get_close_matches(path, built_in(), 1)
    hint = f"did you mean {likely[0]}? " if likely else ""
    return (
        f"profile {_path(path)}: neither built in nor a file that can be read; {hint}"
        f"built in are {', '.join(built_in())}; or give the path of a .toml file"
    )


def _fault(fault: ErrorDetails) -> str:
    key = str(fault["loc"][0])
    if key not in Profile.model_fields:
        return _unknown(key)
    entry = "".join(f"[{part}]" for part in fault["loc"] if isinstance(part, int))
    what = "missing" if fault["type"] == "missing" else _shown(fault["input"])
    return f"{key}{entry} is {what}, allowed is {_allowed(key)}: change it"


def _unknown(key: str) -> str:
    likely = get_close_matches(key, Profile.model_fields, 1)
    hint = f"did you mean {likely[0]}? " if likely else ""
    return f"unknown key {_shown(key)}: {hint}allowed are {', '.join(Profile.model_fields)}"


def _allowed(key: str) -> str:
    if key == "bed_mm":
        return "three numbers above 0 to 100000"
    field = Profile.model_fields[key]
    words = {"process": "FDM, SLA, SLS or machined", "cavities": "true or false"}
    kinds = {str: "text", float: "a number", int: "a whole number"}
    kind = next((word for k, word in kinds.items() if k.__name__ in str(field.annotation)), "")
    return " ".join([words.get(key, kind), *_limits(field.metadata)])


def _limits(metadata: list[Any]) -> list[str]:
    ranges = [
        f"{word} {getattr(limit, kind.__name__.lower()):g}"
        for kind, word in _ORDER.items()
        for limit in metadata
        if isinstance(limit, kind)
    ]
    patterns = [limit.pattern for limit in metadata if getattr(limit, "pattern", None)]
    return ranges + [f"that matches {pattern}" for pattern in patterns]


def _shown(value: object) -> str:
    try:
        text = value if isinstance(value, str) and value.isprintable() else repr(value)
    except ValueError:  # Python refuses to write integers of more than 4300 digits
        text = "a number of thousands of digits"
    text = text or "''"
    return text if len(text) <= _SHORT else text[: _SHORT - 3] + "..."


def _path(path: str) -> str:
    text = path if path.isprintable() and path else repr(path)
    return text if len(text) <= _PATH else "..." + text[3 - _PATH :]


def _line(error: Exception) -> str:
    return _shown(" ".join(str(error).split()) or type(error).__name__)
