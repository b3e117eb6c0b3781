"""Manufacturing processes: the errors of each, from TOML, with a source for every figure.

docs/decisions/0007-how-tolerances-are-computed.md says what a figure means, and how it follows
from a maker's tolerance.
"""

from collections.abc import Sequence
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, ValidationError

from tbcad.core.spec.csv_rows import Table, read_toml, toml_value
from tbcad.core.spec.errors import (
    SpecError,
    dotted_fields,
    section_of,
    short_text,
    unknown_key,
    validation_error,
)
from tbcad.core.spec.prototype import CapMaking, GradeName
from tbcad.core.spec.section import Section, as_tuple, whole
from tbcad.prototype.balls.catalogue import load_grades
from tbcad.tolerancing.montecarlo.error_kinds import Error, Errors
from tbcad.tolerancing.process.chain import (
    MICROMETRE,
    ChainStep,
    Degrees,
    ErrorSpec,
    FilletMicrometres,
    FilletRadius,
    Micrometres,
    Millimetres,
    Milliradians,
    Percent,
    Permille,
    RootMeanSquare,
    SmoothMicrometres,
    chained,
)

BUILT_IN = (
    "fdm", "sls", "sla", "cnc", "diamond",
    "nickel-diamond", "nickel-milled", "epoxy", "urethane", "segments", "inserts",
)  # fmt: skip
DEFAULT_PROCESS = "sla"
BY_USER = "set by an option"
CAPS_FILE = "caps.toml"
AS_CAPS = RootMeanSquare(magnitude=0, source=f"By how the design's caps are made: {CAPS_FILE}")
SHARP = "Not stated: valleys are taken as sharp, a judgement that flatters milled shells"


class Process(Section):
    """A manufacturing process of a shell or a prototype, and its errors."""

    name: str = Field(pattern="^[A-Za-z0-9][A-Za-z0-9 ._-]{0,79}$")
    """Name of the process, for reports."""
    title: str = Field(pattern=r"\S", max_length=200)
    """The process in words."""
    schema_version: Annotated[Literal[1], BeforeValidator(whole)] = Field(1, alias="schema")
    """Version of this table's keys."""
    steps: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] = ()
    """Steps of a chain, whose errors are added up; none: the figures are the process' own."""
    made: Annotated[tuple[ChainStep, ...], BeforeValidator(as_tuple)] = ()
    """Words for a workshop: each step with material, treatment and instrument."""
    mandrel_cutter_mm: float | None = Field(None, ge=0, le=100)
    """Radius of the cutter of a mandrel, the shell's negative that the shell is taken from; none:
    the shell itself is made."""
    sphere_centre_um: Micrometres
    """Each mirror's centre along each axis, by itself, without growth and warp of the shell."""
    sphere_radius_um: Micrometres
    """Each mirror's radius, with its centre fixed."""
    warp_um: SmoothMicrometres
    """Each shell: smooth displacement of its points along each axis."""
    waviness_um: RootMeanSquare
    """Root mean square of the height of the form error within each mirror."""
    groove_wall_um: Micrometres
    """Each wall of a groove between mirrors on pedestals along its normal, by itself."""
    scale_isotropic_permille: Permille
    """Growth of each shell."""
    scale_axis_permille: Permille
    """Growth of both shells along each axis of the frame, besides that of each shell."""
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
    """Thickness of each shell's coating: the mean is all of it; a design may allow for a part."""
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
    cap_tilt_mrad: Milliradians
    """Prototype: each cap about each axis across its own."""
    cap_sagitta_um: RootMeanSquare = AS_CAPS
    """Prototype: each cap's power, as the sagitta of its front over the part in use."""
    cap_astigmatism_um: RootMeanSquare = AS_CAPS
    """Prototype: each of both terms of the front's astigmatism, root mean square over that part."""
    cap_coma_um: RootMeanSquare = AS_CAPS
    """Prototype: likewise, of its coma."""
    cap_trefoil_um: RootMeanSquare = AS_CAPS
    """Prototype: likewise, of its trefoil."""
    cap_spherical_um: RootMeanSquare = AS_CAPS
    """Prototype: spherical aberration of the front, root mean square over that part."""
    wind_up_percent: Percent
    """Prototype: turn of the base because motor and belt yield to gravity, of that worked out."""
    sag_percent: Percent
    """Prototype: displacements of the balls by weight, of those worked out; of the carrier and of
    what holds it."""
    cutter_radius_mm: FilletRadius = FilletRadius(magnitude=0, source=SHARP)
    """Ball cutter that mills the valleys between mirrors of a shell: 0 for sharp valleys."""
    ridge_rounding_um: FilletMicrometres = FilletMicrometres(magnitude=0, source=SHARP)
    """Radius to which polishing and coating round a mandrel's ridges, the replica's valleys."""
    ball_grade: GradeName
    """Prototype: grade of the balls by ISO 3290-1."""

    @property
    def ball_mm(self) -> float | None:
        """Radius of the ball cutter that cuts mirrors, of a mandrel where there is one, mm."""
        of_shell, of_mandrel = self.cutter_radius_mm.magnitude, self.mandrel_cutter_mm
        return (of_shell if of_mandrel is None else of_mandrel) or None


