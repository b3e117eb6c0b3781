"""The design spec: what a user may choose, in named units, checked before anything is computed.

Every key, its unit, range and default stand here once; `designs/turtleback.toml` explains them
at length and equals the defaults, which are the design of the paper.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from tbcad.spec.errors import SpecError, fields, refused, section_of, unknown_key
from tbcad.spec.prototype import PrototypeSpec
from tbcad.spec.section import Section, as_tuple

_LARGEST_FILE = 1_000_000  # bytes; a design is a few thousand
_HOLE_EDGE_MM = 1.0  # material that must stay on either side of a hole in a flange
_BUILT_IN = "built-in design"

Table: TypeAlias = dict[str, Any]


def _whole(value: object) -> object:
    if type(value) is not int:  # true and 1.0 equal 1, so Literal[1] would take them
        raise ValueError("allowed is the whole number 1: change it")
    return value


Point: TypeAlias = Annotated[
    tuple[
        Annotated[float, Field(gt=0, le=10_000)],
        Annotated[float, Field(ge=-10_000, le=10_000)],
        Annotated[float, Field(ge=-10_000, lt=0)],
    ],
    BeforeValidator(as_tuple),
]
RadiusRule: TypeAlias = Literal["traced", "paper", "flat"]


class OpticsSpec(Section):
    """Where the mirrors, the cameras and the object are."""

    n: int = Field(18, ge=1, le=60)
    """Subdivision of the icosahedron: the number of mirrors grows with its square."""
    capture_diameter_mm: float = Field(60.0, gt=0, le=1000)
    """Diameter of the capture sphere, which every virtual camera must see whole."""
    camera_mm: Point = (100.0, 0.0, -100.0)
    """Pinhole of camera a; camera b is its mirror image in the plane x = 0."""
    semi_minor_mm: float = Field(100.0, ge=1, le=5000)
    """Semi-minor axis of both ellipsoids, whose foci are the origin and a pinhole."""


class CameraSpec(Section):
    """The sensor and lens of both cameras."""

    width_px: int = Field(2080, ge=16, le=32_768)
    """Columns of the sensor."""
    height_px: int = Field(1552, ge=16, le=32_768)
    """Rows of the sensor."""
    hfov_deg: float = Field(89.0, ge=1, le=170)
    """Angle of view across the columns."""


class MirrorsSpec(Section):
    """How the mirrors are curved."""

    radius_rule: RadiusRule = "traced"
    """Radii from exact ray tracing, from eqs. 1 and 2 of the paper, or planar mirrors."""
    margin_mm: float = Field(0.6, ge=0, le=20)
    """Coverage added to the capture diameter as the target of rule traced."""
    max_radius_widths: float = Field(30.0, ge=5, le=1000)
    """Largest radius in half widths l; a mirror that needs less curvature is nearly flat."""
    coating_um: float = Field(0.0, ge=0, le=500)
    """Thickness of the mirror coat; the modelled sphere is smaller by it."""


class FlangeSpec(Section):
    """A flange with its bolt and dowel holes."""

    width_mm: float = Field(12.0, ge=4, le=100)
    """How far the flange stands out."""
    thickness_mm: float = Field(5.0, ge=1, le=50)
    """Thickness of the plate."""
    bolt_hole_mm: float = Field(4.3, ge=1, le=30)
    """Diameter of the bolts' clearance holes."""
    bolts: int = Field(6, ge=2, le=60)
    """Number of bolt holes."""
    dowel_hole_mm: float = Field(4.0, ge=1, le=30)
    """Diameter of the dowel holes."""
    dowels: int = Field(2, ge=0, le=10)
    """Number of dowel holes."""

    @model_validator(mode="after")
    def _holes_fit(self) -> Self:
        largest = self.width_mm - 2 * _HOLE_EDGE_MM
        for key in ("bolt_hole_mm", "dowel_hole_mm"):
            if (hole := getattr(self, key)) > largest:
                raise ValueError(
                    f"{key} {hole:g} does not fit in width_mm {self.width_mm:g}, which leaves room "
                    f"for {largest:g}: make the hole smaller or the flange wider"
                )
        return self


class FootFlangeSpec(FlangeSpec):
    """The flange that carries the shell on its base plate."""

    bolts: int = Field(5, ge=2, le=60)
    """Number of bolt holes."""


class ShellSpec(Section):
    """The body behind the mirrors."""

    wall_mm: float = Field(3.0, ge=0.4, le=50)
    """Material behind the deepest valley between mirrors."""
    seam_flange: FlangeSpec = FlangeSpec()
    """Joins the two halves at x = 0."""
    foot_flange: FootFlangeSpec = FootFlangeSpec()
    """Joins a half to the base plate."""


class MeshSpec(Section):
    """How fine the STL and 3MF are."""

    ray_error_mm: float = Field(0.05, ge=0.01, le=10)
    """How far a ray off a facet may miss, at the capture sphere, the ray off the exact sphere."""
    chord_error_mm: float = Field(0.015, ge=0.0002, le=1)
    """Distance of a mirror's facets from its sphere."""
    structure_error_mm: float = Field(0.02, ge=0.002, le=5)
    """Distance of all other facets (back, flanges, holes) from the exact surface."""


class StepSpec(Section):
    """How the STEP is written."""

    pcurves: bool = False
    """Write the curves in the surfaces' parameters too: files grow about eightfold."""


