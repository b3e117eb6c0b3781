"""The section [printer] of the design: what the printed parts are made on and of."""

from typing import Annotated, TypeAlias

from pydantic import BeforeValidator, Field

from tbcad.core.spec.section import Section, as_tuple

_Side: TypeAlias = Annotated[float, Field(ge=20, le=2000)]
Bed: TypeAlias = Annotated[tuple[_Side, _Side, _Side], BeforeValidator(as_tuple)]


class PrinterSpec(Section):
    """The printer and its material, for all printed parts of the prototype."""

    bed_mm: Bed = (256.0, 256.0, 256.0)
    """Width, depth and height of what the printer can make."""
    bed_margin_mm: float = Field(3.0, ge=0, le=50)
    """Width of the bed's border that stays free, also below the printer's full height."""
    density_g_cm3: float = Field(1.27, gt=0, le=20)
    """Density of the printed material (PETG 1.27, PLA 1.24, PA12 1.01)."""
