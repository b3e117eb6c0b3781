"""Processes: how exactly a way of making makes things, from TOML, with a source for every figure.

What a figure means, and how it follows from a maker's tolerance, stands in
docs/decisions/0007-how-tolerances-are-computed.md.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import BeforeValidator, Field, ValidationError

from tbcad.prototype.balls.catalogue import load_grades
from tbcad.spec.errors import SpecError, fields, refused, section_of, shown, unknown_key
from tbcad.spec.prototype import GradeName
from tbcad.spec.section import Section
from tbcad.tolerance.montecarlo.draws import Distribution, Error, Errors

BUILT_IN = ("fdm", "sls", "sla", "cnc", "diamond")
MICROMETRE = 1e-3  # mm
BY_USER = "set by an option"
_LARGEST_FILE = 1_000_000  # bytes; a process is a few thousand

Table: TypeAlias = dict[str, Any]
Source: TypeAlias = Annotated[str, Field(pattern=r"\S", max_length=600)]


def _whole(value: object) -> object:
    if type(value) is not int:  # true and 1.0 equal 1, so Literal[1] would take them
        raise ValueError("allowed is the whole number 1: change it")
    return value


class ErrorSpec(Section):
    """One kind of error: the same in every machine (mean), and different in each (magnitude)."""

    unit: ClassVar[float] = 1.0

    magnitude: float = Field(ge=0)
    """Standard deviation if normal, half width if uniform."""
    mean: float = 0.0
    """What is off in every machine."""
    distribution: Distribution = "normal"
    """Of what is off beside the mean."""
    source: Source
    """Where the figures come from; says so where they are a judgement."""

    @property
    def error(self) -> Error:
        """The same in mm, radians or as a share."""
        return Error(self.unit * self.magnitude, self.unit * self.mean, self.distribution)


class Micrometres(ErrorSpec):
    """A kind of error in micrometres."""

    unit: ClassVar[float] = MICROMETRE

    magnitude: float = Field(ge=0, le=10_000)
    """Standard deviation if normal, half width if uniform."""
    mean: float = Field(0.0, ge=-10_000, le=10_000)
    """What is off in every machine."""


class Millimetres(ErrorSpec):
    """A kind of error in millimetres."""

    magnitude: float = Field(ge=0, le=100)
    """Standard deviation if normal, half width if uniform."""
    mean: float = Field(0.0, ge=-100, le=100)
    """What is off in every machine."""


class Permille(ErrorSpec):
    """A kind of error as a share, in thousandths."""

    unit: ClassVar[float] = 1e-3

    magnitude: float = Field(ge=0, le=200)
    """Standard deviation if normal, half width if uniform."""
    mean: float = Field(0.0, ge=-200, le=200)
    """What is off in every machine."""


class Milliradians(ErrorSpec):
    """A kind of error in milliradians."""

    unit: ClassVar[float] = 1e-3

    magnitude: float = Field(ge=0, le=500)
    """Standard deviation if normal, half width if uniform."""
    mean: float = Field(0.0, ge=-500, le=500)
    """What is off in every machine."""


class Degrees(ErrorSpec):
    """A kind of error in degrees."""

    unit: ClassVar[float] = math.radians(1)

    magnitude: float = Field(ge=0, le=45)
    """Standard deviation if normal, half width if uniform."""
    mean: float = Field(0.0, ge=-45, le=45)
    """What is off in every machine."""


class Process(Section):
    """A way of making a shell or a prototype, and how exactly it does."""

    name: str = Field(pattern="^[A-Za-z0-9][A-Za-z0-9 ._-]{0,79}$")
    """Name of the process, for reports."""
    title: str = Field(pattern=r"\S", max_length=200)
    """The process in words."""
    schema_version: Annotated[Literal[1], BeforeValidator(_whole)] = Field(1, alias="schema")
    """Version of this table's keys."""
    sphere_centre_um: Micrometres
    """Each mirror's centre along each axis, against its neighbours', once scale is taken out."""
    sphere_radius_um: Micrometres
    """Each mirror's radius, its centre held."""
    scale_isotropic_permille: Permille
    """Growth of each shell."""
    scale_axis_permille: Permille
    """Growth of the machine along each axis of the frame, beside the former."""
    shell_shift_um: Micrometres
    """Each whole shell along each axis."""
    shell_tilt_mrad: Milliradians
    """Each whole shell about each axis."""
    camera_shift_um: Micrometres
    """Each camera's pinhole along each axis."""
    camera_tilt_mrad: Milliradians
    """Each camera about each axis through its pinhole."""
    camera_focal_permille: Permille
    """Each camera's focal length."""
    coating_um: Micrometres
    """Thickness of each shell's coat: its mean is all of it, of which a design may know a part."""
    facets_mm: Millimetres
    """Coverage lost because mirrors are made from the flat facets of an STL."""
    rotation_angle_deg: Degrees
    """Prototype: the base's angle at each stop."""
    axis_runout_um: Micrometres
    """Prototype: the base's axis, sideways, at each stop."""
    axis_tilt_mrad: Milliradians
    """Prototype: direction of the base's axis."""
    seat_um: Micrometres
    """Prototype: each ball's centre along each axis."""
    ball_grade: GradeName
    """Prototype: grade of the balls by ISO 3290-1."""