class Spec(Section):
    """A whole design: every key with its value, checked and frozen."""

    name: str = Field("turtleback", pattern="^[A-Za-z0-9][A-Za-z0-9 ._-]{0,79}$")
    """Name of the design, for file headers and reports."""
    schema_version: Annotated[Literal[1], BeforeValidator(_whole)] = Field(1, alias="schema")
    """Version of this table's keys."""
    optics: OpticsSpec = OpticsSpec()
    camera: CameraSpec = CameraSpec()
    mirrors: MirrorsSpec = MirrorsSpec()
    shell: ShellSpec = ShellSpec()
    mesh: MeshSpec = MeshSpec()
    step: StepSpec = StepSpec()
    prototype: PrototypeSpec = PrototypeSpec()

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        _check_capture_sphere(self.optics)
        if self.mesh.structure_error_mm > self.shell.wall_mm / 2:
            raise ValueError(
                f"mesh.structure_error_mm {self.mesh.structure_error_mm:g} is more than half of "
                f"shell.wall_mm {self.shell.wall_mm:g}: make it {self.shell.wall_mm / 2:g} or less"
            )
        return self


def _check_capture_sphere(optics: OpticsSpec) -> None:
    radius, to_pinhole = optics.capture_diameter_mm / 2, math.hypot(*optics.camera_mm)
    if radius >= to_pinhole:
        raise ValueError(
            f"optics.camera_mm is inside the capture sphere: bring it more than {radius:g} mm "
            "from the origin or make optics.capture_diameter_mm smaller"
        )
    c = to_pinhole / 2
    nearest = math.hypot(optics.semi_minor_mm, c) - c  # of the ellipsoid to its focus
    if radius >= nearest:
        raise ValueError(
            f"the capture sphere of {radius:.4g} mm radius does not fit inside the ellipsoid, "
            f"which comes to {nearest:.4g} mm of the origin: make optics.semi_minor_mm more than "
            f"{math.sqrt(radius**2 + 2 * radius * c):.4g} or optics.capture_diameter_mm less than "
            f"{2 * nearest:.4g}"
        )


def load_spec(path: Path | None, overrides: Mapping[str, str] | Sequence[str] = ()) -> Spec:
    """Return the design in a TOML file, or the built-in one, with options on top.

    Args:
        path: a TOML file; None for the built-in design.
        overrides: "key=value" texts, or a mapping of them, the later over the earlier. A key is
            dotted, or the end of exactly one dotted key; a value is TOML, or else text.

    Raises:
        SpecError: anything that cannot be read, is unknown, or is not allowed.
    """
    table = {} if path is None else _read(path)
    options = [_option(text) for text in _texts(overrides)]
    for key, value in options:
        _put(table, key.split("."), value)
    try:
        return Spec.model_validate(table)
    except ValidationError as error:
        where = _BUILT_IN if path is None else str(path)
        raise refused(error, Spec, where, {key for key, _ in options}) from None


def spec_dict(spec: Spec) -> Table:
    """Return the design as plain JSON values, keys in the order of the spec."""
    return spec.model_dump(mode="json", by_alias=True)


def _read(path: Path) -> Table:
    text = _read_text(path)
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SpecError(f"{path}: tables nested too deeply: flatten them") from None
    except ValueError as error:
        raise SpecError(f"{path}: not valid TOML: {error}: correct that line") from None


def _read_text(path: Path) -> str:
    try:
        if path.exists() and not path.is_file():
            raise SpecError(f"{path}: not a file: name a design file (.toml)")
        with path.open("rb") as file:
            data = file.read(_LARGEST_FILE + 1)
        if len(data) > _LARGEST_FILE:
            raise SpecError(f"{path}: over 1 MB, no design: name a design file (.toml)")
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise SpecError(f"{path}: not UTF-8 text (line {line}): save it as UTF-8") from None
    except (OSError, ValueError) as error:  # ValueError: a path with a null character
        if isinstance(error, SpecError):
            raise
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SpecError(f"{path}: cannot be read: {reason}: check the path") from None


def _texts(overrides: Mapping[str, str] | Sequence[str]) -> list[str]:
    if isinstance(overrides, Mapping):
        return [f"{key}={value}" for key, value in overrides.items()]
    return list(overrides)


def _option(text: str) -> tuple[str, object]:
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise SpecError(f"option {text!r} is not key=value: write for instance optics.n=18")
    return _full_key(key.strip()), _value(value.strip())


def _full_key(key: str) -> str:
    """The whole key that a key or its end means: the one nearest to the top of the design."""
    known = {name for name, field in fields(Spec) if section_of(field) is None}
    if key in known:
        return key
    ending = [name for name in known if name.endswith("." + key)]
    top = min((name.count(".") for name in ending), default=0)
    match sorted(name for name in ending if name.count(".") == top):
        case [only]:
            return only
        case []:
            raise unknown_key("option", key, Spec)
        case several:
            raise SpecError(f"option {key} may be {' or '.join(several)}: write the whole key")


def _value(text: str) -> object:
    try:
        table = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return table["value"] if len(table) == 1 else text


def _put(table: Table, path: list[str], value: object) -> None:
    *sections, leaf = path
    for section in sections:
        inner = table.setdefault(section, {})
        if not isinstance(inner, dict):
            return  # the file is wrong here, which validation will say
        table = inner
    table[leaf] = value
