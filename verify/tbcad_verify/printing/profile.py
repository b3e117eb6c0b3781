"""Capabilities of a printer or a mill, read strictly from TOML; users can add their own."""

from __future__ import annotations

import os
import stat
import tomllib
from difflib import get_close_matches
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tbcad_verify.errors import BadExport
from tbcad_verify.record.validation import fault, shown

MAX_BYTES = 100_000  # a profile is one or two thousand
FOLDER = "profiles"
RENAMED = {"machined": "cnc"}  # as tbcad calls the process
_PATH = 200  # characters of a path that are shown, the last ones


class BadProfile(BadExport):
    """A profile that cannot be used; one line: where, what, what is allowed, what to do."""


_Side = Annotated[float, Field(gt=0, le=100_000)]
_Sides = Annotated[tuple[_Side, _Side, _Side], Field(strict=False)]  # a list in TOML


class Profile(BaseModel):
    """One machine with one material. Lengths in mm; a file that leaves a key out has its default.

    Every key that is given must be known, of its type and in its range.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,39}$")
    """In the names of checks."""
    process: Literal["FDM", "SLA", "SLS", "CNC"]
    """How parts are made."""
    bed_mm: _Sides
    """Width, depth and height of the build volume; for a mill its travel."""
    spot_mm: float = Field(gt=0, le=100)
    """Diameter of the nozzle, the light's or laser's spot, or the milling tool."""
    wall_mm: float = Field(ge=0, le=1000)
    """Minimum wall thickness."""
    hole_mm: float = Field(ge=0, le=1000)
    """Minimum diameter of a round hole."""
    clearance_mm: float = Field(ge=0, le=100)
    """Gap between parts that must not stick; also kept free at the rim of the bed."""
    tolerance_mm: float = Field(ge=0, le=100)
    """Maximum error of a dimension, plus or minus."""
    overhang_deg: float | None = Field(None, ge=0, le=90)
    """Lean from the vertical beyond which a face needs support; left out where none does."""
    cavities: bool = True
    """Whether a closed cavity may stay: powder or resin is trapped in it, no tool gets in."""
    material: str = Field(pattern=r"^[^\x00-\x1f\x7f]{1,60}$")
    """Its name."""
    density_g_cm3: float = Field(gt=0, le=30)
    """Of the made part, solid."""
    max_triangles: int | None = Field(None, ge=1, le=10**9)
    """That the machine's software reads; left out where it is not known."""


def built_in() -> tuple[str, ...]:
    """Names of the profiles that are installed with this package, sorted."""
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
    return parse(_shown_path(name_or_path), _read(name_or_path))


def parse(where: str, text: str) -> Profile:
    """A profile from TOML text; BadProfile as `load`."""
    try:
        profile = Profile.model_validate(tomllib.loads(text))
    except ValidationError as error:
        raise BadProfile(f"profile {where}: {fault(Profile, error)}: change it") from error
    except (ValueError, RecursionError) as error:
        reason = shown(" ".join(str(error).split()) or type(error).__name__)
        raise BadProfile(f"profile {where}: no TOML ({reason}); correct it") from error
    if 2 * profile.clearance_mm >= min(profile.bed_mm[:2]):
        raise BadProfile(
            f"profile {where}: clearance_mm is {profile.clearance_mm:g}, allowed is less than half "
            f"the bed's {min(profile.bed_mm[:2]):g}: change one of them"
        )
    return profile


def _read(path: str) -> str:
    where = _shown_path(path)
    try:
        info = os.stat(path)
        small = stat.S_ISREG(info.st_mode) and info.st_size <= MAX_BYTES
        data = Path(path).read_bytes() if small else b""
    except (OSError, ValueError) as error:
        raise BadProfile(_no_such(path)) from error
    if not stat.S_ISREG(info.st_mode):
        raise BadProfile(f"profile {where}: not a regular file; give a .toml file")
    if not small:
        raise BadProfile(f"profile {where}: larger than the {MAX_BYTES} bytes allowed")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadProfile(
            f"profile {where}: not UTF-8 text (byte {error.start}); save it as UTF-8"
        ) from error


def _no_such(path: str) -> str:
    if path in RENAMED:
        return f"profile {path}: it is called {RENAMED[path]} now: write {RENAMED[path]}"
    likely = get_close_matches(path, built_in(), 1)
    hint = f"did you mean {likely[0]}? " if likely else ""
    return (
        f"profile {_shown_path(path)}: neither built in nor a file that can be read; {hint}"
        f"built in are {', '.join(built_in())}; or give the path of a .toml file"
    )


def _shown_path(path: str) -> str:
    text = path if path.isprintable() and path else repr(path)
    return text if len(text) <= _PATH else "..." + text[3 - _PATH :]
