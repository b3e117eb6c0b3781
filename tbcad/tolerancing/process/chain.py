"""Kinds of error as files have them, and process chains: steps whose errors add up on a shell."""

import math
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from math import hypot
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field, ValidationError

from tbcad.core.spec.csv_rows import Table, read_toml
from tbcad.core.spec.errors import SpecError, short_text, validation_error
from tbcad.core.spec.section import Section
from tbcad.tolerancing.montecarlo.error_kinds import Distribution, Error

MICROMETRE = 1e-3  # mm

Source: TypeAlias = Annotated[str, Field(pattern=r"\S", max_length=2000)]


class Fact(Section):
    """Words of a step for a workshop."""

    value: str = Field(pattern=r"^[ -~]*[!-~][ -~]*$", max_length=120)
    """In words, ASCII."""
    source: Source
    """Where it comes from; says so where it is a judgement."""


class Instrument(Fact):
    """Instrument that measures the form of mirrors."""

    uncertainty_um: float = Field(gt=0, le=1000)
    """Expanded uncertainty (k = 2) of a height within a mirror and its neighbours, micrometres."""


class ErrorSpec(Section):
    """One kind of error: common to all builds (mean), and different in each (magnitude)."""

    unit: ClassVar[float] = 1.0

    magnitude: float = Field(ge=0)
    """Standard deviation if normal, half width if uniform."""
    mean: float = 0.0
    """Error common to all builds."""
    distribution: Distribution = "normal"
    """Of the error about its mean."""
    source: Source
    """Where the figures come from; says so where they are a judgement."""

    @property
    def error(self) -> Error:
        """The same in mm, radians or as a share."""
        return Error(self.unit * self.magnitude, self.unit * self.mean, self.distribution)

    @property
    def sigma(self) -> float:
        """Standard deviation, in the unit of the file."""
        return Error(self.magnitude, 0.0, self.distribution).sigma


class Micrometres(ErrorSpec):
    """An error in micrometres."""

    unit: ClassVar[float] = MICROMETRE
    magnitude: float = Field(ge=0, le=10_000)
    mean: float = Field(0.0, ge=-10_000, le=10_000)


class WithoutMean(ErrorSpec):
    """An error that differs from place to place or is the same in all builds."""

    mean: float = Field(0.0, ge=0, le=0)
    """None: it would move the whole part, or is the magnitude."""
    distribution: Literal["normal"] = "normal"
    """Always normal."""


class SmoothMicrometres(WithoutMean):
    """An error in micrometres that neighbouring places of a part share."""

    unit: ClassVar[float] = MICROMETRE
    magnitude: float = Field(ge=0, le=10_000)
    length_mm: float = Field(ge=20, le=10_000)
    """Correlation length: at this distance 61 % of the error is shared, at twice of it 14 %."""

    @property
    def error(self) -> Error:
        """The same in mm."""
        return replace(super().error, length=self.length_mm)


class RootMeanSquare(WithoutMean):
    """A form error within each mirror, in micrometres."""

    unit: ClassVar[float] = MICROMETRE
    magnitude: float = Field(ge=0, le=10_000)


class FilletRadius(WithoutMean):
    """Radius of the fillets in the valleys between mirrors, in millimetres."""

    magnitude: float = Field(ge=0, le=10)
    """The radius: the same in all builds."""

    @property
    def error(self) -> Error:
        """The same in mm."""
        return Error(0.0, self.unit * self.magnitude)


class FilletMicrometres(FilletRadius):
    """Radius of the fillets in the valleys between mirrors, in micrometres."""

    unit: ClassVar[float] = MICROMETRE
    magnitude: float = Field(ge=0, le=10_000)


class Millimetres(ErrorSpec):
    """An error in millimetres."""

    magnitude: float = Field(ge=0, le=100)
    mean: float = Field(0.0, ge=-100, le=100)


class Permille(ErrorSpec):
    """An error as a share, in thousandths."""

    unit: ClassVar[float] = 1e-3
    magnitude: float = Field(ge=0, le=200)
    mean: float = Field(0.0, ge=-200, le=200)


class Percent(ErrorSpec):
    """A share in hundredths."""

    unit: ClassVar[float] = 1e-2
    magnitude: float = Field(ge=0, le=200)
    mean: float = Field(0.0, ge=0, le=200)


class Milliradians(ErrorSpec):
    """An error in milliradians."""

    unit: ClassVar[float] = 1e-3
    magnitude: float = Field(ge=0, le=500)
    mean: float = Field(0.0, ge=-500, le=500)


class Degrees(ErrorSpec):
    """An error in degrees."""

    unit: ClassVar[float] = math.radians(1)
    magnitude: float = Field(ge=0, le=45)
    mean: float = Field(0.0, ge=-45, le=45)


