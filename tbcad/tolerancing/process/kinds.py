"""Kinds of error as files have them: figures with units, each with its source."""

import math
from dataclasses import replace
from typing import Annotated, ClassVar, Literal, TypeAlias

from pydantic import Field

from tbcad.core.spec.section import Section
from tbcad.tolerancing.montecarlo.error_kinds import Distribution, Error

MICROMETRE = 1e-3  # mm

Source: TypeAlias = Annotated[str, Field(pattern=r"\S", max_length=2000)]


class Fact(Section):
    """What a workshop is told of a step."""

    value: str = Field(pattern=r"^[ -~]*[!-~][ -~]*$", max_length=120)
    """In words, ASCII."""
    source: Source
    """Where it comes from; says so where it is a judgement."""


class Instrument(Fact):
    """What measures the form of mirrors."""

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


class SmoothMicrometres(Micrometres):
    """An error in micrometres that neighbouring places of a part share."""

    mean: float = Field(0.0, ge=0, le=0)
    """None: it would move the whole part."""
    distribution: Literal["normal"] = "normal"
    """Always normal."""
    length_mm: float = Field(ge=20, le=10_000)
    """Correlation length: at this distance 61 % of the error is shared, at twice of it 14 %."""

    @property
    def error(self) -> Error:
        """The same in mm."""
        return replace(super().error, length=self.length_mm)


class RootMeanSquare(Micrometres):
    """A form error within each mirror, in micrometres."""

    mean: float = Field(0.0, ge=0, le=0)
    """None: it differs from mirror to mirror."""
    distribution: Literal["normal"] = "normal"
    """Always normal."""


class FilletRadius(ErrorSpec):
    """Radius of the fillets in the valleys between mirrors, in millimetres."""

    magnitude: float = Field(ge=0, le=10)
    """The radius: the same in all builds."""
    mean: float = Field(0.0, ge=0, le=0)
    """None: the radius is the magnitude."""
    distribution: Literal["normal"] = "normal"
    """Without a meaning here."""

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