def load_process(which: str, overrides: Sequence[str] = ()) -> Process:
    """Return a built-in process, or one of a TOML file, with options "kind.key=value" on top.

    A file may name a built-in process as `based_on`, and `steps` that its shells go through; each
    kind of error that it has replaces the whole kind there, so that no figure keeps the source of
    another.

    SpecError: anything that cannot be read, is unknown, or is not allowed.
    """
    if not which.strip():
        raise SpecError(
            f"process is {short_text(which)}, allowed is one of {', '.join(BUILT_IN)} or a TOML "
            "file: name one"
        )
    name = f"built-in process {which}" if which in BUILT_IN else which
    table = _built_in(which) if which in BUILT_IN else _own(Path(which))
    options = [_option(text) for text in overrides]
    for key, value in options:
        _put(table, key, value)
    try:
        return Process.model_validate(table)
    except ValidationError as error:
        raise validation_error(error, Process, name, {key for key, _ in options}) from None


def process_errors(
    process: Process, known_coating_um: float = 0.0, caps: CapMaking = "printed"
) -> Errors:
    """Return the errors of a process in mm, radians and shares.

    Only a coating beyond the known one, which the design allows for, is an error. Forms of caps
    that the process does not state are those of how the design's caps are made.
    """
    kinds = {key: value for key, value in process if isinstance(value, ErrorSpec)}
    made = {} if caps == "none" else cap_forms(caps)
    kinds |= {key: one for key, one in made.items() if kinds[key] == AS_CAPS}
    coating = kinds["coating_um"]
    kinds["coating_um"] = coating.model_copy(update={"mean": coating.mean - known_coating_um})
    errors = {key.rpartition("_")[0]: kind.error for key, kind in kinds.items()}
    return Errors(**errors, ball_radius=ball_radius_error(process.ball_grade))


@cache
def cap_forms(caps: Literal["printed", "turned"]) -> dict[str, RootMeanSquare]:
    """Form errors of caps by how they are made, as the keys of a process that begin with cap."""
    file = files("tbcad.tolerancing").joinpath("process", CAPS_FILE)
    table = read_toml(file, CAPS_FILE, "process")[caps]
    return {key: RootMeanSquare.model_validate(one) for key, one in table.items()}


def ball_radius_error(grade: str) -> Error:
    """Return the error of the radii of purchased balls, mm.

    A lot's diameters differ by at most its variation (ISO 3290-1: V_DwL), and one ball's radius
    by its deviation from spherical form; the sum of both half widths is taken.
    """
    limits = load_grades()[grade]
    half_width = limits.lot_variation_um / 4 + limits.sphericity_um / 2
    return Error(MICROMETRE * half_width, 0.0, "uniform")


def _built_in(name: str) -> Table:
    file = files("tbcad.tolerancing").joinpath("process", f"{name}.toml")
    return _resolved(read_toml(file, name, "process"), name, name)


def _own(path: Path) -> Table:
    if path.is_file():
        return _resolved(read_toml(path, str(path), "process"), path.stem, str(path))
    close = get_close_matches(str(path).lower(), BUILT_IN, 1)
    hint = f"did you mean {close[0]}?" if close else "name one of these or check the path"
    raise SpecError(
        f"process {short_text(str(path))} is neither built in ({', '.join(BUILT_IN)}) nor a "
        f"file: {hint}"
    )


def _resolved(table: Table, name: str, where: str) -> Table:
    """A file's table on top of what it is based on and of what its steps add up to."""
    base, whole = table.pop("based_on", None), {}
    if base is not None:
        if base not in BUILT_IN:
            raise SpecError(
                f"{where}: based_on is {short_text(base)}, allowed is {' or '.join(BUILT_IN)}: "
                "change it"
            )
        whole = {**_built_in(base), "name": name}
    if "steps" in table:
        whole |= chained(table.pop("steps"), table.pop("step", {}), where)
    return {**whole, **table}


def _option(text: str) -> tuple[str, object]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not key:
        raise SpecError(f"option {text!r} is not kind=value: write for instance seat_um=20")
    known = dict(dotted_fields(Process))
    if key in known and section_of(known[key]):
        key += ".magnitude"
    elif key not in known:
        raise unknown_key("option", key, Process)
    return key, toml_value(value)


def _put(table: Table, key: str, value: object) -> None:
    kind, dot, leaf = key.partition(".")
    if not dot:
        table[kind] = value
    elif isinstance(given := table.get(kind, {}), dict):
        # The source of a figure does not apply once the figure is changed.
        table[kind] = {**given, "source": BY_USER, leaf: value}