STEPS_FILE = "steps.toml"
CUTTER = "cutter_radius_mm"
FACTS = {"title", "mandrel", "material", "treatment", "measured_with"}  # of a step, not its errors
NOTHING = "No step adds to it"


class ChainStep(Section):
    """One step of a chain: what it adds to a shell. Kinds that it has nothing of are left out."""

    title: str = Field(pattern=r"\S", max_length=200)
    """The step in words."""
    mandrel: bool = False
    """Whether what it makes is the negative, from which a later step takes the shell."""
    material: Fact | None = None
    """Material of the part, with temper; none: the step works on what is there."""
    treatment: Fact | None = None
    """How stress is relieved, or what protects a coat."""
    measured_with: Instrument | None = None
    """Instrument for the mirrors' form after this step."""
    sphere_centre_um: Micrometres | None = None
    sphere_radius_um: Micrometres | None = None
    warp_um: SmoothMicrometres | None = None
    waviness_um: RootMeanSquare | None = None
    groove_wall_um: Micrometres | None = None
    scale_isotropic_permille: Permille | None = None
    scale_axis_permille: Permille | None = None
    coating_um: Micrometres | None = None
    facets_mm: Millimetres | None = None
    cutter_radius_mm: FilletRadius | None = None
    ridge_rounding_um: FilletMicrometres | None = None


def chained(names: object, own: object, where: str) -> Table:
    """The kinds of error that steps add up to, as a process has them.

    Errors of steps are independent: their variances add, and so do their means. Of fillets the
    largest radius counts, of correlation lengths that of the largest warp. A cutter of the mandrel
    leaves none, because its edges are ridges. Kinds that no step has are zero.

    Args:
        names: of the steps, in their order: built-in ones, or of own.
        own: tables of steps by their names.
        where: what messages name.

    Raises:
        SpecError: no list of names, an unknown step, one that is not used, or a table that is not
            allowed.
    """
    if not (isinstance(names, list) and names and all(isinstance(name, str) for name in names)):
        raise SpecError(
            f"{where}: steps is {short_text(names)}, allowed is a list of names of steps"
        )
    if not isinstance(own, dict):
        raise SpecError(f"{where}: step is {short_text(own)}, allowed are tables [step.NAME]")
    if unused := [name for name in own if name not in names]:
        raise SpecError(f"{where}: step {unused[0]} is not in steps: add it there, or leave it out")
    tables = {**_built_in(), **own}
    steps = [(name, _step(name, tables, where)) for name in names]
    mandrels = [step for _, step in steps if step.mandrel]
    whole: dict[str, Any] = {"steps": names, "mandrel_cutter_mm": _cutter(mandrels)}
    whole["made"] = [tables[name] for name in names]
    for kind in sorted(ChainStep.model_fields.keys() - FACTS):
        those = [pair for pair in steps if kind != CUTTER or not pair[1].mandrel]
        parts = [(name, getattr(step, kind)) for name, step in those]
        whole[kind] = _sum([(name, part) for name, part in parts if part is not None], kind)
    return whole


def _cutter(mandrels: list[ChainStep]) -> float | None:
    """Radius of the largest cutter of a mandrel, mm, 0 if no step names one; None: no mandrel."""
    radii = [step.cutter_radius_mm.magnitude for step in mandrels if step.cutter_radius_mm]
    return max(radii, default=0.0) if mandrels else None


@cache
def _built_in() -> Table:
    file = files("tbcad.tolerancing").joinpath("process", STEPS_FILE)
    return read_toml(file, STEPS_FILE, "process")


def _step(name: str, tables: Table, where: str) -> ChainStep:
    if name not in tables:
        close = get_close_matches(name, tables, 1)
        hint = f"did you mean {close[0]}?" if close else f"write its table, [step.{name}]"
        raise SpecError(
            f"{where}: there is no step {short_text(name)}, allowed are {', '.join(tables)}: {hint}"
        )
    try:
        return ChainStep.model_validate(tables[name])
    except ValidationError as error:
        raise validation_error(error, ChainStep, f"{where}, step {name}", set()) from None


def _sum(parts: list[tuple[str, ErrorSpec]], kind: str) -> Table:
    """One kind of error of all steps that have it, as a table."""
    if not parts:
        length = {"length_mm": 80} if kind == "warp_um" else {}
        return {"magnitude": 0, "source": NOTHING, **length}
    kinds = [part for _, part in parts]
    largest = max(kinds, key=lambda part: part.magnitude)
    source = "; ".join(f"{name}: {part.source.strip()}" for name, part in parts)
    if len(parts) == 1 or isinstance(largest, FilletRadius):
        return {**largest.model_dump(), "source": source}
    return {
        **largest.model_dump(),
        "magnitude": hypot(*(part.sigma for part in kinds)),
        "mean": sum(part.mean for part in kinds),
        "distribution": "normal",
        "source": source,
    }