def load_process(which: str, overrides: Sequence[str] = ()) -> Process:
    """Return a built-in process, or one of a TOML file, with options on top.

    A file may name a built-in process as `based_on`; each kind that it has replaces the whole
    kind there, so that no figure keeps the source of another.

    Args:
        which: one of BUILT_IN, or the path of a TOML file.
        overrides: "kind=magnitude" or "kind.key=value" texts, the later over the earlier.

    Raises:
        SpecError: anything that cannot be read, is unknown, or is not allowed.
    """
    table, where = _built_in(which) if which in BUILT_IN else _own(Path(which), which)
    options = [_option(text) for text in overrides]
    for key, value in options:
        _put(table, key, value)
    try:
        return Process.model_validate(table)
    except ValidationError as error:
        raise refused(error, Process, where, {key for key, _ in options}) from None


def process_dict(process: Process) -> Table:
    """Return the process as plain JSON values, keys in the order of the model."""
    return process.model_dump(mode="json", by_alias=True)


def process_errors(process: Process, known_coating_um: float = 0.0) -> Errors:
    """Return what the process does to a machine, in mm, radians and shares.

    Args:
        process: the process.
        known_coating_um: thickness of the coat that the design allows for
            (`mirrors.coating_um`); only what is beyond it is an error.
    """
    kinds = {key: value for key, value in process if isinstance(value, ErrorSpec)}
    coat = kinds["coating_um"]
    kinds["coating_um"] = coat.model_copy(update={"mean": coat.mean - known_coating_um})
    made = {key.rpartition("_")[0]: kind.error for key, kind in kinds.items()}
    return Errors(**made, ball_radius=ball_radius_error(process.ball_grade))


def ball_radius_error(grade: str) -> Error:
    """Return how far radii of bought balls are off, mm.

    A lot's diameters differ by at most its variation (ISO 3290-1: V_DwL), and one ball's radius
    by its deviation from spherical form; the sum of both half widths is taken.
    """
    promised = load_grades()[grade]
    half_width = promised.lot_variation_um / 4 + promised.sphericity_um / 2
    return Error(MICROMETRE * half_width, 0.0, "uniform")


def _built_in(name: str) -> tuple[Table, str]:
    text = files("tbcad.tolerance").joinpath("process", f"{name}.toml").read_text("utf-8")
    return tomllib.loads(text), f"built-in process {name}"


def _own(path: Path, which: str) -> tuple[Table, str]:
    table = _parsed(path, which)
    base = table.pop("based_on", None)
    if base is None:
        return table, str(path)
    if base not in BUILT_IN:
        raise SpecError(
            f"{path}: based_on is {shown(base)}, allowed is {' or '.join(BUILT_IN)}: change it"
        )
    return {**_built_in(base)[0], "name": path.stem, **table}, str(path)


def _parsed(path: Path, which: str) -> Table:
    try:
        return tomllib.loads(_text(path, which))
    except RecursionError:
        raise SpecError(f"{path}: tables nested too deeply: flatten them") from None
    except ValueError as error:
        if isinstance(error, SpecError):
            raise
        raise SpecError(f"{path}: not valid TOML: {error}: correct that line") from None


def _text(path: Path, which: str) -> str:
    try:
        if not path.is_file():
            raise _no_process(which)
        with path.open("rb") as file:
            data = file.read(_LARGEST_FILE + 1)
        if len(data) > _LARGEST_FILE:
            raise SpecError(f"{path}: over 1 MB, no process: name a process file (.toml)")
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise SpecError(f"{path}: not UTF-8 text: save it as UTF-8") from None
    except OSError as error:
        raise SpecError(f"{path}: cannot be read: {error.strerror}: check the path") from None


def _no_process(which: str) -> SpecError:
    close = get_close_matches(which.lower(), BUILT_IN, 1)
    hint = f"did you mean {close[0]}?" if close else "name one of these or check the path"
    return SpecError(
        f"process {shown(which)} is neither built in ({', '.join(BUILT_IN)}) nor a file: {hint}"
    )


def _option(text: str) -> tuple[str, object]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not key:
        raise SpecError(f"option {text!r} is not kind=value: write for instance seat_um=20")
    known = dict(fields(Process))
    if key in known and section_of(known[key]):
        key += ".magnitude"
    elif key not in known:
        raise unknown_key("option", key, Process)
    return key, _value(value)


def _value(text: str) -> object:
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text


def _put(table: Table, key: str, value: object) -> None:
    kind, dot, leaf = key.partition(".")
    if not dot:
        table[kind] = value
    elif isinstance(given := table.get(kind, {}), dict):
        # What a figure's source says holds no more once the figure is changed.
        table[kind] = {**given, "source": BY_USER, leaf: value}
